"""What no derivative of the model expresses: terms that a description of something unknown may set, all 0 otherwise.

Terms of a regression on residual coefficients (Klein & Morelli, Aircraft System Identification, AIAA 2006, section
5.4): powers and products in an axis, across axes, with thrust, with airspeed, attitude and the rates of the flow's
angles, and growth with time. The effect `discrepancy` sets them (`icing_env.effects.discrepancy`). Files of aircraft
leave them out.
"""

from __future__ import annotations

from typing import Any

from icing_env.jit import kernel
from icing_env.types import Field

AXES = ("CX", "CY", "CZ", "Cl", "Cm", "Cn")
SURFACES = ("elevator", "aileron", "rudder")
FLOW = {"elevator": "alpha", "aileron": "p", "rudder": "beta"}  # the load that may push a surface
EASED = 0.02  # rad, over which a surface changes side (assumed)
# Of each surface, beside its gearing and offset, where its actuator takes it.
PATH_PARAMETERS: list[Field] = [
    *((f"{surface}_{bend}", unit, f"position of the {surface} with {what}") for surface in SURFACES
      for bend, unit, what in (
          ("cube", "1/rad2", "the cube of its command"), ("side", "rad", "the side its command is on"),
          ("magnitude", "1", "how far its command is to either side"),
          ("direction", "rad", "the way it moves; negative: it stays behind by so much, positive: nothing"),
          ("of_airspeed", "rad s/m", "true airspeed"))),
    *((f"{surface}_of_{of}", unit, f"position of the {surface} with {of}") for surface in SURFACES
      for of, unit in ((FLOW[surface], "s" if FLOW[surface] == "p" else "1"),
                       *((other, "1") for other in SURFACES if other != surface))),
]
DISCREPANCY_PARAMETERS: list[Field] = [
    ("CX_elevator", "1/rad", "axial force per elevator"),
    *((f"{c}_airspeed", "s/m", f"{c} per true airspeed") for c in AXES),
    *((f"{c}_airspeed2", "s2/m2", f"{c} per square of true airspeed") for c in ("Cl", "Cm", "Cn")),
    *((f"{c}_alpha2", "1/rad2", f"{c} per square of the angle of attack") for c in ("CZ", "Cm")),
    *((f"{c}_beta2", "1/rad2", f"{c} per square of the sideslip") for c in ("CX", "CZ", "Cm")),
    ("CX_rudder2", "1/rad2", "CX per square of the rudder"),
    ("Cm_elevator2", "1/rad2", "Cm per square of the elevator"),
    *((f"{c}_{of}3", "1/rad3", f"{c} per cube of {what}") for what, of, coefficients in (
        ("the angle of attack", "alpha", ("CZ", "Cm")), ("the elevator", "elevator", ("Cm",)),
        ("q c/2V", "q", ("Cm",)), ("the sideslip", "beta", ("CY", "Cl", "Cn")), ("p b/2V", "p", ("Cl",)),
        ("r b/2V", "r", ("Cn",)), ("the ailerons", "aileron", ("Cl",)), ("the rudder", "rudder", ("Cn",)))
      for c in coefficients),
    *((f"{c}_alpha_{of}", "1/rad2", f"{c} per angle of attack times {what}") for c, factors in (
        ("CY", ("beta", "p", "rudder")), ("CZ", ("q",)), ("Cl", ("beta", "p", "r")), ("Cm", ("elevator", "q")),
        ("Cn", ("beta", "p", "r", "aileron", "rudder"))) for of in factors
      for what in ({"beta": "sideslip", "p": "p b/2V", "q": "q c/2V", "r": "r b/2V"}.get(of, of),)),
    *((f"{c}_{of}", "1/rad", f"{c} per {what}") for c, of, what in (
        ("CY", "aileron", "aileron"), ("Cl", "q", "q c/2V"), ("Cm", "aileron", "aileron"), ("Cm", "p", "p b/2V"),
        ("Cm", "r", "r b/2V"), ("Cn", "alpha", "angle of attack"), ("Cn", "q", "q c/2V"))),
    *((f"{c}_{of}_airspeed", "s/(m rad)", f"{c} per {of} times true airspeed") for c, of in (
        ("Cl", "aileron"), ("Cm", "elevator"), ("Cn", "rudder"))),
    *((f"{c}_CT", "1", f"{c} per thrust coefficient") for c in ("Cl", "Cn")),
    *((f"{c}_alpha_CT", "1/rad", f"{c} per angle of attack times thrust coefficient") for c in ("CZ", "Cm", "Cn")),
    *((f"{c}_beta_CT", "1/rad", f"{c} per sideslip times thrust coefficient") for c in ("CY", "Cl", "Cn")),
    ("CZ_alphadot", "1/rad", "CZ per alphadot c/2V, as late as the downwash"),
    *((f"{c}_betadot", "1/rad", f"{c} per betadot b/2V") for c in ("CY", "Cl", "Cn")),
    ("Cl_phi", "1", "Cl per sin(phi) cos(theta)"),
    ("Cm_theta", "1", "Cm per sin(theta)"),
    *((f"{c}_time", "1/s", f"growth of {c} since the start") for c in AXES),
    ("CD_alpha2", "1/rad2", "drag along the air stream per square of sin(alpha)"),
    ("density_lapse", "1/m", "growth of the density factor with altitude"),
    *PATH_PARAMETERS,
]

