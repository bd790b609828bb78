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
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.observer import record as runs
from estimators.observer.excitation import hearing
from estimators.observer.layout import FIRST, seat
from estimators.observer.sample import close_sample, open_sample
from estimators.observer.tuning import Tuning
from estimators.recursive.spectra import (
    MEMORY,
    fit,
    level,
    set_phases,
    transform,
)
from icing_env.jit import entry, kernel

NUMBERS = ("lowest", "highest", "interval", "memory", "drag_memory", "bandwidth", "q0")
default_tuning = Tuning("real_time_frequency", NUMBERS).default


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
    heard = hearing(tn, excited, dt)
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
    readable, excited = open_sample(ob, est, m, af, tn, dt)
    if not readable:
        return
    good = True
    if ob["seated"] > 0.0:
        good = learn(ob, tn, excited, dt)
    elif ob["turn"][0, 0] == 0.0:
        set_phases(ob, tn, dt)
        ob["clock"] = tn["interval"]
    close_sample(ob, est, af, tn, good, excited, dt)


@entry
def step(memory: Any, estimate: Any, measurement: Any, airframe: Any, tuning: Any, dt: float) -> None:
    """Advance `n` identifiers by one sample of `dt` seconds, in place; arguments as `estimators.hinf.step` has them.

    dt must be the same at each call. A sample with a NaN leaves estimates as they are and reports health 0.
    """
    for i in range(len(memory)):
        observe(memory[i], estimate[i], measurement[i], airframe[i if len(airframe) > 1 else 0], tuning[0], dt)


METHOD = runs.Method("real-time frequency domain", init, step, default_tuning, own_errors=True,
                     left_out={"CL_alpha": 0.012, "CL_elevator": 0.1, "Cm_alpha": 0.008})  # fmt: skip
identify = partial(runs.identify, METHOD)
