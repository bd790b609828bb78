"""What calibration tells of the instruments, taken out of a record: lags of vanes and airspeed, bending of the boom.

The side file of a record may declare, for `alpha`, `beta` and `airspeed`, a `lag` (s), the time by which a slow change
shows late: the time constant of a first-order lag, y + lag y' = x. A flow angle that shows late by tau looks like a
moment by q and takes tau 2V/c of Cm_alpha into Cm_q: 11.6 ms are 4 % of it. `alpha` may declare `bending` (rad s2/m):
the boom bends with the normal acceleration, and alpha reads too much by bending (az + g). `attitude` may declare the
`lag` of all three angles: the gyros tell how fast they change. Where nothing is declared, nothing is done.

The lag is undone by its inverse, x = y + lag y', with y' by local quadratics (Savitzky & Golay), over as few samples
as leave the noise of lag y' below a part `QUIET` of that of y: the slope over n samples dt apart has
12/(n (n^2 - 1) dt^2) of the variance of white noise. What is faster than the slope follows, gusts above some hertz,
stays late. Source of the model: Klein & Morelli, Aircraft System Identification (AIAA 2006), chapter 10.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

from estimators.signals.resample import common_grid
from icing_env.atmosphere import G0
from icing_env.errors import InputError
from icing_env.record import DataProblem, FlightRecord, FloatArray

LAGGED, ATTITUDES = ("alpha", "beta", "airspeed"), ("phi", "theta", "psi")
QUIET = 0.2  # noise that the correction may add, over that of the channel (assumed: 2 % more standard deviation)
LONGEST = 0.5  # s: a lag beyond it is no flow vane's or pitot tube's, and first order would not do (assumed)


@dataclass(frozen=True)
class Calibration:
    """Lags in s by channel, and bending of the boom in rad s2/m; empty and 0 where the record declares none."""

    lags: Mapping[str, float]
    bending: float

    @property
    def stated(self) -> bool:
        """Whether there is anything to correct."""
        return bool(self.lags) or self.bending != 0.0

    def lag(self, name: str) -> float:
        """Lag of one channel, s; 0 where it is not declared."""
        return self.lags.get(name, 0.0)


def calibration(sensors: Mapping[str, Any]) -> Calibration:
    """What the table `sensors` of a record declares.

    Raises:
        InputError: a lag or bending that is not a number, or no lag of an instrument.
    """
    lags = {name: _number(sensors, name, "lag") for name in LAGGED}
    for name, lag in lags.items():
        if not 0.0 <= lag <= LONGEST:
            raise InputError(f"sensors.{name}.lag must be 0 to {LONGEST:g} s, got {lag:g}")
    return Calibration({name: lag for name, lag in lags.items() if lag > 0.0}, _number(sensors, "alpha", "bending"))


def _number(sensors: Mapping[str, Any], name: str, key: str) -> float:
    entry = sensors.get(name)
    value = entry.get(key, 0.0) if isinstance(entry, Mapping) else 0.0
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InputError(f"sensors.{name}.{key} must be a number, got {value!r}")
    return float(value)


def with_prompt_attitudes(record: FlightRecord) -> FlightRecord:
    """The record without the lag that it declares of its attitudes, told among its `problems`; else as it is.

    Raises:
        InputError: as `calibration`.
    """
    lag, late = _number(record.meta.sensors, "attitude", "lag"), [n for n in ATTITUDES if n in record.channels]
    if not 0.0 <= lag <= LONGEST:
        raise InputError(f"sensors.attitude.lag must be 0 to {LONGEST:g} s, got {lag:g}")
    if lag == 0.0 or not late:
        return record
    grid = common_grid(record)
    turning = {name: rate(grid.values[name], grid.dt, lag) for name in late}
    if all(name in grid.values for name in ("p", "q", "r", "phi", "theta")):
        turning = attitude_rates(grid.values)
    channels = dict(record.channels)
    for name in late:
        channels[name] = channels[name] + lag * np.interp(record.time, grid.time, turning[name])
    start, end = float(record.time[0]), float(record.time[-1])
    told = [DataProblem(name, f"lag of {lag:.3g} s taken out, as declared", start, end, True) for name in late]
    done = _done(record.meta.sensors, ["attitude"])
    return replace(record, channels=channels, meta=replace(record.meta, sensors=done)).with_problems(told)


def attitude_rates(values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Rates of phi, theta and psi that body rates make, rad/s (N,): Klein & Morelli (2006), chapter 3.

    Args:
        values: p, q, r [rad/s], phi and theta [rad], each (N,).
    """
    p, q, r, phi, theta = (values[name] for name in ("p", "q", "r", "phi", "theta"))
    aside = q * np.sin(phi) + r * np.cos(phi)
    return {"phi": p + np.tan(theta) * aside, "theta": q * np.cos(phi) - r * np.sin(phi), "psi": aside / np.cos(theta)}


def calibrated(record: FlightRecord) -> FlightRecord:
    """The record without the lags and the bending that it declares, each told among its `problems`; else as it is.

    What is left declared is nothing, so that a second call changes nothing.

    Raises:
        InputError: as `calibration`.
    """
    record = with_prompt_attitudes(record)
    known = calibration(record.meta.sensors)
    if not known.stated:
        return record
    channels, found = dict(record.channels), list[DataProblem]()
    start, end = float(record.time[0]), float(record.time[-1])
    if known.bending and "alpha" in channels and "az" in channels:
        felt = common_grid(record).values["az"] + G0
        channels["alpha"] = channels["alpha"] - known.bending * np.interp(record.time, _times(record), felt)
        kind = f"boom's bending of {known.bending:.3g} rad s2/m taken out, as declared"
        found.append(DataProblem("alpha", kind, start, end, True))
    grid = common_grid(replace(record, channels=channels))
    for name, lag in known.lags.items():
        if name in grid.values:
            late = lag * np.interp(record.time, grid.time, rate(grid.values[name], grid.dt, lag))
            channels[name] = channels[name] + late
            found.append(DataProblem(name, f"lag of {lag:.3g} s taken out, as declared", start, end, True))
    done = _done(record.meta.sensors, LAGGED)
    return replace(record, channels=channels, meta=replace(record.meta, sensors=done)).with_problems(found)


def _times(record: FlightRecord) -> FloatArray:
    return common_grid(record).time


def _done(sensors: Mapping[str, Any], corrected: Iterable[str]) -> dict[str, Any]:
    """The table without what has been corrected."""
    left = dict(sensors)
    for name in corrected:
        if isinstance(sensors.get(name), Mapping):
            left[name] = {key: value for key, value in sensors[name].items() if key not in ("lag", "bending")}
    return left


def rate(signal: FloatArray, dt: float, lag: float) -> FloatArray:
    """Slope of a signal (N,) by local quadratics, as short as `QUIET` allows for a correction by `lag` (s)."""
    n = 5
    while n * (n * n - 1) * (QUIET * dt / lag) ** 2 < 12.0:
        n += 2
    n = min(n, len(signal) - 1 + len(signal) % 2)
    return np.asarray(savgol_filter(signal, n, 2, deriv=1, delta=dt), dtype=np.float64)


def time_constant(lag: float, dt: float) -> float:
    """The time constant (s) with which a lag updated every `dt` (s) is late by `lag`: dt/ln(1 + dt/lag); 0 for 0."""
    return dt / math.log1p(dt / lag) if lag > 0.0 else 0.0
