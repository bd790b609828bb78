"""Time stamps that jitter where the samples do not: the logger's clock was late now and then, and not the sensors.

Samples taken when their stamps say differ from evenly spaced ones by the jitter times their rate. How much of that is
in them tells the two apart; interpolated by stamps that are wrong, every manoeuvre has noise that no sensor has.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import savgol_filter

from estimators.signals.mending import FEWEST, MOTION
from estimators.signals.resample import IRREGULAR
from icing_env.record import DataProblem, FlightRecord, FloatArray

KNOWN = 0.2  # standard error of the share of the jitter that samples show, with which it is believed (assumed)
# Samples and order of the polynomials whose remainder is looked at: smooth motion does not show in it (Savitzky &
# Golay, Analytical Chemistry 36, 1964), and this much of the variance of white noise does.
SPAN, ORDER, REMAINS = 7, 3, 2.0 / 3.0


def evenly_spaced(record: FlightRecord) -> FlightRecord:
    """The record with even time steps, if its stamps jitter by less than half a step about them and samples do not."""
    time, rows = record.time, np.arange(len(record))
    if len(record) < FEWEST or np.max(np.abs(np.diff(time) - record.dt)) <= IRREGULAR * record.dt:
        return record
    step, start = np.polyfit(rows, time, 1)
    even = start + step * rows
    if np.max(np.abs(time - even)) >= 0.5 * step:
        return record
    share, error = shown(record, time - even, step)
    if error > KNOWN or share > 0.5:
        return record
    kind = f"stamps jitter by {1e3 * np.std(time - even):.2g} ms and samples do not, taken as evenly spaced"
    problem = DataProblem("time", kind, float(time[0]), float(time[-1]), True)
    return replace(record, channels={**record.channels, "time": even}).with_problems([problem])


def shown(record: FlightRecord, jitter: FloatArray, step: float) -> tuple[float, float]:
    """Share of the stamps' jitter [N] s that the samples of all channels show, and its standard error.

    One where samples were taken when stamps say, zero where they were evenly spaced.
    """
    shares, weights = [0.0], [1e-12]
    for name in MOTION:
        if not record.has(name) or not np.isfinite(record[name]).all():
            continue
        samples = record[name]
        rate = savgol_filter(samples, SPAN, ORDER, deriv=1, delta=step)
        differs, moved = _remainder(samples), _remainder(rate * jitter)
        square = float(moved @ moved)
        noise = 1.4826 * float(np.median(np.abs(differs))) / np.sqrt(REMAINS)
        if square > 0.0 and noise > 0.0:
            shares.append(float(moved @ differs) / square)
            weights.append((square / (noise * float(np.linalg.norm(_remainder(moved))))) ** 2)
    return float(np.average(shares, weights=weights)), float(np.sum(weights)) ** -0.5


def _remainder(samples: FloatArray) -> FloatArray:
    """What local polynomials leave of samples [N]."""
    return np.asarray(samples - savgol_filter(samples, SPAN, ORDER))
