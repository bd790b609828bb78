"""A plant made elsewhere (`testbed.elsewhere`): is a clean aircraft called clean, and a gap seen where it enters.

Effects there have the names of a list of effects (docs/elsewhere.md) and their own forms, not the names and forms of
our library, so nothing is scored by name: a single, an unknown and a pair count by the component where they enter and
by the held-out closure. Clean aircraft differ from the published one by more than derivatives, too; references tell of
that. Cases are drawn by a known seed and may be looked at. Keys are read once all answers are in.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Sequence
from concurrent.futures import as_completed
from pathlib import Path
from typing import Any

import numpy as np

from icing_env.errors import InputError
from testbed.benchmarks.answers import OPEN, Progress, answer_all, solve_by_role
from testbed.benchmarks.failures import leading
from testbed.elsewhere.draw import Turn, draw_case, order
from testbed.withheld.files import read_json, write_text
from testbed.workers import a_core_each, processes

CASES = 12  # four have no gap, four a single effect, two an unknown one, two a pair
TIERS = ("null", "single", "unknown", "pair")
VERDICTS = ("no_gap", "explained", "unknown")
SEEN = 0.5  # probability from which a component is told as one where the gap enters


@a_core_each()
def measure(out: Path, cases: int | None, seed: int, workers: int, progress: Progress) -> dict[str, Any]:
    """Draw (or finish drawing) a set in `out`, diagnose every case, score.

    Args:
        out: folder of records, keys and answers; what it holds already is kept.
        cases: how many to draw; CASES if omitted.
        seed: of the set.
        workers: processes.
        progress: told what is being done.

    Returns:
        `by_kind`, a row for each kind with references and without, and `rows`, one for each case.

    Raises:
        InputError: `out` holds another set.
    """
    names = _drawn(out, cases or CASES, seed, workers, progress)
    answer_all(out, "answers", dict.fromkeys(names, ()), workers, progress, solve_by_role)
    progress("scoring")
    rows = [scored(name, read_json(out / "keys" / f"{name}.json"), read_json(out / "answers" / f"{name}.json"))
            for name in names]
    rows.sort(key=lambda row: (TIERS.index(row["kind"]), row["references"], row["sigma_w"], row["case"]))
    return {"set": "development", "seed": seed, "cases": len(rows), "by_kind": summed(rows), "rows": rows}


def _drawn(out: Path, cases: int, seed: int, workers: int, progress: Progress) -> list[str]:
    """Names of the cases, in the order of the alphabet; those that are not there yet are flown.

    Raises:
        InputError: `out` holds another set.
    """
    records, keys, told, mine = out / "records", out / "keys", out / "set.json", {"cases": cases, "seed": seed}
    for folder in (records, keys):
        folder.mkdir(parents=True, exist_ok=True)
    keys.chmod(OPEN)  # a run that was killed left it closed
    if told.is_file() and read_json(told) != mine:
        raise InputError(f"{out}: holds another set ({read_json(told)}); give another --out")
    write_text(told, json.dumps(mine))
    roll = keys / "names.json"  # with the keys: a case's number tells its kind
    names: dict[str, str] = read_json(roll) if roll.is_file() else {}
    left = [turn for turn in order(cases, seed) if str(turn.case) not in names]
    with processes(workers) as pool:
        running = {pool.submit(_fly, turn, seed, out): turn for turn in left}
        for task in as_completed(running):
            names[str(running[task].case)] = task.result()
            write_text(roll, json.dumps(names))
            progress(f"flown {len(names)} of {cases}")
    return sorted(names.values())


def _fly(turn: Turn, seed: int, out: Path) -> str:
    """Draw one case beside the others, then move it among them, so that half of one is never taken for a whole."""
    part = out / f".drawing_{turn.case}"
    shutil.rmtree(part, ignore_errors=True)
    name = draw_case(turn, seed, part / "records", part / "keys")
    shutil.rmtree(out / "records" / name, ignore_errors=True)  # of a run that was killed before it told the name
    for path in (Path("records") / name, Path("keys") / f"{name}.json"):
        os.replace(part / path, out / path)
    shutil.rmtree(part)
    return name


def scored(name: str, key: dict[str, Any], answer: dict[str, Any]) -> dict[str, Any]:
    """One case: its truth, what is said of it first, whether a component where the gap enters is told, the closure.

    `component` is the highest probability of a true component; None for nulls and for refused cases, whose
    `verdict` is "refused". `closure` is None where there is none to tell.
    """
    explanation, probability = leading(answer)
    row = {"case": name, "kind": key["kind"], "references": key["references"], "sigma_w": key["sigma_w"],
           "truth": [effect["name"] for effect in key["effects"]], "enters_at": key["components"],
           "verdict": answer.get("verdict", "refused"), "explanation": explanation, "probability": probability,
           "component": None, "closure": None, "seconds": answer.get("seconds")}
    if "error" not in answer:
        told = answer["where"]["components"]
        row["component"] = max((told.get(c, 0.0) for c in key["components"]), default=None)
        row["closure"] = answer["gap"]["held_out"]["closure"]
    return row


def summed(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """A row for each kind without references and with: cases, verdicts, and of gaps how many are placed, how closed.

    A refused case counts among the cases and is not placed. `closure_median` is over cases that have one.
    """
    found = []
    for kind in TIERS:
        for references in (False, True):
            of = [row for row in rows if (row["kind"], row["references"]) == (kind, references)]
            if not of:
                continue
            closures = [row["closure"] for row in of if row["closure"] is not None]
            placed = sum(row["component"] is not None and row["component"] >= SEEN for row in of)
            found.append({"kind": kind, "references": references, "cases": len(of),
                          **{verdict: sum(row["verdict"] == verdict for row in of) for verdict in VERDICTS},
                          "refused": sum(row["verdict"] == "refused" for row in of),
                          "placed": None if kind == "null" else placed,
                          "closure_median": float(np.median(closures)) if closures and kind != "null" else None})
    return found


def tables(found: dict[str, Any]) -> list[tuple[str, dict[str, str], list[list[str]]]]:
    """For people: the kinds, then all cases."""
    kinds = [[row["kind"], _yes(row["references"]), str(row["cases"]), *(str(row[v]) for v in VERDICTS),
              str(row["refused"]), "-" if row["placed"] is None else f"{row['placed']} of {row['cases']}",
              _text(row["closure_median"])] for row in found["by_kind"]]
    headers = {"kind": "left", "references": "left", "cases": "right", "no gap": "right", "explained": "right",
               "unknown": "right", "refused": "right", "at a right component": "right", "closure, median": "right"}
    rows = [[row["case"], row["kind"], _yes(row["references"]), f"{row['sigma_w']:g}",
             " + ".join(row["truth"]) or "no gap", row["verdict"].replace("_", " "), row["explanation"],
             _text(row["probability"]), _text(row["component"]), _text(row["closure"])] for row in found["rows"]]
    each = {"case": "left", "kind": "left", "references": "left", "sigma_w, m/s": "right", "truth": "left",
            "verdict": "left", "explanation": "left", "P": "right", "P(component)": "right", "closure": "right"}
    return [("a plant made elsewhere", headers, kinds), ("cases", each, rows)]


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _text(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
