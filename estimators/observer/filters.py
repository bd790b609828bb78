"""The matched filters: regressors, dynamics and accelerometers all behind the same first-order filter.

With xdot = a'theta + b, the filter s -> w/(s + w) on both sides gives, without differentiating anything,
    x - zeta = f'theta,   fdot = a - w f,   zetadot = b + w (x - zeta)
(state-variable filter; its steady Riccati form is that of the H-infinity observer: estimators.hinf.channel). What an
accelerometer says of a'theta passes through the same filter, so that one f serves both rows of a channel.
"""

from __future__ import annotations

from typing import Any

from estimators.observer.excitation import excite, shares
from estimators.observer.layout import ACCELEROMETER, COUNT, FIRST
from estimators.observer.rows import force_rows, incidence, moment_rows
from icing_env.jit import kernel


@kernel
def filter_step(x: float, u0: float, u1: float, rate: float, dt: float) -> float:
    """xdot = u(t) - rate x over one sample by RK4, u linear between u0 and u1."""
    half = 0.5 * (u0 + u1)
    k1 = u0 - rate * x
    k2 = half - rate * (x + 0.5 * dt * k1)
    k3 = half - rate * (x + 0.5 * dt * k2)
    k4 = u1 - rate * (x + dt * k3)
    return x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@kernel
def advance_filters(ob: Any, dt: float) -> None:
    """f and zeta of every channel, and what the accelerometers feel, over one sample (RK4)."""
    for channel in range(6):
        rate = ob["bandwidth"][channel]
        for i in range(FIRST[channel], FIRST[channel] + COUNT[channel]):
            ob["filtered"][i] = filter_step(ob["filtered"][i], ob["row_before"][i], ob["row"][i], rate, dt)
        before = ob["rest_before"][channel] + rate * ob["y_before"][channel]
        now = ob["rest"][channel] + rate * ob["y"][channel]
        ob["zeta"][channel] = filter_step(ob["zeta"][channel], before, now, rate, dt)
        a = ACCELEROMETER[channel]
        if a >= 0:
            ob["felt_filtered"][a] = filter_step(ob["felt_filtered"][a], ob["felt_before"][a], ob["felt"][a], rate, dt)


@kernel
def look(ob: Any, m: Any, af: Any, tn: Any, dt: float) -> tuple[float, float, float, float]:
    """Form the rows of a sample from what was measured and pass them through the filters, if these have started.

    Returns the shares of excitation of pitch, of turn, of lift and of side force.
    """
    alpha, beta = incidence(m, af["vane_lag"], af["boom_gain"], dt)
    qbar = force_rows(ob, m, af, m["airspeed"], alpha, beta, m["p"], m["q"], m["r"])
    moment_rows(ob, m, af, qbar, m["airspeed"], alpha, beta, m["p"], m["q"], m["r"])
    if ob["seated"] > 0.0:
        advance_filters(ob, dt)
    excite(ob, af, tn["window"], dt)
    return shares(ob, tn, af)


@kernel
def remember(ob: Any) -> None:
    """Keep this sample's rows; if the filters had not started they start here: zeta = y, nothing filtered yet."""
    seat = ob["seated"] == 0.0
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
    ob["seated"] = 1.0
