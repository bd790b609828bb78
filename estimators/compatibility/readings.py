"""What of a record drives the kinematics, what they are compared with, and which errors may be asked for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.compatibility.kinematics import INPUTS, OUTPUTS, SCALED
from estimators.compatibility.model import ORDER, Readings
from estimators.regression.equations import movement
from estimators.signals.fourier_smoothing import fourier_smooth
from estimators.signals.resample import Grid
from icing_env.record import FlightRecord, FloatArray

NEEDED = ("airspeed", "alpha", "q", "theta", "ax", "az")
LATERAL = ("beta", "p", "r", "phi", "ay")
MOVED = np.radians(0.25)  # rms of a flow angle about its trend below which its scale is not asked for (assumed)


def readings_of(grid: Grid, values: Mapping[str, FloatArray], record: FlightRecord) -> tuple[Readings, tuple[str, ...]]:
    """What drives and what tests the motion, and the names of the latter.

    Lateral channels are used together or not at all, and are zero where they are not used.

    Args:
        grid: the record's channels.
        values: the same, brought to the centre of gravity.
        record: tells which instants were sampled.
    """
    lateral = all(name in values for name in LATERAL)
    names = [n for n in OUTPUTS if n in values and (lateral or n in NEEDED)]
    zero = np.zeros(len(grid.time))
    inputs = np.column_stack([values[n] if n in values and (lateral or n in NEEDED) else zero for n in INPUTS])
    known = {n: values[n] if n != "psi" else np.unwrap(values[n]) for n in names}
    blank = {n: ~grid.good((n,)) for n in names}
    if grid.time is record.time:
        blank |= {n: ~np.isfinite(record[n]) for n in names}
    measured = np.column_stack([np.where(blank[n], np.nan, known[n]) for n in names])
    reach = min(len(grid.time), max(3, round(0.2 / grid.dt)))
    start = np.array([float(np.median(known[n][:reach])) for n in names])
    noise = np.array([fourier_smooth(x, grid.dt).noise for x in inputs.T])
    return Readings(inputs, measured, tuple(OUTPUTS.index(n) for n in names), grid.dt, start, noise), tuple(names)


def without_blanks(readings: Readings, values: Mapping[str, FloatArray]) -> FloatArray:
    """Outputs (N, k) without the blanks that a recursive filter cannot pass: interpolated."""
    columns = [values[OUTPUTS[i]] if OUTPUTS[i] != "psi" else np.unwrap(values["psi"]) for i in readings.channels]
    return np.column_stack(columns)


def candidates_of(
    grid: Grid, values: Mapping[str, FloatArray], channels: tuple[str, ...]
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Errors that may be asked for, and why not some others: scales of angles that did not move."""
    inputs = [n for n in INPUTS if n in values and (n in NEEDED or "beta" in channels)]
    wanted = {f"bias_{n}" for n in (*inputs, *channels)} | {f"scale_{n}" for n in SCALED if n in channels}
    ruled = {}
    for name in ("alpha", "beta"):
        if name not in channels:
            continue
        moved = movement(grid.time, values[name], grid.good((name,)))
        if moved < MOVED:
            ruled[f"scale_{name}"] = (
                f"{name} moved {np.degrees(moved):.2f} deg rms, at least {np.degrees(MOVED):.2f} is needed"
            )
    return tuple(name for name in ORDER if name in wanted and name not in ruled), ruled
