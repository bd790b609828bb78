"""Recorded flights of NASA's Twin Otter (13 and 14 February 2002) against the printed textbook values.

Klein & Morelli, Aircraft System Identification (AIAA 2006), examples 5.1 and 5.2 and SIDPAC's demonstration. The
records belong to third parties and are not part of the project: they are looked for in the folder that
ICING_FLIGHT_DATA names, else in shared/flight_data beside the checkout; the rows are left out where they are absent.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace

from estimators.estimate import Estimate
from estimators.hinf import record as hinf_record
from estimators.regression import equation_error
from icing_env.record import read
from testbed.reproduce.row import Row, Rule, row
from testbed.textbook import BOOK as PRINTED
from testbed.textbook import folder

ITEM = "textbook"
DIGITS = Rule(relative=0.002)
CLOSE = Rule(relative=0.05)
BOOK = {name: {key: float(value) for key, value in PRINTED[name].items()} for name in reversed(PRINTED)}
COLUMNS = ("the book regresses on the smoothed columns that the record's owner stored; on the raw channels with "
           "matched filters the record says otherwise, by least squares and by H-infinity alike")


def rows(seed: int) -> list[Row]:
    """The stored columns to the printed digits, then our own filters and H-infinity on the raw channels."""
    del seed
    found: list[Row] = []
    for name, book in BOOK.items():
        path = folder() / name
        if not path.is_file():
            print(f"icing: {ITEM}: no {name}: set ICING_FLIGHT_DATA to the folder of the recorded flights",
                  file=sys.stderr)
            continue
        record = read(path)
        for method, estimates, rule in (
            ("stored columns", equation_error.identify(record, "textbook"), DIGITS),
            ("matched filters", equation_error.identify(record, "matched"), CLOSE),
            ("H-infinity", hinf_record.identify(record), CLOSE),
        ):  # fmt: skip
            for key, printed in book.items():
                found += _row(name, method, key, printed, estimates, rule)
    return found


def _row(name: str, method: str, key: str, printed: float, estimates: Mapping[str, Estimate], rule: Rule) -> list[Row]:
    """One derivative by one method; nothing for one that the method does not estimate."""
    if key not in estimates:
        return []
    e, quantity = estimates[key], f"{key} of {name.removesuffix('_data.mat')} ({method})"
    text = f"{rule.text('1/rad')} or two standard errors; refusal agrees where two errors reach zero"
    if not e.identifiable:
        agrees = abs(printed) <= 2.0*e.std_error
        return [Row(ITEM, quantity, "recorded", printed, "refused", "1/rad", None, agrees, text, e.why)]
    found = row(ITEM, quantity, printed, e.estimate, "1/rad", rule, f"standard error {e.std_error:.2g}",
                kind="recorded", miss=COLUMNS)
    near = abs(e.estimate - printed) <= 2.0*e.std_error
    return [replace(found, agrees=True, rule=text, why=found.why.split(";")[0]) if near else replace(found, rule=text)]
