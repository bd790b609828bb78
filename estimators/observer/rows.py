"""The rows of every recursive identifier: what each channel's derivative is, linear in that channel's coefficients.

Standard rigid-body equations (Klein and Morelli, Aircraft System Identification, chapter 3), Ixz = + int x z dm.
Everything that is not an estimated coefficient is formed from measured quantities and goes into b.
They leave, in the order of PARAMETER_NAMES, the regressors a of the six state equations in row["row"], the rest b in
row["rest"] and the states as measured in row["y"]; for drag, lift and side force also row["felt"], what the
accelerometer says of the same a'theta, and row["factor"], by which it must be multiplied to be an acceleration.
"""

from __future__ import annotations

import math
from typing import Any

from icing_env.jit import kernel

GRAVITY = 9.80665  # m/s2, standard
GAS_CONSTANT = 287.05287  # J/(kg K), 1976 standard atmosphere


@kernel
def clean_zero_lift_drag(af: Any) -> float:
    """Drag coefficient of the clean aircraft at zero lift: CL = 0 and CX there give CD = -CX/cos(alpha_0)."""
    alpha = af["CZ_0"] / (af["CX_0"] - af["CZ_alpha"])
    return float(-(af["CX_0"] + alpha * (af["CX_alpha"] + alpha * af["CX_alpha2"])) / math.cos(alpha))


@kernel
def incidence(m: Any, lag: float, bending: float, dt: float) -> tuple[float, float]:
    """Angles of attack and sideslip, corrected for the boom's bending (steady part) and the vanes' lag.

    alpha - bending (a_z + g) + delay alphadot, and beta + delay betadot. A first-order lag that takes in the newest
    value once a sample delays by dt/(exp(dt/lag) - 1). The rates are kinematic, from gyros, accelerometers and
    attitude; a gust's own rate stays lagged.
    """
    alpha, beta, v = m["alpha"] - bending * (m["az"] + GRAVITY), m["beta"], m["airspeed"]
    if lag <= 0.0:
        return alpha, beta
    delay = dt / math.expm1(dt / lag)
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    st, ct = math.sin(m["theta"]), math.cos(m["theta"])
    fx, fy = m["ax"] - GRAVITY * st, m["ay"] + GRAVITY * ct * math.sin(m["phi"])
    fz = m["az"] + GRAVITY * ct * math.cos(m["phi"])
    alpha_dot = m["q"] - sb / cb * (m["p"] * ca + m["r"] * sa) + (fz * ca - fx * sa) / (v * cb)
    beta_dot = m["p"] * sa - m["r"] * ca + (fy * cb - sb * (fx * ca + fz * sa)) / v
    return alpha + delay * alpha_dot, beta + delay * beta_dot


@kernel
def flap_forces(flap: float, alpha: float, af: Any) -> tuple[float, float]:
    """Lift and drag coefficient that a flap angle adds to the clean aircraft (docs/model.md): known, not estimated."""
    lift = af["CL_flap"] * flap
    wing = -(af["CZ_0"] + af["CZ_alpha"] * alpha)
    return lift, af["CD_flap"] * flap + af["induced_drag"] * lift * (lift + 2.0 * wing)