# What says how a derivative changes with angles, rates, thrust and speed: a factor of it is a factor of them.
CHANGES_OF: dict[str, tuple[str, ...]] = {
    "CZ_alpha": ("CZ_alpha2", "CZ_alpha3", "CZ_alpha_CT"), "CY_beta": ("CY_alpha_beta", "CY_beta3", "CY_beta_CT"),
    "Cl_beta": ("Cl_alpha_beta", "Cl_beta3", "Cl_beta_CT"), "Cn_beta": ("Cn_alpha_beta", "Cn_beta3", "Cn_beta_CT"),
    "Cm_alpha": ("Cm_alpha2", "Cm_alpha3", "Cm_alpha_CT"), "Cm_q": ("Cm_alpha_q", "Cm_q3"),
    "Cm_elevator": ("Cm_elevator2", "Cm_elevator3", "Cm_alpha_elevator", "Cm_elevator_airspeed"),
    "Cl_p": ("Cl_alpha_p", "Cl_p3"), "Cl_aileron": ("Cl_aileron3", "Cl_aileron_airspeed"),
    "Cn_rudder": ("Cn_alpha_rudder", "Cn_rudder3", "Cn_rudder_airspeed"),
}


def bends(surface: str) -> tuple[str, ...]:
    """Names of PATH_PARAMETERS of a surface."""
    return tuple(name for name, _, _ in PATH_PARAMETERS if name.startswith(f"{surface}_"))


@kernel
def discrepancy(alpha: float, beta: float, rates: tuple, airspeed: float, ct: float, side: float, slowness: float,
                x: Any, c: Any, p: Any) -> tuple:
    """CX, CY, CZ, Cl, Cm, Cn that a description of something unknown adds; exactly 0 with its numbers neutral.

    Args:
        alpha, beta: rad. rates: phat, qhat, rhat. airspeed: m/s.
        ct: thrust coefficient less its reference.
        side: side force without these terms, N, which the rate of the sideslip follows from.
        slowness: 1/airspeed, s/m.
    """
    phat, qhat, rhat = rates
    along = own_axis(alpha, beta, phat, qhat, rhat, airspeed, x, c, p)
    gravity_y = 2.0*(x.e2*x.e3 + x.e0*x.e1)
    alphadot = 0.5*p.chord*c.per_tail_arm*(alpha - x.alpha_downwash)
    turning = 0.5*p.span*slowness*slowness*(side*c.per_mass + gravity_y*p.gravity_sea_level)
    betadot = turning + phat*alpha - rhat
    more = across(alpha, beta, phat, qhat, rhat, airspeed, ct, alphadot, betadot, gravity_y, x, p)
    return (along[0] + more[0], along[1] + more[1], along[2] + more[2], along[3] + more[3], along[4] + more[4],
            along[5] + more[5])


