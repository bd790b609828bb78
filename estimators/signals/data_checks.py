"""What is wrong with a record: each fault is named, then mended and reported, or the record is refused.

Mended: repeated instants (dropped), constant channels (set aside), frozen stretches and spikes (left out,
interpolated where short). Refused: too few samples, time running backwards, a wrong unit, a reversed sign. Signs and
units are judged by the motion (estimators.signals.kinematic_checks). Thresholds are assumed; they leave clean records
with sensor noise and turbulence untouched.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from estimators.signals.kinematic_checks import check_kinematics
from estimators.signals.resample import common_grid
from icing_env.errors import InputError
from icing_env.record import DataProblem, FlightRecord, FloatArray
from icing_env.record.table import check_radians

MOTION = ("alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az")
SHORTEST, FEWEST = 1.0, 20  # s, samples
FROZEN = 1.0  # s without any change in a channel that otherwise always changes
# Smallest jump that can be called a spike, in the channel's unit.
SPIKE_FLOOR = {"alpha": 0.009, "beta": 0.009, "p": 0.035, "q": 0.035, "r": 0.035, "phi": 0.009, "theta": 0.009,
               "ax": 0.5, "ay": 0.5, "az": 1.0, "airspeed": 2.0}  # fmt: skip


def check(record: FlightRecord) -> FlightRecord:
    """The record mended where it can be, with everything found in its `problems`.

    Raises:
        InputError: the record cannot be used; the line says why.
    """
    record = _increasing(record)
    duration = float(record.time[-1] - record.time[0]) if len(record) else 0.0
    if len(record) < FEWEST or duration < SHORTEST:
        raise InputError(
            f"record '{record.meta.name}' has {len(record)} samples over {duration:.3g} s; "
            f"at least {FEWEST} over {SHORTEST:g} s are needed"
        )
    _check_units(record)
    record = _without_constants(record)
    record = _without_frozen(_without_spikes(record))
    grid = common_grid(record)
    check_kinematics(grid, f"record '{record.meta.name}'")
    known = set(record.problems)
    return record.with_problems(p for p in grid.problems if p not in known)


def _increasing(record: FlightRecord) -> FlightRecord:
    """Drop instants that repeat; refuse time that runs backwards."""
    step = np.diff(record.time)
    if np.any(step < 0) or not np.isfinite(record.time).all():
        at = float(record.time[int(np.argmin(step)) + 1]) if np.any(step < 0) else float("nan")
        raise InputError(f"record '{record.meta.name}': time must increase; it runs backwards at {at:g} s")
    repeated = np.concatenate(([False], step == 0))
    if not repeated.any():
        return record
    times = record.time[repeated]
    problem = DataProblem("time", f"{len(times)} instants repeated, dropped", float(times[0]), float(times[-1]), True)
    return record.take(~repeated).with_problems([problem])


def _check_units(record: FlightRecord) -> None:
    """Refuse degrees, g, Celsius and hPa where magnitudes betray them."""
    where = f"record '{record.meta.name}'"
    check_radians(record.channels, where)
    if record.has("az"):
        az = float(np.nanmedian(record["az"]))
        if abs(az) < 2.0:
            raise InputError(f"{where}: column 'az' looks like g: median {az:.3g}; level flight reads -9.8 m/s2")
        if abs(az) > 20.0:
            unit = "looks like ft/s2" if 28.0 < abs(az) < 36.0 else "is not in m/s2"
            raise InputError(f"{where}: column 'az' {unit}: median {az:.3g}; level flight reads -9.8 m/s2")
        if az > 0:
            raise InputError(f"{where}: column 'az' has its sign reversed: median {az:.3g}; level flight reads -9.8")
    for name, least, unit in (("temperature", 150.0, "Celsius"), ("pressure", 2000.0, "hPa")):
        if record.has(name) and np.nanmedian(record[name]) < least:
            value, right = float(np.nanmedian(record[name])), {"temperature": "K", "pressure": "Pa"}[name]
            raise InputError(f"{where}: column '{name}' looks like {unit}: median {value:.4g}; {right} is required")


def _replace(record: FlightRecord, name: str, values: FloatArray) -> FlightRecord:
    return replace(record, channels={**record.channels, name: values})


def _without_constants(record: FlightRecord) -> FlightRecord:
    """Set aside motion channels that never change: a dead sensor, or a channel that was not recorded."""
    start, end = float(record.time[0]), float(record.time[-1])
    dead = [n for n in MOTION if record.has(n) and np.nanmax(record[n]) == np.nanmin(record[n])]
    kept = {n: v for n, v in record.channels.items() if n not in dead}
    found = [DataProblem(n, f"constant at {np.nanmax(record[n]):g}, set aside", start, end, True) for n in dead]
    return replace(record, channels=kept).with_problems(found)


def _without_spikes(record: FlightRecord) -> FlightRecord:
    """Blank lone samples that jump away and back by far more than the channel's own steps."""
    for name, floor in SPIKE_FLOOR.items():
        if not record.has(name):
            continue
        rows = np.flatnonzero(np.isfinite(record[name]))
        values = record[name][rows]
        if len(values) < FEWEST:
            continue
        limit = max(floor, 5.0 * float(np.percentile(np.abs(np.diff(values)), 95)))
        away = np.abs(values - median_filter(values, size=5, mode="nearest")) > limit
        if not away.any():
            continue
        cleaned, at = record[name].copy(), record.time[rows[away]]
        cleaned[rows[away]] = np.nan
        kind = f"{int(away.sum())} spikes, interpolated"
        problem = DataProblem(name, kind, float(at[0]), float(at[-1]), True)
        record = _replace(record, name, cleaned).with_problems([problem])
    return record


def _without_frozen(record: FlightRecord) -> FlightRecord:
    """Blank stretches in which a lively channel stands still although the aircraft moves."""
    lively = [n for n in MOTION if record.has(n)]
    for name in lively:
        rows = np.flatnonzero(np.isfinite(record[name]))
        start, end = _longest_run(record[name][rows])
        same = np.mean(np.diff(record[name][rows]) == 0.0) - (end - start) / len(rows)
        if same > 0.2 or record.time[rows[end]] - record.time[rows[start]] < FROZEN:
            continue
        stretch = rows[start : end + 1]
        if not _moves(record, stretch, [n for n in lively if n != name]):
            continue
        cleaned = record[name].copy()
        cleaned[stretch] = np.nan
        span = float(record.time[stretch[0]]), float(record.time[stretch[-1]])
        record = _replace(record, name, cleaned).with_problems([DataProblem(name, "frozen, left out", *span, True)])
    return record


def _longest_run(values: FloatArray) -> tuple[int, int]:
    """First and last index of the longest stretch of equal values."""
    edges = np.flatnonzero(np.concatenate(([True], np.diff(values) != 0.0, [True])))
    longest = int(np.argmax(np.diff(edges)))
    return int(edges[longest]), int(edges[longest + 1] - 1)


def _moves(record: FlightRecord, rows: NDArray[np.intp], names: list[str]) -> bool:
    """Whether some other channel varies in these rows by a third of its variation over the record."""
    return any(
        np.isfinite(record[n][rows]).any() and np.nanstd(record[n][rows]) > np.nanstd(record[n]) / 3.0 for n in names
    )
