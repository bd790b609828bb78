"""The generator's aerodynamic coefficients, from docs/model.md 5 to 8 for flaps-up flight in free air.

Every number with a knob is neutral at 0 (`published.py`). SI and radians; `met`: airspeed, alpha, beta, sine and cosine
of alpha, normalised p, q and r; `moved`: elevator, aileron and rudder as the air meets them; `p`: the airframe's
numbers; `ct`: thrust coefficient less its reference; `t`: s.
"""

from __future__ import annotations

import math
from typing import Any

from testbed.withheld.compiled import part


@part
def smooth(y: float) -> float:
    """Quintic step from 0 to 1, docs/model.md 6."""
    t = min(max(y, 0.0), 1.0)
    return t * t * t * (10.0 + t * (6.0 * t - 15.0))


@part
def bounded(gain: float, x: float, reach: float) -> float:
    """`gain * x` at small x, saturating beyond `reach`."""
    return gain * reach * math.tanh(x / reach)


@part
def half_wings(met: Any, p: Any) -> tuple[float, float, float, float, float]:
    """Share of the wing that is stalled, CZ of its left and right half, CX of both."""
    _V, a, _b, sa, _ca, ph, _qh, _rh = met
    al, ar = a - p.panel_arm * ph, a + p.panel_arm * ph
    left = smooth(max(al - p.alpha_stall, -al - p.alpha_stall_negative) / p.stall_width)
    right = smooth(max(ar - p.alpha_stall, -ar - p.alpha_stall_negative) / p.stall_width)
    plate = -sa / (0.283 + 0.222 * abs(sa))
    lift = p.CZ_0 + p.CZ_alpha * a + bounded(p.CZ_alpha_soft, a, 0.35)
    zl = (1.0 - left) * lift + left * plate
    zr = (1.0 - right) * (lift + p.CZ_alpha_right * a) + right * plate
    axial = a * (p.CX_alpha + p.CX_alpha2 * a)
    xl = p.CX_0 + (1.0 - left) * axial
    xr = p.CX_0 + p.CX_0_right + (1.0 - right) * axial
    return 0.5 * (left + right), zl, zr, xl, xr


@part
def forces(met: Any, moved: Any, wings: Any, ct: float, adot: float, t: float, p: Any) -> tuple[float, float]:
    """CX and CZ; `adot`: d alpha / dt, late by 0.05 s."""
    V, a, b, sa, ca, _ph, qh, _rh = met
    de, da, dr = moved
    _share, zl, zr, xl, xr = wings
    zw = 0.5 * (zl + zr)
    drag = p.CD_parasite + p.CD_alpha * (a / 0.06) ** 2 + p.CD_lift * zw * zw + p.brake_drag * abs(dr)
    gone = t / 40.0
    drag += p.CD_beta2 * b * b + p.aileron_brake * abs(da) + (p.door if t > 20.0 else 0.0) - 0.2 * p.flap_creep * gone
    drag += p.elevator_drag * de * de
    cx = 0.5 * (xl + xr) - drag * ca
    cz = (zw - drag * sa + p.CZ_q * qh + p.CZ_elevator * de + p.CZ_CT * ct
          + p.CZ_alphadot * adot * p.chord / (2.0 * V) + p.CZ_beta2 * b * b + p.CZ_ct_alpha * ct * a
          + p.flap_creep * gone + p.CZ_hysteresis * math.tanh(adot / 0.05) + p.CZ_aileron_abs * abs(da))  # fmt: skip
    return cx, cz


