"""One flight, recorded in many ways: a clean aircraft must stay clean, and an effect that was told be told.

A development set is drawn by the generator; its cases without a gap and its single effects that can be told are
diagnosed once for every recorder (`testbed.withheld.recorders`). Held-out records are not looked at.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from icing_env.errors import InputError, nearest
from testbed.benchmarks.answers import Progress, answer_all, answered, diagnosis_of
from testbed.benchmarks.diagnosis import drawn
from testbed.benchmarks.failures import HEADERS, failures
from testbed.benchmarks.failures import rows as failed_rows
from testbed.withheld.files import read_json
from testbed.withheld.manoeuvres import DIAGNOSED
from testbed.withheld.recorders import RECORDERS
from testbed.withheld.score import identifiable
from testbed.workers import a_core_each

CASES = 24  # drawn; nine have no gap and nine a single effect
TIERS = ("null", "single")


@a_core_each()
def measure(out: Path, cases: int | None, seed: int, workers: int, chosen: Sequence[str],
            progress: Progress) -> list[dict[str, Any]]:
    """Draw (or finish drawing) a set in `out` and diagnose it as every recorder would have it.

    Args:
        out: folder of records, keys and answers; what it holds already is kept.
        cases: how many to draw; CASES if omitted.
        seed: added to the development seed.
        workers: processes.
        chosen: recorders; all of them if empty.
        progress: told what is being done.

    Returns:
        A row for every recorder: how many cases (`null`, `single`), how many of them are told wrongly (`null_wrong`,
        `single_wrong`) or refused, the median time [s], and what is wrong (`failures`).

    Raises:
        InputError: no such recorder, or `out` holds another set.
    """
    for name in chosen:
        if name not in RECORDERS:
            raise InputError(f"--only: no recorder '{name}'; {nearest(name, list(RECORDERS))}")
    drawn(out, cases or CASES, seed, workers, progress)
    tiers = _tiers(out / "keys")
    found = []
    for recorder in chosen or RECORDERS:
        folder = f"answers_{re.sub(r'[^a-z0-9]+', '_', recorder)}"
        answer_all(out, folder, dict.fromkeys(tiers, (recorder,)), workers, progress, solve)
        wrong = failures(out / folder, out / "keys")
        answers = [read_json(out / folder / f"{name}.json") for name in tiers]
        seconds = [answer["seconds"] for answer in answers if "seconds" in answer]
        found.append({"recorder": recorder, **{tier: list(tiers.values()).count(tier) for tier in TIERS},
                      **{f"{tier}_wrong": sum(one["tier"] == tier for one in wrong) for tier in TIERS},
                      "refused": sum("error" in answer for answer in answers),
                      "seconds": float(np.median(seconds)) if seconds else None, "wrong": wrong})
    return found


def _tiers(keys: Path) -> dict[str, str]:
    """Cases to diagnose, with their tier: those without a gap, and of single effects those that can be told."""
    found = {path.stem: read_json(path) for path in sorted(keys.glob("*.json")) if path.stem != "seed"}
    return {name: key["tier"] for name, key in found.items()
            if key["tier"] == "null" or (key["tier"] == "single" and identifiable(key))}


def solve(case: Path, recorder: str) -> dict[str, Any]:
    """The diagnosis of one case as a recorder would have it; {"error": why} where there is none."""
    from icing_env.record import read

    def work() -> dict[str, Any]:
        rng = np.random.default_rng(int(case.name, 16))
        records = [read(path) for path in sorted(case.glob("*.csv"))[:DIAGNOSED]]
        return diagnosis_of([replace(r, channels=RECORDERS[recorder](dict(r.channels), rng)) for r in records])

    return answered(work, case)


def tables(found: list[dict[str, Any]]) -> list[tuple[str, dict[str, str], list[list[str]]]]:
    """For people: how often each recorder's aircraft are told wrongly, and then every wrong answer."""
    headers = {"recorded": "left", "clean, told as a gap": "right", "effects not named alone": "right",
               "refused": "right", "median, s": "right"}
    rows = [[row["recorder"], f"{row['null_wrong']} of {row['null']}", f"{row['single_wrong']} of {row['single']}",
             str(row["refused"]), "-" if row["seconds"] is None else f"{row['seconds']:.1f}"] for row in found]
    wrong = [[row["recorder"], *cells] for row in found for cells in failed_rows(row["wrong"])]
    return [("one flight, recorded in many ways", headers, rows),
            ("what failed", {"recorded": "left", **HEADERS}, wrong)]
