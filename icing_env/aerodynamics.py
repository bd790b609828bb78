"""Aerodynamic coefficients in body axes, from -30 to 40 deg angle of attack.

Below the onset of separation every coefficient is the published linear (CX: quadratic) form, exactly; beyond it each
half wing blends over to a flat plate, so that stall, its asymmetry and the roll it causes come from one mechanism.

* attached: CX = CX_0 + CX_alpha a + CX_alpha2 a^2, CZ = CZ_0 + CZ_alpha a (UIUC/FDC form, aircraft.dat)
* separated: C_N = sin a / (0.283 + 0.222 |sin a|) (Hoerner, Fluid-Dynamic Drag, flat plate normal to its chord)
* separated share of a half wing: smootherstep of its own local angle of attack (assumed shape, twice differentiable)
* tail: quasi-steady Cm_q is split into the part of q and the part of downwash lag, their sum conserved
  (Etkin & Reid, Dynamics of Flight, 3rd ed., section 5.5: Cm_alphadot from the delay l_t/V)
"""

from __future__ import annotations

from typing import Any

from icing_env.jit import kernel
from icing_env.types import DERIVATIVE_NAMES, Field, unit_of

AERODYNAMIC_PARAMETERS: list[Field] = [
    ("wing_area", "m2", "reference area"),
    ("span", "m", "wing span"),
    ("chord", "m", "mean aerodynamic chord"),
    ("tail_arm", "m", "c.g. to quarter chord of the tailplane"),
    *((name, unit_of(name), "clean value, quasi-steady") for name in DERIVATIVE_NAMES),
    ("CD_parasite", "1", "drag along the air stream of bluff parts, beyond that in CX_0"),
    ("CY_0", "1", "side force of an asymmetric airframe"),
    ("Cl_0", "1", "rolling moment of an asymmetric airframe"),
    ("Cn_0", "1", "yawing moment of an asymmetric airframe"),
    ("Cl_alpha", "1/rad", "rolling moment of an asymmetric airframe per angle of attack"),
    ("alpha_stall", "rad", "onset of separation, clean, flap up"),
    ("alpha_stall_negative", "rad", "onset of separation at negative angle of attack, positive number"),
    ("alpha_stall_flap", "1", "change of the onset per flap angle"),
    ("stall_width", "rad", "from onset to complete separation"),
    ("Cm_alpha_separated", "1", "share of Cm_alpha left when the wing is separated"),
    ("damping_separated", "1", "share of roll damping and aileron power lost on a separated wing"),
    ("panel_arm", "1", "spanwise station of the outer panels over half span"),
    ("lift_arm", "1", "spanwise centre of pressure of a half wing over span"),
    ("CL_flap", "1/rad", "lift of flap"),
    ("CD_flap", "1/rad", "parasite drag of flap"),
    ("Cm_flap", "1/rad", "moment of flap"),
    ("Cm_alphadot", "1", "part of Cm_q that is downwash lag"),
    ("Cm_alpha_tail", "1/rad", "moment of the tailplane alone per angle of attack at the tail"),
    ("downwash_slope", "1", "downwash angle per angle of attack"),
    ("downwash_flap", "1", "downwash angle per flap angle"),
    ("tail_incidence", "rad", "tailplane incidence, zero-lift downwash included"),
    ("alpha_tail_stall", "rad", "tail angle, negative lift, at which the tailplane separates, positive number"),
    ("tail_stall_width", "rad", "from onset to complete separation of the tailplane"),
    ("tail_stall_elevator_loss", "1", "share of elevator power lost with a separated tailplane"),
    ("CT_reference", "1", "thrust coefficient at which the derivatives were measured"),
    ("Cm_CT", "1", "moment per thrust coefficient beyond the thrust line's"),
    ("CZ_CT", "1", "lift per thrust coefficient (slipstream on the wing)"),
    ("Cm_elevator_CT", "1", "relative gain of elevator power per thrust coefficient"),
    ("induced_drag", "1", "K of CD = CD_0 + K CL^2, for ground effect"),
    ("ground_lift", "1", "relative gain of lift at the ground"),
    ("ground_moment", "1", "moment at the ground (loss of downwash)"),
]

CT_MAX = 1.0  # slipstream terms are frozen beyond it; static running would otherwise divide by zero airspeed


