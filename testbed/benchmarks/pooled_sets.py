"""Score sets together that one solver answered: many cases in parts, each drawn, sealed and solved by itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from icing_env.errors import InputError
from testbed.benchmarks.diagnosis import kind_of, removals, untouched
from testbed.benchmarks.failures import failures
from testbed.benchmarks.published_sets import PARTS, WITHOUT, unpack
from testbed.withheld.files import read_json
from testbed.withheld.refly import FLOWN_AGAIN
from testbed.withheld.score import score


def pooled(places: Sequence[Path]) -> dict[str, Any]:
    """Every figure of `testbed.withheld.score` over the cases of all sets.

    Args:
        places: folders of runs that ended, or files that these were published in (their keys alone are checked).

    Raises:
        InputError: a folder is not a set whose every case is answered and flown again, its records or keys are not
            those of its manifest, one is sealed and another is not, or another solver (other sources) answered.
    """
    with TemporaryDirectory() as name:
        folders = [unpack(at, Path(name) / f"set_{i}") if at.is_file() else at for i, at in enumerate(places)]
        sets = [_whole(folder, at) for folder, at in zip(folders, places, strict=True)]
        for what in ("set", "sources"):
            values = {entry[what]: at for at, entry in zip(places, sets, strict=True)}
            if len(values) > 1:
                told = ", ".join(f"{at}: {value}" for value, at in values.items())
                raise InputError(f"--pool: sets of different {what} ({told}); give those of one solver and kind")
        for part in (*PARTS, WITHOUT):
            files = [path for folder in folders for path in (folder / part).glob("*.json") if path.stem != "seed"]
            if files:
                (Path(name) / part).mkdir()
            for path in files:
                (Path(name) / part / path.name).symlink_to(path.resolve())
        found = score(*(Path(name) / part for part in (*PARTS, WITHOUT)))
        found["failures"] = failures(*(Path(name) / part for part in ("answers", "keys", WITHOUT)))
    return found | sets[0]


def _whole(folder: Path, given: Path) -> dict[str, Any]:
    """Kind of a set and sources of its answers, once it is known to be complete.

    Args:
        given: where the user has it: that folder, or the file that was unpacked there.
    """
    if not (folder / "manifest.json").is_file():
        raise InputError(f"--pool {given}: no manifest.json; give the --out of a run that ended, or a file that "
                         "--publish wrote")  # fmt: skip
    committed = read_json(folder / "manifest.json")
    untouched(folder, committed, None if given == folder else given)
    wanted = {part: [name for name in committed["cases"] if part != "refly" or _flown_again(folder, name)]
              for part in ("answers", "refly")}  # fmt: skip
    if any((folder / WITHOUT).glob("*.json")):
        wanted[WITHOUT] = list(removals(folder / "keys"))
    lacking = [f"{part}/{name}.json" for part, names in wanted.items() for name in names
               if not (folder / part / f"{name}.json").is_file()]  # fmt: skip
    if lacking:
        raise InputError(f"--pool {given}: {len(lacking)} files are not there, the first is {lacking[0]}; "
                         "let its run end first")
    answers = (read_json(folder / "answers" / f"{name}.json") for name in committed["cases"])
    sources = sorted({a["provenance"]["sources"] for a in answers if "provenance" in a})
    return {"set": kind_of(committed), "sources": " and ".join(sources)}


def _flown_again(folder: Path, name: str) -> bool:
    return read_json(folder / "keys" / f"{name}.json")["tier"] in FLOWN_AGAIN
