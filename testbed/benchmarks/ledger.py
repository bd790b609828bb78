"""The ledger of the diagnosis's benchmark: what was drawn, before it is solved, and the figures of every run."""

from __future__ import annotations

import csv
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from testbed.withheld.files import digest_of

COLUMNS = ("date", "set", "cases", "sources", "manifest", "top1", "top3", "null_false_alarm", "pair_exact_set",
           "unknown_auroc_above_8", "where_f1", "ece", "coverage95", "closure_median")  # fmt: skip


def enter(path: Path, found: dict[str, Any], out: Path) -> None:
    """Append one line on the set in `out`; what stands there is never changed."""
    row = {name: found.get(name) for name in COLUMNS} | {
        "date": datetime.now(UTC).isoformat(timespec="seconds"), "manifest": digest_of(out / "manifest.json")}
    new = not path.exists()
    with path.open("a", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        if new:
            writer.writeheader()
        writer.writerow({k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()})


def enter_draw(path: Path, kind: str, committed: dict[str, Any], out: Path) -> None:
    """Append that a set was drawn (hash of cases and salted keys, sources of the solver), unless that stands there."""
    if path.is_file() and digest_of(out / "manifest.json") in path.read_text(encoding="utf-8"):
        return
    enter(path, {"set": f"{kind} drawn", "cases": committed["count"], "sources": committed["sources"]}, out)
