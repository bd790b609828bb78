"""Figures of functions 3 and 4 of an ice management system, one number per episode.

An exceedance is time beyond what the iced aircraft, by the truth, can do: angle of attack beyond the onset of the iced
stall, less than the iced stall speed in level flight, a load factor beyond the limit loads, a bank beyond 60 deg.
Settling and overshoot are taken from the task `steps` (`icing_env.tasks`), to within a tenth of the step.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from icing_env.tasks import ALTITUDE_STEP, HEADING_STEP, STEP_TIMES
from testbed.comparison.ice_figures import present
from testbed.comparison.trace import INTERVAL, Trace, rms

TOUCHED = 1e-6  # rad or 0..1, change to a control that counts as an intervention
LIMIT_LOAD, LIMIT_NEGATIVE_LOAD = 3.8, -1.52  # 1, FlightGear dhc6-base.xml
BANK = math.radians(60.0)  # rad, an aerobatic bank by 14 CFR 91.307
BAND = 0.1  # share of the step within which it counts as settled
STEPS = {"altitude": (STEP_TIMES[0], STEP_TIMES[1], ALTITUDE_STEP),
         "heading": (STEP_TIMES[1], STEP_TIMES[2], HEADING_STEP)}  # s, s, size


def last(name: str) -> Callable[[Trace, int], float]:
    """Value of a channel at an episode's last sample."""
    return lambda t, i: float(t[name][t.alive[:, i], i][-1])


def deviation(name: str) -> Callable[[Trace, int], float]:
    """RMS of a channel."""
    return lambda t, i: rms(t[name][:, i], t, i)


def activity(surface: str) -> Callable[[Trace, int], float]:
    """RMS rate of a surface's command [rad/s]."""
    name = f"command_{surface}"
    return lambda t, i: rms(np.diff(t[name][:, i], prepend=t[name][0, i])/INTERVAL, t, i)


def share(of: Callable[[Trace, int], NDArray[np.bool_]]) -> Callable[[Trace, int], float]:
    """Share of the flight's time for which something holds."""
    return lambda t, i: float(np.mean(of(t, i)[t.alive[:, i]]))


def stalling(t: Trace, i: int) -> NDArray[np.bool_]:
    """Samples beyond the onset of the iced stall."""
    return t["alpha_margin"][:, i] < 0.0


def beyond(t: Trace, i: int) -> NDArray[np.bool_]:
    """Samples of an exceedance."""
    load = t["load_factor"][:, i]
    return (stalling(t, i) | (t["airspeed"][:, i] < t["stall_speed"][:, i]) | (load > LIMIT_LOAD)
            | (load < LIMIT_NEGATIVE_LOAD) | (np.abs(t["bank"][:, i]) > BANK))


def touched(t: Trace, i: int) -> NDArray[np.bool_]:
    """Samples at which the protection moves elevator or aileron."""
    return (np.abs(t["intervention"][:, i]) > TOUCHED) | (np.abs(t["intervention_aileron"][:, i]) > TOUCHED)


def longest_stall(t: Trace, i: int) -> float:
    """Longest unbroken time beyond the iced stall's onset [s]."""
    best = run = 0
    for there in stalling(t, i) & t.alive[:, i]:
        run = run + 1 if there else 0
        best = max(best, run)
    return best*INTERVAL


def nuisance(t: Trace, i: int) -> float:
    """Share of the time without ice at which the protection moves a surface; NaN if there was always ice."""
    clear = ~present(t, i, 0.5) & t.alive[:, i]
    return float(np.mean(touched(t, i)[clear])) if clear.any() else float("nan")


def _after_step(t: Trace, i: int, what: str) -> NDArray[np.float64] | None:
    """Error [share of the step] from the step until the next, None if the task has no steps or the flight ended."""
    start, end, size = STEPS[what]
    rows = (t.time > start) & (t.time < end)
    if not t.stepped or t.time[-1] < end or not t.alive[rows, i].all():
        return None
    return np.asarray(t[f"{what}_error"][rows, i]/size)


def overshoot(what: str) -> Callable[[Trace, int], float]:
    """How far a step is passed, as a share of it; NaN where none was flown."""
    def of(t: Trace, i: int) -> float:
        error = _after_step(t, i, what)
        return float("nan") if error is None else max(float(-error.min()), 0.0)

    return of


def settling(what: str) -> Callable[[Trace, int], float]:
    """Time until a step is held to a tenth of it [s], until the next step if it never is; NaN where none was flown."""
    def of(t: Trace, i: int) -> float:
        error = _after_step(t, i, what)
        if error is None:
            return float("nan")
        outside = np.flatnonzero(np.abs(error) > BAND)
        return float((outside[-1] + 1)*INTERVAL) if len(outside) else 0.0

    return of
