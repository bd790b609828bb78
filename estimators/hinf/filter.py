"""The recursive H-infinity identifier: six decoupled channels, one row of memory per aircraft, compiled.

Each call of `step` takes one sample of measurements per aircraft and returns estimates of the aerodynamic
coefficients with their uncertainty. `channel` has the mathematics, `estimators.observer` the flight mechanics,
`configs/estimators/hinf.toml` the tuning. The identifier sees measurements and the clean airframe, never truth.

A standard error is the square root of the diagonal of B3: one standard deviation of the estimate if the
unmodelled accelerations and the measurement errors are white with the densities d^2, n^2 and n_a^2 of the tuning.
A finite gamma inflates it, by at most (1 - gamma^-2)^(-1/2).

Channels learn, and their parameters are allowed to wander, only while they are excited
(`estimators.observer.excitation`): gusts and
an autopilot's answer to them would drag Cm_alpha and Cm_q towards a false ice alarm, noise would lower CL_alpha in
calm air. Drag is always live.
"""

from __future__ import annotations

import math
from typing import Any

from estimators.hinf.channel import forget, learn
from estimators.observer.excitation import hearing
from estimators.observer.layout import ACCELEROMETER, COUNT, DIAGONAL, FIRST, PACKED
from estimators.observer.sample import close_sample, open_sample
from icing_env.jit import entry, kernel


@kernel
def learn_all(ob: Any, tn: Any, excited: tuple[float, float, float, float], dt: float) -> bool:
    """All six channels over one sample: state row, accelerometer row, wandering. False if any of them failed.

    excited: shares of pitch, turn, lift and side. A channel takes data in, and wanders, as far as it is excited.
    """
    theta, b3, gain = ob["theta"], ob["b3"], ob["gain"]
    kappa = 1.0 - 1.0 / (tn["gamma"] * tn["gamma"])
    heard = hearing(tn, excited, dt)
    good = True
    for c in range(6):
        first, packed, m = FIRST[c], PACKED[c], COUNT[c]
        target = ob["y"][c] - ob["zeta"][c]
        information = heard[c] / (tn["n"][c] * tn["n"][c])
        good &= learn(theta, b3, gain, first, packed, m, ob["filtered"], 1.0, target, information, kappa)
        if ACCELEROMETER[c] >= 0:
            a = ACCELEROMETER[c]
            factor = ob["factor"][a] * ob["bandwidth"][c]
            target = ob["felt_filtered"][a] * factor
            information = heard[c] / (tn["accelerometer"][a] * tn["accelerometer"][a])
            good &= learn(theta, b3, gain, first, packed, m, ob["filtered"], factor, target, information, kappa)
        k0 = tn["k0"][c]
        forget(b3, ob["scale"], first, packed, m, k0 * heard[c], tn["q0"][c])
    return good


@kernel
def settle(ob: Any) -> bool:
    """Write the standard deviations. False if a variance is not positive or an estimate not finite."""
    total = 0.0
    lowest = 1.0
    for channel in range(6):
        for i in range(COUNT[channel]):
            variance = ob["b3"][PACKED[channel] + i * (i + 1) // 2 + i]
            total += variance + ob["theta"][FIRST[channel] + i]
            lowest = min(lowest, variance)
    if not (lowest > 0.0 and math.isfinite(total)):
        return False
    for i in range(26):
        ob["deviation"][i] = math.sqrt(ob["b3"][DIAGONAL[i]])
    return True


@kernel
def observe(ob: Any, est: Any, m: Any, af: Any, tn: Any, dt: float) -> None:
    """One aircraft, one sample. See `step`."""
    readable, excited = open_sample(ob, est, m, af, tn, dt)
    if not readable:
        return
    good = True
    if ob["seated"] > 0.0:
        good = learn_all(ob, tn, excited, dt) and settle(ob)
    close_sample(ob, est, af, tn, good, excited, dt)


@entry
def step(observer: Any, estimate: Any, measurement: Any, airframe: Any, tuning: Any, dt: float) -> None:
    """Advance `n` observers by one sample of `dt` seconds, in place.

    observer (OBSERVER), estimate (ESTIMATE), measurement (MEASUREMENT): n rows each. airframe: one row or n rows,
    any structured type that has the fields of AIRFRAME. tuning: one row of TUNING.
    The first sample starts the state estimates at the measurement. A sample with a NaN leaves estimates and
    memory as they are, reports health 0, and the filters start again at the next readable one. Health stays 0
    after a finite escape (gamma below gamma* = 1) until `init`.
    """
    for i in range(len(observer)):
        observe(observer[i], estimate[i], measurement[i], airframe[i if len(airframe) > 1 else 0], tuning[0], dt)
