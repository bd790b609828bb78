"""Channels that stand still or jump: set aside, blanked or kept, and always told.

A sensor always moves a little; one that never changes is dead, or was not recorded. Surfaces, airspeed and engines may
truly be still, so that a constant one is kept and told. Thresholds are assumed; they leave clean records with sensor
noise and turbulence untouched.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from icing_env.record import DataProblem, FlightRecord, FloatArray

MOTION = ("alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az")
DEAD = (*MOTION, "psi")  # set aside where constant
STILL = ("airspeed", "elevator", "aileron", "rudder", "thrust_left", "thrust_right", "altitude", "ground_speed",
         "track")  # kept where constant, and told  # fmt: skip
FEWEST = 20  # samples
REGULAR = 0.95  # share of a channel's changes that come as regularly as samples: those between are repeats
FROZEN = 1.0  # s without any change in a channel that otherwise changes
LONGER = 5.0  # times any other stretch without change
HELD, REPEATS = ("elevator", "aileron", "rudder"), 2  # may stand still, unless noise always moves them,
FLICKERS = 0.04  # or turns them in so many of their samples, as a hand on the yoke and the last bit of a converter do
# Smallest jump that can be called a spike, in the channel's unit; below it, it does no harm.
SPIKE_FLOOR = {**dict.fromkeys(("alpha", "beta", "phi", "theta", "psi"), 0.006), **dict.fromkeys(("p", "q", "r"), 0.02),
               **dict.fromkeys(("elevator", "aileron", "rudder"), 0.006), "ax": 0.3, "ay": 0.3, "az": 0.8,
               "airspeed": 2.0, "ground_speed": 3.0, "altitude": 20.0, "temperature": 3.0, "pressure": 300.0,
               "thrust_left": 400.0, "thrust_right": 400.0, "mass": 40.0}  # fmt: skip


def mended(record: FlightRecord) -> FlightRecord:
    """The record without dead channels, repeats, spikes and frozen stretches; each is among its `problems`."""
    return _without_frozen(_without_spikes(_without_repeats(_without_constants(record))))


def _replace(record: FlightRecord, name: str, values: FloatArray) -> FlightRecord:
    return replace(record, channels={**record.channels, name: values})


def _without_constants(record: FlightRecord) -> FlightRecord:
    """Set aside motion channels that never change; tell of others."""
    start, end = float(record.time[0]), float(record.time[-1])
    still = [n for n in (*DEAD, *STILL) if record.has(n) and np.nanmax(record[n]) == np.nanmin(record[n])]
    kept = {n: v for n, v in record.channels.items() if n not in still or n in STILL}
    done = {n: "kept: held still, or a dead sensor" if n in STILL else "set aside" for n in still}
    found = [DataProblem(n, f"constant at {np.nanmax(record[n]):g}, {done[n]}", start, end, n in DEAD) for n in still]
    known = set(record.problems)
    return replace(record, channels=kept).with_problems(p for p in found if p not in known)


def _without_repeats(record: FlightRecord) -> FlightRecord:
    """Blank what a slower channel repeats until its next sample: a reading held is none, and old.

    Of what the equations of motion need at the record's rate; thrust and altitude may as well be held.
    """
    for name in (*MOTION, "airspeed", *HELD):
        if not record.has(name):
            continue
        rows = np.flatnonzero(np.isfinite(record[name]))
        new = np.concatenate(([True], np.diff(record[name][rows]) != 0.0))
        apart = np.diff(np.flatnonzero(new))
        usual = int(np.median(apart)) if len(apart) >= FEWEST else 1
        if usual < 2 or np.mean((apart == usual) | (apart == usual + 1)) < REGULAR:
            continue
        cleaned = record[name].copy()
        cleaned[rows[~new]] = np.nan
        span = float(record.time[rows[0]]), float(record.time[rows[-1]])
        kind = f"repeats every sample {np.mean(apart):.2g} times, repeats left out"
        record = _replace(record, name, cleaned).with_problems([DataProblem(name, kind, *span, True)])
    return record


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
    """Blank the stretch in which a lively channel stands still although the aircraft moves."""
    lively = [n for n in MOTION if record.has(n)]
    for name in (*lively, "airspeed", *HELD):
        if not record.has(name):
            continue
        rows = np.flatnonzero(np.isfinite(record[name]))
        start, end, next_longest = _longest_runs(record[name][rows])
        if name in HELD and next_longest > REPEATS and _turns(record[name][rows], start, end) < FLICKERS:
            continue
        if end - start < LONGER * next_longest or record.time[rows[end]] - record.time[rows[start]] < FROZEN:
            continue
        stretch = rows[start : end + 1]
        if len(stretch) == len(rows) or not _moves(record, stretch, [n for n in lively if n != name]):
            continue
        cleaned = record[name].copy()
        cleaned[stretch] = np.nan
        span = float(record.time[stretch[0]]), float(record.time[stretch[-1]])
        record = _replace(record, name, cleaned).with_problems([DataProblem(name, "frozen, left out", *span, True)])
    return record


def _longest_runs(values: FloatArray) -> tuple[int, int, int]:
    """First and last index of the longest stretch of equal values, and the length (in steps) of the next longest."""
    edges = np.flatnonzero(np.concatenate(([True], np.diff(values) != 0.0, [True])))
    lengths = np.diff(edges)
    longest = int(np.argmax(lengths))
    others = np.delete(lengths, longest)
    return int(edges[longest]), int(edges[longest + 1] - 1), int(others.max()) if len(others) else 0


def _turns(values: FloatArray, start: int, end: int) -> float:
    """Share of the samples outside a stretch at which a channel turns back from where it was going."""
    ways = [np.sign(np.diff(part)) for part in (values[: start + 1], values[end:])]
    turned = sum(int(np.count_nonzero(np.diff(way[way != 0.0]))) for way in ways)
    return turned / max(sum(len(way) for way in ways), 1)


def _moves(record: FlightRecord, rows: NDArray[np.intp], names: list[str]) -> bool:
    """Whether some other channel varies in these rows by a third of its variation over the record."""
    return any(
        np.isfinite(record[n][rows]).any() and np.nanstd(record[n][rows]) > np.nanstd(record[n]) / 3.0 for n in names
    )
