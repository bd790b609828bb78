"""Flights to files, and the figures one asks for first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from icing_env import record
from icing_env.errors import InputError
from testbed.files import write_whole
from testbed.flight import Flight


def write(flight: Flight, path: Path) -> None:
    """Record to `path`, truth beside it as NAME.truth.csv; both whole or not at all."""
    if path.suffix not in (".csv", ".parquet"):
        raise InputError(f"{path}: a record is written as .csv or .parquet")
    if not path.parent.is_dir():
        raise InputError(f"{path}: no folder {path.parent}")
    write_table(flight.truth, path.with_suffix(".truth.csv"))
    record.write(flight.record, path)


def write_table(columns: dict[str, np.ndarray], path: Path) -> None:
    """Columns of equal length to CSV, whole or not at all."""
    write_whole(path, lambda file: np.savetxt(file, np.column_stack(list(columns.values())), fmt="%.9g", delimiter=",",
                                              header=",".join(columns), comments=""))


def summary(flight: Flight) -> dict[str, Any]:
    """Duration, how it ended, and the figures of ice, estimate and protection at the end."""
    truth, advisory = flight.truth, flight.advisory
    detected = np.flatnonzero(advisory["ice_detected"] > 0.5)
    return {
        "duration_s": float(truth["time"][-1]),
        "ended_by": flight.reason or "time",
        "eta_wing": float(0.5*(truth["eta_left_wing"][-1] + truth["eta_right_wing"][-1])),
        "eta_tail": float(truth["eta_htail"][-1]),
        "excess_CD_0": float(truth["excess_CD_0"][-1]),
        "estimated_excess_CD_0": float(flight.estimate["excess_drag"][-1]),
        "severity": float(advisory["severity"][-1]),
        "ice_detected_at_s": float(truth["time"][detected[0]]) if len(detected) else None,
        "boot_cycles": float(truth["boot_cycles"][-1]),
        "largest_alpha_rad": float(np.max(truth["true_alpha"])),
        "smallest_airspeed_m_s": float(np.min(truth["true_airspeed"])),
        "largest_intervention_rad": float(np.max(np.abs(advisory["intervention"]))),
    }
