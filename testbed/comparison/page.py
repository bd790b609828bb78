"""The report of `icing compare --out`: verdicts, one overview, and every case by function of the ice management."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from testbed.comparison.figures import SIGNED, by_case, learning_curves
from testbed.comparison.overview import FUNCTIONS, Rows, heading, overview, sentences, told
from testbed.files import write_whole
from testbed.reports.page import Cell, Report

OPENING = """
Every controller flies the same drawn cases: same seeds, weather, ice and starting conditions, with ice management and
envelope protection and without. Means with 95 % intervals over episodes; for learned controllers over training seeds,
with the interquartile mean beside. Truth is used for scores only.
"""
KEY = {1: ("detection_delay", "severity_error"), 2: ("ice_carried", "boot_cycles"),
       3: ("losses", "stalled", "exceedances", "worst_alpha_margin"),
       4: ("altitude_rms", "heading_rms", "short_period_off", "elevator_activity")}  # fmt: skip
COLUMNS, NO_BREAK = 3, "\u00a0"


def write(result: Mapping[str, Any], provenance: Mapping[str, str], folder: Path) -> Path:
    """Write `compare.html` and `compare.json` into `folder`, each whole or not at all; returns the page's path."""
    rows: Rows = result["rows"]
    report = Report("Controllers in icing", f"Suite {result['suite']}, {result['episodes']} episodes a case.",
                    provenance)
    report.section("What it shows", OPENING)
    for text, kind in sentences(rows):
        report.verdict(text, kind)
    for function, title in FUNCTIONS.items():
        _function(report, rows, function, title)
    learned = list(dict.fromkeys(row["controller"] for row in rows if row["kind"] == "learned"))
    if learned:
        report.section("How the learned controllers learned")
        report.figure(learning_curves(learned), "Mean reward on the fixed evaluation cases, a line per training seed; "
                      "the policy that flies is the best point of its curve.",
                      "learning curves of every learned controller")
    write_whole(folder/"compare.json", json.dumps(result, allow_nan=False, indent=1))
    return report.write(folder/"compare.html")


def _function(report: Report, rows: Rows, function: int, title: str) -> None:
    names = told(rows, function)
    report.section(title[2:].capitalize())
    for part in _parts(names):
        report.table(("controller", "kind", "protection", *(heading(rows, n) for n in part)),
                     [(one["controller"], one["kind"], "on" if one["protection"] else "off",
                       *(_pooled(*one["metrics"][n]) for n in part)) for one in overview(rows)],
                     "Means over all cases, and half of the 95 % interval.")
    for name in KEY[function]:
        if name in names:
            label = heading(rows, name)
            report.figure(by_case(rows, name), f"{label[0].upper()}{label[1:]} by case, with 95 % intervals.",
                          f"{name} of every controller in every case, protected and unprotected")
    for part in _parts(names):
        there = [row for row in rows if any(row["metrics"][n]["mean"] is not None for n in part)]
        report.table(("scenario, gusts", "controller", "prot.", *(heading(rows, n) for n in part)),
                     [(f"{row['scenario']}, {row['turbulence']}", row["controller"],
                       "on" if row["protection"] else "off", *(_cell(n, row["metrics"][n]) for n in part))
                      for row in there], "Every case: mean and, in brackets, the 95 % interval.")


def _parts(names: list[str]) -> list[list[str]]:
    """Columns that fit beside one another on the page."""
    return [names[k:k + COLUMNS] for k in range(0, len(names), COLUMNS)]


def _pooled(mean: float | None, half: float | None) -> Cell:
    return None if mean is None else f"{_number(mean, 3)}{NO_BREAK}±{NO_BREAK}{_number(half or 0.0, 2)}"


def _cell(name: str, metric: Mapping[str, Any]) -> Cell:
    if metric["mean"] is None:
        return None
    low = metric["low95"] if name in SIGNED else max(metric["low95"], 0.0)
    return f"{_number(metric['mean'], 3)} ({_number(low, 2)}{NO_BREAK}to{NO_BREAK}{_number(metric['high95'], 2)})"


def _number(value: float, digits: int) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000.0 else f"{value:.{digits}g}"
