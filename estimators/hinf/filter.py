"""The recursive H-infinity identifier: six decoupled channels, one row of memory per aircraft, compiled.

Each call of `step` takes one sample of measurements per aircraft and returns estimates of the aerodynamic
coefficients with their uncertainty. `hinf_channel` has the mathematics, `hinf_rows` the flight mechanics,
`configs/estimators/hinf.toml` the tuning. The identifier sees measurements and the clean airframe, never truth.

A standard error is the square root of the diagonal of B3: one standard deviation of the estimate if the
unmodelled accelerations and the measurement errors are white with the densities d^2, n^2 and n_a^2 of the tuning.
A finite gamma inflates it, by at most (1 - gamma^-2)^(-1/2).

Channels learn, and their parameters are allowed to wander, only while they are excited (`hinf_excitation`): gusts and
an autopilot's answer to them would drag Cm_alpha and Cm_q towards a false ice alarm, noise would lower CL_alpha in
calm air. Drag is always live.
"""

from __future__ import annotations

import math
from typing import Any

from estimators.hinf.channel import filter_step, forget, learn
from estimators.hinf.excitation import excite, gate, shares
from estimators.hinf.memory import ACCELEROMETER, COUNT, DIAGONAL, FIRST, PACKED
from estimators.hinf.rows import clean_zero_lift_drag, force_rows, moment_rows, readable
from icing_env.jit import entry, kernel


@kernel
def advance_filters(ob: Any, tn: Any, dt: float) -> None:
    """f and zeta of every channel, and what the accelerometers feel, over one sample (RK4)."""
    for channel in range(6):
        rate = tn["d"][channel] / tn["n"][channel]
        for i in range(FIRST[channel], FIRST[channel] + COUNT[channel]):
            ob["filtered"][i] = filter_step(ob["filtered"][i], ob["row_before"][i], ob["row"][i], rate, dt)
        before = ob["rest_before"][channel] + rate * ob["y_before"][channel]
        now = ob["rest"][channel] + rate * ob["y"][channel]
        ob["zeta"][channel] = filter_step(ob["zeta"][channel], before, now, rate, dt)
        a = ACCELEROMETER[channel]
        if a >= 0:
            ob["felt_filtered"][a] = filter_step(ob["felt_filtered"][a], ob["felt_before"][a], ob["felt"][a], rate, dt)


@kernel
def remember(ob: Any, seat: bool) -> None:
    """Keep this sample's rows; with `seat`, start the filters here: xhat = y, nothing filtered yet."""
    for i in range(26):
        ob["row_before"][i] = ob["row"][i]
        if seat:
            ob["filtered"][i] = 0.0
    for i in range(6):
        ob["rest_before"][i], ob["y_before"][i] = ob["rest"][i], ob["y"][i]
        if seat:
            ob["zeta"][i] = ob["y"][i]
    for i in range(3):
        ob["felt_before"][i] = ob["felt"][i]
        if seat:
            ob["felt_filtered"][i] = 0.0


@kernel
def learn_all(ob: Any, tn: Any, excited: tuple[float, float, float, float], dt: float) -> bool:
    """All six channels over one sample: state row, accelerometer row, wandering. False if any of them failed.

    excited: shares of pitch, turn, lift and side. A channel takes data in, and wanders, as far as it is excited.
    """
    theta, b3, gain = ob["theta"], ob["b3"], ob["gain"]
    kappa = 1.0 - 1.0 / (tn["gamma"] * tn["gamma"])
    low, high = tn["share_low"], tn["share_high"]
    pitch, turn, lift, side = excited
    turning = dt * gate(turn, low, high)
    heard = (dt, dt * gate(lift, low, high), dt * gate(pitch, low, high), dt * gate(side, low, high), turning, turning)
    good = True
    for c in range(6):
        first, packed, m = FIRST[c], PACKED[c], COUNT[c]
        target = ob["y"][c] - ob["zeta"][c]
        information = heard[c] / (tn["n"][c] * tn["n"][c])
        good &= learn(theta, b3, gain, first, packed, m, ob["filtered"], 1.0, target, information, kappa)
        if ACCELEROMETER[c] >= 0:
            a = ACCELEROMETER[c]
            factor = ob["factor"][a] * tn["d"][c] / tn["n"][c]
            target = ob["felt_filtered"][a] * factor
            information = heard[c] / (tn["accelerometer"][a] * tn["accelerometer"][a])
            good &= learn(theta, b3, gain, first, packed, m, ob["filtered"], factor, target, information, kappa)
        k0 = tn["k0"][c]
        forget(b3, ob["scale"], first, packed, m, k0 * heard[c], tn["q0"][c])
    return good


