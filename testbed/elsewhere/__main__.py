"""`python -m testbed.elsewhere --cases N --seed S --out DIR --keys DIR`: draw and fly cases, write records and keys."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import NoReturn

from testbed.elsewhere.aircraft import CENTRES
from testbed.elsewhere.draw import draw_case, order


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        """Exit with 2."""
        self.exit(2, f"{self.prog}: {message}\n")


def number(text: str) -> int:
    """A whole number of at least 0."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"'{text}' is no whole number of at least 0")
    return int(text)


def main() -> None:
    """Write N cases and their keys; case i of seed S is the same whatever N is."""
    parser = Parser(prog="python -m testbed.elsewhere", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=number, default=36)
    parser.add_argument("--seed", type=number, default=1)
    parser.add_argument("--out", type=Path, required=True, help="folder of records, one folder a case")
    parser.add_argument("--keys", type=Path, required=True, help="folder of truths, one file a case")
    parser.add_argument("--centre", choices=CENTRES, default="uiuc", help="what derivatives scatter about")
    given = parser.parse_args()
    try:
        for folder in (given.out, given.keys):  # before a flight is wasted
            folder.mkdir(parents=True, exist_ok=True)
        for turn in order(given.cases, given.seed):
            begun = time.perf_counter()
            name = draw_case(turn, given.seed, given.out, given.keys, given.centre)
            print(f"{turn.case + 1}/{given.cases} {name} {time.perf_counter() - begun:.1f} s", flush=True)
    except OSError as error:
        parser.error(f"{error.filename or given.out}: {error.strerror or error}")


if __name__ == "__main__":
    main()
