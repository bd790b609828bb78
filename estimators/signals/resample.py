"""Channels of different or irregular rates on one time grid."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from icing_env.record import DataProblem, FlightRecord, FloatArray

GAP = 0.2  # s: a channel that is silent for longer than this, and for four of its own intervals, has a gap
IRREGULAR = 0.01  # share of the interval by which time steps may differ before the record is put on a grid
# What the equations of motion need at the record's rate; others may be sampled more slowly and lack nothing.
FAST = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az", "elevator", "aileron", "rudder")


@dataclass(frozen=True)
class Grid:
    """Channels at a constant rate: `time` (N,) s, `values` by name (N,), `missing` by name (N,) inside gaps."""

    time: FloatArray
    dt: float
    values: Mapping[str, FloatArray]
    missing: Mapping[str, NDArray[np.bool_]]
    problems: tuple[DataProblem, ...]

    def good(self, names: Iterable[str]) -> NDArray[np.bool_]:
        """Rows at which all of the named channels are known, shape (N,)."""
        bad = np.zeros(len(self.time), dtype=bool)
        for name in names:
            if name in self.missing:
                bad |= self.missing[name]
        return ~bad


def common_grid(record: FlightRecord) -> Grid:
    """Every channel and owner's column of `record` by linear interpolation on one grid of the record's typical rate."""
    time, dt, problems = record.time, record.dt, list[DataProblem]()
    start, end = float(time[0]), float(time[-1])
    if np.max(np.abs(np.diff(time) - dt)) > IRREGULAR * dt:
        steps = int(np.floor((end - start) / dt + 1e-6))
        time = np.linspace(start, start + steps * dt, steps + 1, dtype=np.float64)
        problems.append(DataProblem("time", f"irregular, interpolated at {1 / dt:.4g} Hz", start, end, True))
    values: dict[str, FloatArray] = {}
    missing: dict[str, NDArray[np.bool_]] = {}
    for name, samples in (*record.channels.items(), *record.owner.items()):
        valid = np.isfinite(samples)
        if name == "time" or not valid.any():
            continue
        if valid.all() and time is record.time:
            values[name] = samples
            continue
        at = record.time[valid]
        values[name] = np.interp(time, at, samples[valid])
        lost = gaps(time, at)
        if not valid.all() and (name in FAST or not _slow(np.flatnonzero(valid))):
            kind = f"{int(np.sum(~valid))} of {len(valid)} samples missing, interpolated"
            problems.append(DataProblem(name, kind, *_span(record.time[~valid]), True))
        if lost.any():
            missing[name] = lost
            problems.append(DataProblem(name, "gap, left out", *_span(time[lost]), True))
    return Grid(time, dt, values, missing, tuple(problems))


def _slow(rows: NDArray[np.intp]) -> bool:
    """Whether a channel was sampled at every so manieth row: its own rate, and nothing is missing."""
    step = np.diff(rows)
    return len(step) > 0 and int(step.min()) > 1 and int(step.max()) <= int(step.min()) + 1


def gaps(time: FloatArray, at: FloatArray, least: float = GAP) -> NDArray[np.bool_]:
    """Rows of `time` that lie in a gap between the instants `at` of valid samples, or too far outside them.

    Args:
        least: s that a gap lasts; longer where samples are sparse.
    """
    usual = float(np.median(np.diff(at))) if len(at) > 1 else 0.0
    limit = max(least, 4.0 * usual)
    after = np.searchsorted(at, time)
    left, right = at[np.clip(after - 1, 0, None)], at[np.clip(after, None, len(at) - 1)]
    inside = (right - left > limit) & (time > left) & (time < right)
    return np.asarray(inside | (time < at[0] - limit) | (time > at[-1] + limit), dtype=np.bool_)


def _span(times: FloatArray) -> tuple[float, float]:
    return float(times[0]), float(times[-1])
