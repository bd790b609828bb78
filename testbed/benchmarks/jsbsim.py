"""Another simulator as the aircraft: JSBSim's DHC-6 with a change, diagnosed against its own clean flights.

Records are drawn and flown by testbed.withheld, and answered without their keys (`answers`). What is there already is
kept, so that an interrupted run goes on.
"""

from __future__ import annotations

import json
from concurrent.futures import as_completed
from pathlib import Path
from typing import Any

from icing_env.errors import InputError
from testbed.benchmarks.answers import OPEN, Progress, answer_all, solve_by_role
from testbed.withheld.files import read_json, write_text
from testbed.withheld.jsbsim_cases import Design, designs, write_case
from testbed.withheld.jsbsim_edit import data_root
from testbed.withheld.jsbsim_score import score
from testbed.withheld.jsbsim_tables import differences, differing
from testbed.workers import a_core_each, processes

CASES = 16


@a_core_each()
def measure(out: Path, cases: int | None, seed: int, workers: int, root: str | None,
            progress: Progress) -> dict[str, Any]:
    """Fly (or finish flying) a set in `out`, diagnose every case, score.

    Args:
        out: folder of records, keys and answers.
        cases: with reference flights; CASES if omitted. To them come three of the aircraft as it is and three alone.
        seed: of the development set.
        workers: processes.
        root: a JSBSim tree; JSBSIM_ROOT, then the package's own, if omitted.
        progress: told what is being done.

    Raises:
        InputError: JSBSim or its DHC-6 is not there, or `out` holds another set.
    """
    found = data_root(root)
    if found is None:
        where = f"no aircraft/DHC6/DHC6.xml in {root}" if root else "JSBSim's DHC6 is not installed"
        raise InputError(f"{where}: pip install jsbsim, or name a JSBSim tree by --jsbsim-root or JSBSIM_ROOT")
    drawn = designs(cases or CASES, seed)
    _fly(out, drawn, seed, found, workers, progress)
    answer_all(out, "answers", {design.name: () for design in drawn}, workers, progress, solve_by_role)
    progress("scoring")
    apart = differences(found)
    result = score(out / "answers", out / "keys", differing(apart))
    result["tables"] = {name: {"mean": d.mean, "changing": d.changing, "rms": d.rms} for name, d in apart.items()}
    return {"cases": result["cases"], "set": "development", "by_tier": {"jsbsim": result}}


def _fly(out: Path, drawn: list[Design], seed: int, root: Path, workers: int, progress: Progress) -> None:
    records, keys, told = out / "records", out / "keys", out / "set.json"
    for folder in (records, keys):
        folder.mkdir(parents=True, exist_ok=True)
    keys.chmod(OPEN)
    mine = {"cases": len(drawn), "seed": seed}
    if told.is_file() and read_json(told) != mine:
        raise InputError(f"{out}: holds another set ({read_json(told)}); give another --out")
    write_text(told, json.dumps(mine))
    with processes(workers) as pool:
        running = [pool.submit(write_case, design, root, records, keys) for design in drawn]
        for k, task in enumerate(as_completed(running), start=1):
            task.result()
            progress(f"flown {k} of {len(drawn)}")


def tables(found: dict[str, Any]) -> list[tuple[str, dict[str, str], list[list[str]]]]:
    """For people: figures, every case (the worst first), and where the two simulators differ."""
    tier = found["by_tier"]["jsbsim"]
    names = ("changed", "nulls", "failed", "probability_median", "named", "exact", "closure_median",
             "size_error_median", "null_false_alarm", "where_f1", "seconds_per_case")  # fmt: skip
    rows = [[name.replace("_", " "), _text(tier[name]), _text(tier["as_it_is"][name])] for name in names]
    for gust in ("0", "0.5", "1.5"):
        rows.append([f"named, sigma_w {gust} m/s", _text(tier["named_by_gust"][gust]), ""])
    cases = [[r["effect"], _text(r["size"]), f"{r['sigma']:g}", _text(r["included"]), _text(r["exact"]),
              _text(r["closure"]), _text(r["estimate"]), r["first"]] for r in tier["rows"] + tier["as_it_is"]["rows"]]
    apart = [[name, _text(d["rms"]), _text(d["mean"]), _text(d["changing"])] for name, d in tier["tables"].items()]
    seen = ["seen without reference flights", *(", ".join(r["seen"]) or r["verdict"] or "failed"
                                                for r in tier["without_references"]["rows"])]
    side = {"component": "left", "rms": "right", "mean": "right", "changing": "right"}
    each = {"change": "left", "size": "right", "sigma_w": "right", "P(it)": "right", "P(it alone)": "right",
            "closure": "right", "estimate": "right", "first said": "left"}
    return [("diagnosis of JSBSim's DHC-6", {"figure": "left", "Clb made odd": "right", "as it is": "right"}, rows),
            ("cases", each, cases), ("JSBSim less published, tolerances; " + "; ".join(seen), side, apart)]


def _text(value: Any) -> str:
    return "-" if value is None else f"{value}" if isinstance(value, int) else f"{value:.3g}"