@kernel
def force_rows(ob: Any, m: Any, af: Any, v: float, alpha: float, beta: float, p: float, q: float, r: float) -> float:
    """Drag, lift and side force: states airspeed, alpha, beta; accelerometers x, z, y. Returns qbar (Pa).

    The states are given (measured, or estimated); attitude, controls, thrust and accelerations are those of `m`.

    Drag:  a_x = k (CX_clean(alpha) - (CD_0 - CD_0,clean) cos alpha) + T/m, k = qbar S/m. Lift-dependent drag keeps the
    clean shape along body x, so that CD_0 is the drag at zero lift with thrust removed.
    Lift:  k CL = (a_x - T/m) sin alpha - a_z cos alpha.
    CL = CL_0 + CL_alpha alpha + CL_q q^ + CL_elevator elevator.
    The flap's clean lift, drag and moment are taken out as known.
    Side:  a_y = k (CY_0 + CY_beta beta + CY_p p^ + CY_r r^ + CY_rudder rudder).
    """
    row, rest = ob["row"], ob["rest"]
    ca, sa, cb, sb = math.cos(alpha), math.sin(alpha), math.cos(beta), math.sin(beta)
    st, ct, sp, cp = math.sin(m["theta"]), math.cos(m["theta"]), math.sin(m["phi"]), math.cos(m["phi"])
    qbar = 0.5 * m["pressure"] / (GAS_CONSTANT * m["temperature"]) * v * v
    k = qbar * af["wing_area"] / af["mass"]
    thrust = (m["thrust_left"] + m["thrust_right"]) / af["mass"]
    half_span, half_chord = 0.5 * af["span"] / v, 0.5 * af["chord"] / v

    flap_lift, flap_drag = flap_forces(m["flap"], alpha, af)
    cx = af["CX_0"] + alpha * (af["CX_alpha"] + alpha * af["CX_alpha2"]) + flap_lift * sa - flap_drag * ca
    known = k * (cx + clean_zero_lift_drag(af) * ca) + thrust
    row[0] = -k * ca * ca * cb
    rest[0] = (
        ca * cb * known + sb * m["ay"] + sa * cb * m["az"] + GRAVITY * (sb * sp * ct + sa * cb * cp * ct - ca * cb * st)
    )
    ob["felt"][0], ob["factor"][0] = (m["ax"] - known) * ca * cb, 1.0 / (ca * cb)

    lift = -k / (v * cb)
    row[1], row[2], row[3], row[4] = lift, lift * alpha, lift * half_chord * q, lift * m["elevator"]
    rest[1] = q - sb / cb * (p * ca + r * sa) + (GRAVITY * (sa * st + ca * cp * ct) - thrust * sa) / (v * cb)
    rest[1] += lift * flap_lift
    ob["felt"][1] = (m["az"] * ca - (m["ax"] - thrust) * sa) / (v * cb) - lift * flap_lift
    ob["factor"][1] = v * cb

    side = k * cb / v
    row[9], row[10], row[11] = side, side * beta, side * half_span * p
    row[12], row[13] = side * half_span * r, side * m["rudder"]
    rest[3] = (
        p * sa
        - r * ca
        + (-sb * (m["ax"] * ca + m["az"] * sa) + GRAVITY * (ca * sb * st + cb * sp * ct - sa * sb * cp * ct)) / v
    )
    ob["felt"][2], ob["factor"][2] = m["ay"] * cb / v, v / cb
    ob["y"][0], ob["y"][1], ob["y"][3] = v, alpha, beta
    return float(qbar)


@kernel
def moment_rows(
    ob: Any, m: Any, af: Any, qbar: float, v: float, alpha: float, beta: float, p: float, q: float, r: float
) -> None:
    """Pitch, roll and yaw, at the same states as `force_rows`.

    The states p - (Ixz/Ixx) r and r - (Ixz/Izz) p leave one moment in each equation:
    Iyy qdot = qbar S c Cm + (Izz - Ixx) p r + Ixz (r^2 - p^2);
    Ixx pdot - Ixz rdot = qbar S b Cl + Ixz p q - (Izz - Iyy) q r;
    Izz rdot - Ixz pdot = qbar S b Cn - Ixz q r - (Iyy - Ixx) p q.
    A moment of thrust about the c.g. is not known to the observer and counts as Cm_0 or Cn_0.
    """
    row, rest = ob["row"], ob["rest"]
    xx, yy, zz, xz = af["inertia_xx"], af["inertia_yy"], af["inertia_zz"], af["inertia_xz"]
    half_span, force = 0.5 * af["span"] / v, qbar * af["wing_area"]

    pitch = force * af["chord"] / yy
    row[5], row[6] = pitch, pitch * alpha
    row[7], row[8] = pitch * 0.5 * af["chord"] / v * q, pitch * m["elevator"]
    rest[2] = ((zz - xx) * p * r + xz * (r * r - p * p)) / yy + pitch * af["Cm_flap"] * m["flap"]
    for channel, inertia in ((14, xx), (20, zz)):
        moment = force * af["span"] / inertia
        row[channel], row[channel + 1] = moment, moment * beta
        row[channel + 2], row[channel + 3] = moment * half_span * p, moment * half_span * r
        row[channel + 4], row[channel + 5] = moment * m["aileron"], moment * m["rudder"]
    rest[4] = (xz * p * q - (zz - yy) * q * r) / xx
    rest[5] = (-xz * q * r - (yy - xx) * p * q) / zz
    ob["y"][2], ob["y"][4], ob["y"][5] = q, p - xz / xx * r, r - xz / zz * p


@kernel
def readable(m: Any) -> bool:
    """True if every channel the rows need is finite and the air data are physical."""
    total = (
        m["alpha"] + m["beta"] + m["p"] + m["q"] + m["r"] + m["phi"] + m["theta"] + m["ax"] + m["ay"] + m["az"]
        + m["elevator"] + m["aileron"] + m["rudder"] + m["thrust_left"] + m["thrust_right"]
        + m["airspeed"] + m["pressure"] + m["temperature"] + m["flap"]
    )  # fmt: skip
    return math.isfinite(total) and m["airspeed"] > 5.0 and m["pressure"] > 0.0 and m["temperature"] > 0.0
