"""Recorded flights of NASA's Twin Otter (13 and 14 February 2002) against the printed textbook values.

Klein & Morelli, Aircraft System Identification (AIAA 2006), examples 5.1 and 5.2 and SIDPAC's demonstration. The
records belong to third parties and are not part of the project: they are looked for in the folder that
ICING_FLIGHT_DATA names, else in shared/flight_data beside the checkout; the rows are left out where they are absent.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from estimators import equation_error, hinf_record
from estimators.estimate import Estimate
from icing_env.record import read
from testbed.reproduce.row import Row, Rule, row

ITEM = "textbook"
DIGITS = Rule(relative=0.002)
CLOSE = Rule(relative=0.05)
LATERAL = {"CY_beta": -0.8451, "CY_r": 0.9631, "CY_rudder": 0.3426, "Cl_beta": -0.1051, "Cl_p": -0.5283,
           "Cl_r": 0.1926, "Cl_aileron": -0.2117, "Cl_rudder": 0.0299, "Cn_beta": 0.08544, "Cn_p": -0.05151,
           "Cn_r": -0.19758, "Cn_aileron": 0.00234, "Cn_rudder": -0.13054}  # fmt: skip
PITCH = {"CZ_alpha": -6.349, "CZ_q": -18.41, "CZ_elevator": -0.626, "Cm_alpha": -1.4762, "Cm_q": -36.35,
         "Cm_elevator": -1.8688}  # fmt: skip
BOOK = {"totter_f1_017_data.mat": LATERAL, "totter_demo_data.mat": PITCH}
COLUMNS = ("the book regresses on the smoothed columns that the record's owner stored; on the raw channels with "
           "matched filters the record says otherwise, by least squares and by H-infinity alike")


def folder() -> Path:
    """Where recorded flights lie, if anywhere."""
    return Path(os.environ.get("ICING_FLIGHT_DATA")
                or Path(__file__).resolve().parents[3] / "shared" / "flight_data")


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
