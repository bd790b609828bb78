"""Fly held-out records again with what the answers say: closure that no solver computes for itself.

`python -m testbed.withheld.refly ANSWERS KEYS OUT`, once the keys are open. The published aircraft with the effects
of the first hypothesis at their estimates, in the library's form and on the generator's plant, flies the windows of
`windows.py`; one file per single effect or pair goes to OUT, where the scorer reads it. What is there is kept.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from testbed.withheld.distance import MOTION
from testbed.withheld.draw import Design
from testbed.withheld.effects import BY_NAME
from testbed.withheld.files import read_json, write_text
from testbed.withheld.flights import Aircraft, recorded
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS
from testbed.withheld.windows import gap_of, held
from testbed.workers import a_core_each

FLOWN_AGAIN = ("single", "pair")  # tiers with an effect that the library holds
Parts = tuple[tuple[str, str, float], ...]


def refly(answers: Path, keys: Path, out: Path, workers: int = 1,
          progress: Callable[[str], None] = lambda text: None) -> None:
    """Write OUT/NAME.json for every answered case of FLOWN_AGAIN that has none.

    Args:
        answers, keys: folders with one JSON file per case.
        out: a folder, made if absent.
        workers: processes.
        progress: told how far it is.
    """
    out.mkdir(parents=True, exist_ok=True)
    left = [path for path in sorted(answers.glob("*.json"))
            if not (out / path.name).is_file() and read_json(keys / path.name)["tier"] in FLOWN_AGAIN]
    if workers == 1 or not left:
        done = map(_one, left, repeat(keys), repeat(out))
        _tell(done, len(left), progress)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        _tell(pool.map(_one, left, repeat(keys), repeat(out), chunksize=8), len(left), progress)


def _tell(done: Any, total: int, progress: Callable[[str], None]) -> None:
    for k, _ in enumerate(done, start=1):
        if k % 50 == 0 or k == total:
            progress(f"answers flown again: {k} of {total}")


def _one(answer: Path, keys: Path, out: Path) -> None:
    write_text(out / answer.name, json.dumps(flown_again(read_json(answer), read_json(keys / answer.name))))


def flown_again(answer: dict[str, Any], key: dict[str, Any]) -> dict[str, Any]:
    """Gaps of an answer's model on the held-out records of its case.

    Returns:
        `after` from the published aircraft, `own_after` from this aircraft's own derivatives and mass; `flown`: what
        was added, `not_flown`: what the generator has no form of.
    """
    parts, lacking = told(answer)
    design = Design(key["tier"], true_parts(key), **key["design"])
    aircraft = Aircraft(design.baseline, design.parts)
    flights = [held(*recorded(aircraft, m, design.gain, design.air, design.random(i)))
               for i, m in enumerate(PLANS[design.plan]) if i >= DIAGNOSED]
    own = np.array([key["held_out"]["f"][name] for name in MOTION]) ** 2
    return {"after": gap_of(Aircraft(parts=parts), flights, own),
            "own_after": gap_of(Aircraft(design.baseline, parts), flights, own),
            "flown": {name: size for name, _, size in parts}, "not_flown": lacking}


def true_parts(key: dict[str, Any]) -> Parts:
    """Effects, forms and sizes of a key."""
    sizes = (next(iter(key["parameters"][name].values())) for name in key["effects"])
    return tuple(zip(key["effects"], key["forms"], sizes, strict=True))


def told(answer: dict[str, Any]) -> tuple[Parts, list[str]]:
    """Effects of an answer as parts of an aircraft; those (and their parameters) that the generator lacks.

    Nothing where the verdict is not "explained": then the model stays as it was.
    """
    if answer.get("verdict") != "explained":
        return (), []
    named = [h for h in answer["hypotheses"] if h["effects"]]
    first: dict[str, Any] = max(named, key=lambda h: h["probability"], default={"effects": []})
    described = {entry["name"]: entry["parameters"] for entry in answer["effects"]}
    parts, lacking = list[tuple[str, str, float]](), list[str]()
    for name in first["effects"]:
        for parameter, value in described.get(name, {}).items():
            full = name if name in BY_NAME and BY_NAME[name].parameter == parameter else f"{name}.{parameter}"
            if full in BY_NAME:
                parts.append((full, "same", float(value["estimate"])))
            else:
                lacking.append(full)
    return tuple(parts), lacking


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    for name in ("answers", "keys", "out"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    with a_core_each():
        refly(given.answers, given.keys, given.out, given.workers, print)


if __name__ == "__main__":
    main()