@kernel
def smootherstep(x: float) -> float:
    """0 below 0, 1 above 1, between them t^3 (6 t^2 - 15 t + 10): twice differentiable."""
    t = min(max(x, 0.0), 1.0)
    return t*t*t*(t*(6.0*t - 15.0) + 10.0)


@kernel
def separation(alpha: float, onset: float, c: Any, p: Any) -> float:
    """Separated share, 0..1, of a half wing at its local angle of attack (upright and inverted stall)."""
    return smootherstep(max(alpha - onset, -alpha - p.alpha_stall_negative)*c.per_stall_width)


@kernel
def tail_angle(alpha: float, arrival: float, q: float, slowness: float, x: Any, p: Any) -> float:
    """Angle of attack at the tailplane [rad]: downwash of the past, pitch rate, and the gust that arrives there now."""
    return (alpha + arrival - p.downwash_slope*x.alpha_downwash - p.downwash_flap*x.flap + p.tail_incidence
            + q*p.tail_arm*slowness)


@kernel
def longitudinal(alpha: float, sine: float, cosine: float, qhat: float, left: float, right: float, tail: float,
                 ct: float, low: float, arrival: float, x: Any, c: Any, p: Any) -> tuple:
    """CX, CZ of the left and right half wing (each referred to the whole area), the rest of CX and CZ, and Cm.

    `sine`, `cosine`: of alpha; `left`, `right`, `tail`: separated shares; `ct`: thrust coefficient less its reference;
    `low`: 0 in free air, 1 at the ground (McCormick, Aerodynamics, Aeronautics and Flight Mechanics, 2nd ed., section
    7: induced drag times (16 h/b)^2/(1 + (16 h/b)^2)); `arrival`: gust angle at the tail less that at the wing [rad].
    """
    plate = -sine/(0.283 + 0.222*abs(sine))
    suction = alpha*(c.CX_alpha + c.CX_alpha2*alpha)
    lift_left = (1.0 - left)*(c.CZ_0 + c.CZ_alpha_left*alpha) + left*plate
    lift_right = (1.0 - right)*(c.CZ_0 + c.CZ_alpha_right*alpha) + right*plate
    axial_left = c.CX_0_left + (1.0 - left)*suction
    axial_right = c.CX_0_right + (1.0 - right)*suction
    lift = 0.5*(lift_left + lift_right)
    flap_lift = (1.0 - 0.5*(left + right))*p.CL_flap*x.flap
    flap_drag = p.CD_flap*x.flap + p.induced_drag*flap_lift*(flap_lift - 2.0*lift)
    rest_x = flap_lift*sine - flap_drag*cosine + low*p.induced_drag*lift*lift
    rest_z = -flap_lift*cosine - flap_drag*sine + c.CZ_q*qhat + c.CZ_elevator*x.elevator + p.CZ_CT*ct
    rest_z += low*p.ground_lift*lift
    share = 0.5*(left + right)
    lag = 0.5*p.Cm_alphadot*p.chord*c.per_tail_arm*(alpha - x.alpha_downwash)
    cm = (c.Cm_0 + c.Cm_alpha*((1.0 - share)*alpha + share*p.Cm_alpha_separated*sine)
          + (c.Cm_q - p.Cm_alphadot)*qhat + lag + p.Cm_alpha_tail*arrival
          + c.Cm_elevator*x.elevator*(1.0 + p.Cm_elevator_CT*ct)*(1.0 - p.tail_stall_elevator_loss*tail)
          + p.Cm_flap*x.flap + p.Cm_CT*ct + low*p.ground_moment)
    return axial_left, axial_right, lift_left, lift_right, rest_x, rest_z, cm


@kernel
def lateral(alpha: float, beta: float, phat: float, rhat: float, share: float, x: Any, c: Any, p: Any) -> tuple:
    """CY, Cl and Cn of the symmetric wing; `share` is the mean separated share."""
    loss = 1.0 - p.damping_separated*share
    cy = p.CY_0 + c.CY_beta*beta + c.CY_p*phat + c.CY_r*rhat + c.CY_rudder*x.rudder
    cl = (p.Cl_0 + p.Cl_alpha*alpha + c.Cl_beta*beta + c.Cl_r*rhat + c.Cl_rudder*x.rudder
          + loss*(c.Cl_p*phat + c.Cl_aileron*x.aileron))
    cn = (p.Cn_0 + c.Cn_beta*beta + c.Cn_p*phat + c.Cn_r*rhat
          + c.Cn_aileron*x.aileron + c.Cn_rudder*x.rudder)
    return cy, cl, cn
