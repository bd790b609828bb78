"""Real-time frequency domain: regression between Fourier transforms that grow sample by sample.

Each channel's equation holds over every sampling interval by itself,
    y(k) - y(k-1) - h rest = h row'theta        (moments; for forces: h felt = h row'theta),
rows and rest in the mean of both ends. So it holds between recursive transforms, X(k) = lambda X(k-1) + x e^(-jwt), of
its two sides at any frequency: the transform of differences is that of the derivative, jwX with its end terms, and the
transforms of a gap or of flight without excitation, which weigh nothing, need no patching. Over a band without w = 0
    thetahat = Re(X'X)^-1 Re(X'Z)
is free of drifts, and of noise above the band without a filter. What a constant leaks into the band is fitted as the
bias term; the bias itself, and zero-lift drag, come from the same sums at w = 0.
Source: Morelli, AIAA 99-4043 and J. Aircraft 37(1), 2000; Klein and Morelli, chapters 7 and 8.

Covariance: (X'X)^-1 {sum of squared scores Re(x e)} (X'X)^-1, which needs no white spectrum of the residuals, times
1/(df T) where the frequencies stand closer than the record's length T can tell apart, times m/(m - p).
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.estimate import Estimate
from estimators.observer import record as runs
from estimators.observer.excitation import gate
from estimators.observer.filters import look, remember
from estimators.observer.layout import FIRST, seat
from estimators.observer.report import follow_drag, report
from estimators.observer.rows import readable
from estimators.observer.tuning import read_tuning, tuning_type
from estimators.recursive.spectra import (
    MEMORY,
    fit,
    level,
    set_phases,
    transform,
)
from icing_env.configuration import folder
from icing_env.jit import entry, kernel
from icing_env.record import FlightRecord

NUMBERS = ("lowest", "highest", "interval", "memory", "drag_memory", "bandwidth", "q0")
TUNING = tuning_type(NUMBERS, ())

def tuning_from(path: str | Path) -> NDArray[np.void]:
    """Read a tuning file; a `TUNING` array of one row. Raises InputError on an unknown or missing key."""
    return read_tuning(path, NUMBERS, ())


@cache
def _default() -> NDArray[np.void]:
    return tuning_from(folder() / "estimators" / "real_time_frequency.toml")


def default_tuning() -> NDArray[np.void]:
    """A fresh copy of the one tuning that everything uses (a `TUNING` array of one row)."""
    return _default().copy()


def init(parameters: NDArray[np.void], tuning: NDArray[np.void], n: int, start: float = 1.0) -> NDArray[np.void]:
    """Memory of `n` identifiers that start at `start` times the clean aircraft (`MEMORY` array).

    parameters: structured array with the fields of AIRFRAME, one row or n rows. tuning: `TUNING` array of one row.
    """
    memory = np.zeros(n, MEMORY)
    seat(memory, parameters, tuning, np.repeat(tuning["bandwidth"], 6), start)
    memory["prior"] = memory["theta"]
    memory["leak"] = memory["theta"][:, list(FIRST)]
    return memory


@kernel
def learn(ob: Any, tn: Any, excited: tuple[float, float, float, float], dt: float) -> bool:
    """One sample into the sums; at the end of an interval, new estimates. False if an estimate is not finite."""
    low, high = tn["share_low"], tn["share_high"]
    pitch, turn, lift, side = excited
    turning = dt * gate(turn, low, high)
    heard = (dt, dt * gate(lift, low, high), dt * gate(pitch, low, high), dt * gate(side, low, high), turning, turning)
    transform(ob, tn, heard, dt)
    ob["clock"] -= dt
    if ob["clock"] > 0.5 * dt:
        return True
    ob["clock"] += tn["interval"]
    total = 0.0
    for c in range(6):
        if heard[c] > 0.0 and (c == 0 or fit(ob, tn, c)):
            level(ob, tn, c)
    for i in range(26):
        total += ob["theta"][i] + ob["deviation"][i]
    return math.isfinite(total)


@kernel
def observe(ob: Any, est: Any, m: Any, af: Any, tn: Any, dt: float) -> None:
    """One aircraft, one sample. See `step`."""
    est["health"] = 0.0
    if ob["failed"] > 0.0:
        return
    if not readable(m):
        ob["seated"] = 0.0
        return
    excited = look(ob, m, af, tn, dt)
    if ob["seated"] > 0.0:
        if not learn(ob, tn, excited, dt):
            ob["failed"] = 1.0
            return
        follow_drag(ob, af, tn, dt)
    elif ob["turn"][0, 0] == 0.0:
        set_phases(ob, tn, dt)
        ob["clock"] = tn["interval"]
    remember(ob)
    report(ob, est, excited[0], excited[1])


@entry
def step(memory: Any, estimate: Any, measurement: Any, airframe: Any, tuning: Any, dt: float) -> None:
    """Advance `n` identifiers by one sample of `dt` seconds, in place; arguments as `estimators.hinf.step` has them.

    dt must be the same at each call. A sample with a NaN leaves estimates as they are and reports health 0.
    """
    for i in range(len(memory)):
        observe(memory[i], estimate[i], measurement[i], airframe[i if len(airframe) > 1 else 0], tuning[0], dt)


METHOD = runs.Method("real-time frequency domain", init, step, default_tuning, own_errors=True)


def identify(
    record: FlightRecord,
    tuning: NDArray[np.void] | None = None,
    start: float = 1.0,
    airframe: NDArray[np.void] | None = None,
) -> dict[str, Estimate]:
    """Derivatives by name at the end of the record; see `estimators.observer.record.identify`.

    Standard errors are the method's own (see above).
    """
    return runs.identify(METHOD, record, tuning, start, airframe)