@part
def pitching(met: Any, moved: Any, share: float, ct: float, tail_met: Any, t: float, p: Any) -> float:
    """Cm.

    Args:
        share: of the wing that is stalled.
        tail_met: change of alpha at the tail by the gust's delay, by the pitch rate, alpha as the downwash follows it,
            and as it does so twice.
    """
    V, a, b, sa, _ca, ph, qh, _rh = met
    de, da, _dr = moved
    arrival, turning, late, later = tail_met
    fast = V / 72.0
    at = a + arrival - p.downwash_slope * late + p.tail_incidence + turning
    tail = smooth((-at - p.alpha_tail_stall) / p.tail_stall_width)
    lagging = p.chord / (2.0 * p.tail_arm)
    return (p.Cm_0 + p.Cm_alpha * ((1.0 - share) * a + share * p.Cm_alpha_separated * sa)
            + bounded(p.Cm_alpha_soft, a, 0.35) + bounded(p.Cm_q_soft, qh, 0.008)
            + (p.Cm_q - p.Cm_alphadot) * qh + p.Cm_alphadot * lagging * (a - late)
            + p.Cm_downwash2 * (lagging * (a - later) - 2.0 * qh) + p.Cm_alpha_tail * arrival
            + (p.Cm_elevator * de + bounded(p.Cm_elevator_soft, de, 0.2)) * (1.0 + p.Cm_elevator_CT * ct)
            * (1.0 - p.tail_stall_elevator_loss * tail)
            + p.Cm_CT * ct + p.Cm_ct2 * (ct + 6.0 * ct * ct) - tail * p.Cm_alpha_tail * (at + p.alpha_tail_stall)
            + p.Cm_at_72 * fast + p.Cm_aileron * da + p.Cm_beta2 * b * b + p.Cm_hump * (a - 0.03) ** 3
            + p.Cm_rotor_wake * ct * (a - 0.03) + p.Cm_alpha_q * (a - 0.03) * qh
            + 0.1 * p.flap_creep * (t / 40.0) + p.Cm_p * ph + p.trim_runs * max(t - 15.0, 0.0) / 25.0)  # fmt: skip


@part
def lateral(met: Any, moved: Any, wings: Any, ct: float, load: float, slipped: float, t: float, p: Any
            ) -> tuple[float, float, float]:  # fmt: skip
    """CY, Cl, Cn; `load`: factor less 1; `slipped`: beta less what it was, late by 0.1 s."""
    V, a, b, _sa, _ca, ph, _qh, rh = met
    _de, da, dr = moved
    share, zl, zr, xl, xr = wings
    fast = V / 72.0
    loss = 1.0 - p.damping_separated * share
    fin = 1.0 + p.fin_ct * ct
    cy = (p.CY_0 + p.CY_beta * b + bounded(p.CY_beta_soft, b, 0.25) + p.CY_p * ph + p.CY_r * rh
          + (p.CY_rudder + p.CY_alpha_rudder * (a - 0.03)) * dr + p.CY_aileron * da)  # fmt: skip
    cl = (p.Cl_0 + p.Cl_alpha * a + p.Cl_beta * b + bounded(p.Cl_beta_soft, b, 0.25) + p.Cl_r * rh + p.Cl_rudder * dr
          + loss * (p.Cl_p * ph + bounded(p.Cl_p_soft, ph, 0.1) + p.Cl_aileron * da
                    + bounded(p.Cl_aileron_soft, da, 0.3))
          + p.lift_arm * 0.5 * (zr - zl) + p.Cl_at_72 * fast + p.Cl_torque * ct
          + p.Cl_alpha_p * (a - 0.03) * ph + p.Cl_wave * math.sin(2.0 * math.pi * t / 7.0)
          + p.Cl_beta_load * b * load + p.wake * math.exp(-((t - 22.0) ** 2))
          + p.Cl_ct_aileron * ct * da + (p.spoiler if t > 25.0 else 0.0))  # fmt: skip
    cn = (p.Cn_0 + fin * (p.Cn_beta * b + p.Cn_rudder * dr) + bounded(p.Cn_beta_soft, b, 0.25) + p.Cn_p * ph
          + p.Cn_r * rh + p.Cn_aileron * da + bounded(p.Cn_rudder_soft, dr, 0.25) - p.lift_arm * 0.5 * (xr - xl)
          + p.Cn_betadot * slipped / 0.1 * p.span / (2.0 * V) + p.Cn_pfactor * a * ct
          + p.Cn_alpha_aileron * a * da)  # fmt: skip
    return cy, cl, cn