@kernel
def healthy(ob: Any) -> bool:
    """True while every estimate is finite and every variance positive."""
    total = 0.0
    lowest = 1.0
    for channel in range(6):
        for i in range(COUNT[channel]):
            variance = ob["b3"][PACKED[channel] + i * (i + 1) // 2 + i]
            total += variance + ob["theta"][FIRST[channel] + i]
            lowest = min(lowest, variance)
    return lowest > 0.0 and math.isfinite(total)


@kernel
def report(ob: Any, est: Any, longitudinal: float, lateral: float) -> None:
    """Write estimates, standard errors, excess drag and excitation; health is 1. Order: PARAMETER_NAMES."""
    th, sd = ob["theta"], ob["deviation"]
    for i in range(26):
        sd[i] = math.sqrt(ob["b3"][DIAGONAL[i]])
    est["CD_0"], est["CL_0"], est["CL_alpha"] = th[0], th[1], th[2]
    est["CL_elevator"], est["Cm_0"], est["Cm_alpha"] = th[4], th[5], th[6]
    est["Cm_q"], est["Cm_elevator"], est["CY_0"] = th[7], th[8], th[9]
    est["CY_beta"], est["CY_r"], est["CY_rudder"] = th[10], th[12], th[13]
    est["Cl_0"], est["Cl_beta"], est["Cl_p"] = th[14], th[15], th[16]
    est["Cl_r"], est["Cl_aileron"], est["Cl_rudder"] = th[17], th[18], th[19]
    est["Cn_0"], est["Cn_beta"], est["Cn_p"] = th[20], th[21], th[22]
    est["Cn_r"], est["Cn_aileron"], est["Cn_rudder"] = th[23], th[24], th[25]
    est["CD_0_std"], est["CL_0_std"] = sd[0], sd[1]
    est["CL_alpha_std"], est["CL_elevator_std"] = sd[2], sd[4]
    est["Cm_0_std"], est["Cm_alpha_std"] = sd[5], sd[6]
    est["Cm_q_std"], est["Cm_elevator_std"] = sd[7], sd[8]
    est["CY_0_std"], est["CY_beta_std"] = sd[9], sd[10]
    est["CY_r_std"], est["CY_rudder_std"] = sd[12], sd[13]
    est["Cl_0_std"], est["Cl_beta_std"] = sd[14], sd[15]
    est["Cl_p_std"], est["Cl_r_std"] = sd[16], sd[17]
    est["Cl_aileron_std"], est["Cl_rudder_std"] = sd[18], sd[19]
    est["Cn_0_std"], est["Cn_beta_std"] = sd[20], sd[21]
    est["Cn_p_std"], est["Cn_r_std"] = sd[22], sd[23]
    est["Cn_aileron_std"], est["Cn_rudder_std"] = sd[24], sd[25]
    est["excess_drag"] = ob["excess_drag"]
    est["excitation_longitudinal"], est["excitation_lateral"] = longitudinal, lateral
    est["health"] = 1.0


@kernel
def observe(ob: Any, est: Any, m: Any, af: Any, tn: Any, dt: float) -> None:
    """One aircraft, one sample. See `step`."""
    est["health"] = 0.0
    if ob["failed"] > 0.0:
        return
    if not readable(m):
        ob["seated"] = 0.0
        return
    moment_rows(ob, m, af, force_rows(ob, m, af, dt))
    if ob["seated"] > 0.0:
        advance_filters(ob, tn, dt)
    excite(ob, af, tn["window"], dt)
    excited = shares(ob, tn, af)
    if ob["seated"] > 0.0:
        good = learn_all(ob, tn, excited, dt)
        if not (good and healthy(ob)):
            ob["failed"] = 1.0
            return
        excess = ob["theta"][0] - clean_zero_lift_drag(af)
        ob["excess_drag"] += min(1.0, dt / tn["drag_smoothing"]) * (excess - ob["excess_drag"])
    remember(ob, ob["seated"] == 0.0)
    ob["seated"] = 1.0
    report(ob, est, excited[0], excited[1])


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