@kernel
def own_axis(alpha: float, beta: float, phat: float, qhat: float, rhat: float, airspeed: float, x: Any, c: Any,
             p: Any) -> tuple:
    """Terms of what the axis knows anyway, of airspeed and of time; `c.elapsed`: s since the start."""
    t, V, e, aileron, rudder = c.elapsed, airspeed, x.elevator, x.aileron, x.rudder
    cx = p.CX_elevator*e + p.CX_airspeed*V + p.CX_time*t
    cy = beta*(p.CY_alpha_beta*alpha + p.CY_beta3*beta*beta) + p.CY_airspeed*V + p.CY_time*t
    cz = alpha*alpha*(p.CZ_alpha2 + p.CZ_alpha3*alpha) + p.CZ_airspeed*V + p.CZ_time*t
    cl = beta*(p.Cl_alpha_beta*alpha + p.Cl_beta3*beta*beta) + p.Cl_p3*phat*phat*phat
    cl += p.Cl_aileron3*aileron*aileron*aileron + V*(p.Cl_airspeed + p.Cl_airspeed2*V) + p.Cl_time*t
    cm = alpha*(alpha*(p.Cm_alpha2 + p.Cm_alpha3*alpha) + p.Cm_alpha_elevator*e) + p.Cm_q3*qhat*qhat*qhat
    cm += e*e*(p.Cm_elevator2 + p.Cm_elevator3*e) + V*(p.Cm_airspeed + p.Cm_airspeed2*V) + p.Cm_time*t
    cn = beta*(p.Cn_alpha_beta*alpha + p.Cn_beta3*beta*beta) + p.Cn_r3*rhat*rhat*rhat
    cn += p.Cn_rudder3*rudder*rudder*rudder + V*(p.Cn_airspeed + p.Cn_airspeed2*V) + p.Cn_time*t
    return cx, cy, cz, cl, cm, cn


@kernel
def across(alpha: float, beta: float, phat: float, qhat: float, rhat: float, airspeed: float, ct: float,
           alphadot: float, betadot: float, bank: float, x: Any, p: Any) -> tuple:
    """Terms across axes, with thrust, with the rates of the flow's angles (normalised) and with attitude.

    `bank`: sin(phi) cos(theta).
    """
    aileron, rudder, beta2 = x.aileron, x.rudder, beta*beta
    cx = p.CX_beta2*beta2 + p.CX_rudder2*rudder*rudder
    cy = p.CY_aileron*aileron + alpha*(p.CY_alpha_p*phat + p.CY_alpha_rudder*rudder)
    cy += p.CY_beta_CT*beta*ct + p.CY_betadot*betadot
    cz = p.CZ_beta2*beta2 + alpha*(p.CZ_alpha_q*qhat + p.CZ_alpha_CT*ct) + p.CZ_alphadot*alphadot
    cl = p.Cl_q*qhat + alpha*(p.Cl_alpha_p*phat + p.Cl_alpha_r*rhat) + p.Cl_aileron_airspeed*aileron*airspeed
    cl += ct*(p.Cl_CT + p.Cl_beta_CT*beta) + p.Cl_betadot*betadot + p.Cl_phi*bank
    cm = p.Cm_beta2*beta2 + p.Cm_elevator_airspeed*x.elevator*airspeed + p.Cm_aileron*aileron + p.Cm_p*phat
    cm += p.Cm_r*rhat + alpha*(p.Cm_alpha_q*qhat + p.Cm_alpha_CT*ct) - p.Cm_theta*2.0*(x.e1*x.e3 - x.e0*x.e2)
    cn = p.Cn_alpha*alpha + p.Cn_q*qhat + alpha*(p.Cn_alpha_p*phat + p.Cn_alpha_r*rhat)
    cn += alpha*(p.Cn_alpha_aileron*aileron + p.Cn_alpha_rudder*rudder) + p.Cn_rudder_airspeed*rudder*airspeed
    cn += ct*(p.Cn_CT + p.Cn_alpha_CT*alpha + p.Cn_beta_CT*beta) + p.Cn_betadot*betadot
    return cx, cy, cz, cl, cm, cn


@kernel
def side_of(x: float) -> float:
    """-1 or 1, in between within EASED of 0."""
    return min(max(x*(1.0/EASED), -1.0), 1.0)


@kernel
def bent(asked: float, position: float, cube: float, side: float, magnitude: float, direction: float,
         pushed: float) -> float:
    """Where a surface is told to go [rad] that is asked to be somewhere; exactly there with all else 0.

    Friction holds a surface that is less than `-direction` from where it is told to be, and keeps it as far behind.
    `pushed`: by airspeed, the air's load and the other surfaces, rad.
    """
    told = asked + cube*asked*asked*asked + side*side_of(asked) + magnitude*abs(asked) + pushed
    band = max(-direction, 0.0)
    return told - min(max(told - position, -band), band)
