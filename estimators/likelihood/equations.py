"""The equations of motion that likelihood methods fly, as rows x' = F x + b and y = H x + d at each sample.

States are the velocity across the flight path and the rates, not the flow angles; that makes them linear:

    w' = q u - p v + g cos(theta) cos(phi) + az     q' = qbar S c Cm/Iyy + coupling    theta' = q cos(phi) - r sin(phi)
    v' = p w - r u + g cos(theta) sin(phi) + ay     Ixx p' - Ixz r', Izz r' - Ixz p'   phi' = p + tan(theta)(...)

with the recorded airspeed, attitude, other axis and thrust as inputs. Flow angles, gravity and the square of alpha are
linearised about what was recorded at each instant, which leaves errors of the order of the noise squared. Sources:
Klein & Morelli, Aircraft System Identification (AIAA 2006), section 3.3 and chapter 6; Etkin & Reid, Dynamics of
Flight, 3rd ed., chapter 4.

The tail meets the downwash that the wing made tail_arm/V earlier: alpha_d' = (alpha - alpha_d) V/tail_arm, and
Cm_alphadot c/(2 tail_arm) (alpha - alpha_d) takes the place of Cm_alphadot c/2V alpha' (Etkin & Reid, section 5.5).

A gust w_g (v_g) moves the flow angle: alpha = atan((w - w_g)/u). It is that of MIL-F-8785C in two states, and the tail
meets it tail_arm/V later, by the first-order Pade form with one state more (see icing_env.turbulence); the lift slope
of the tail follows from its damping, (Cm_q - Cm_alphadot) c/(2 tail_arm) (Etkin & Reid, eq. 5.4,10).

Free of gusts the flow angle has a slope, and a vane with a lag reads alpha - lag alpha'. A gust has none, so that with
gusts the vane has a state behind VANE_LAG and what the lag differs from that is taken off along its slope.

What the instruments add is estimated with the rest: a scale error and a lag of the flow vane (a bent boom reads as a
scale error), constant errors of a gyro, of attitude and of an accelerometer, and a shift in time of the attitude.
"""

from __future__ import annotations

import math
from typing import Any

from icing_env.jit import kernel

LONGITUDINAL_NAMES = (
    "CZ_0", "CZ_alpha", "CZ_q", "CZ_elevator", "Cm_0", "Cm_alpha", "Cm_q", "Cm_elevator",
    "CX_0", "CX_alpha", "CX_alpha2", "alpha_scale", "alpha_lag", "theta_lag", "bias_q", "bias_az", "bias_theta",
    "Cm_alphadot", "tail_lift", "gust_lag",
)  # fmt: skip
LATERAL_NAMES = (
    "CY_0", "CY_beta", "CY_p", "CY_r", "CY_rudder", "Cl_0", "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder",
    "Cn_0", "Cn_beta", "Cn_p", "Cn_r", "Cn_aileron", "Cn_rudder",
    "beta_scale", "beta_lag", "phi_lag", "bias_p", "bias_r", "bias_ay", "bias_phi",
    "gust_lag",
)  # fmt: skip
LONGITUDINAL_OUTPUTS = ("alpha", "q", "theta", "az", "ax")
LATERAL_OUTPUTS = ("beta", "p", "r", "phi", "ay")
LONGITUDINAL_STATES, LATERAL_STATES = 4, 4
STATES, FIRST_GUST, VANE, OUTPUTS = 8, 4, 7, 5  # with the gust's; the first of those; the vane; what is measured
VANE_LAG = 0.02  # s: of the vane's own state, about which its lag is linear (assumed)
TAIL_CHORDS = 3.8  # tail arm over chord: 7.54 m / 1.98 m of the Twin Otter (configs/aircraft/twin_otter.toml)
# Columns of the rows of data that the equations need; see inputs.py.
ROW_LONGITUDINAL = (
    "u", "per_u", "angle", "slope", "force", "moment", "hat", "elevator", "gravity", "gravity_slope", "coupling",
    "cross_force", "cos_phi", "cross_rate", "thrust", "alpha", "gust_rate", "delay_rate",
)  # fmt: skip
ROW_LATERAL = (
    "u", "w", "angle", "slope", "force", "moment", "hat", "aileron", "rudder", "gravity", "gravity_slope",
    "roll_pq", "roll_qr", "yaw_qr", "yaw_pq", "kinematic", "kinematic_r", "beta", "gust_rate", "delay_rate",
)  # fmt: skip
_SQRT3, _SQRT_HALF = math.sqrt(3.0), math.sqrt(0.5)
GUST_1, GUST_2 = _SQRT_HALF * _SQRT3, _SQRT_HALF * (1.0 - _SQRT3)  # gust = GUST_1 x1 + GUST_2 x2


@kernel
def clear(F: Any, b: Any, H: Any, d: Any, n: int) -> None:
    """Zeros in the first n states."""
    for i in range(n):
        b[i] = 0.0
        for j in range(n):
            F[i, j] = 0.0
    for i in range(OUTPUTS):
        d[i] = 0.0
        for j in range(n):
            H[i, j] = 0.0


@kernel
def gust_states(F: Any, first: int, rate: float) -> None:
    """Dryden's pair of states, each behind the time 1/rate."""
    F[first, first] = -rate
    F[first + 1, first] = rate
    F[first + 1, first + 1] = -rate


@kernel
def flow_angle(
    F: Any, b: Any, H: Any, d: Any, angle: float, slope: float, scale: float, lag: float, gust_lag: float, gust: bool
) -> None:
    """The vane's reading as output 0: angle + slope x velocity, later by `lag` (s) and too large by `scale`.

    `gust_lag`: the same for the share of a gust, which a vane on a boom meets before the wing.
    """
    gain = 1.0 + scale
    late = lag - gust_lag if gust else lag
    for j in range(LONGITUDINAL_STATES):
        H[0, j] = -gain * late * slope * F[0, j]
    d[0] = -gain * late * slope * b[0]
    if gust:  # the row of the vane's state is 1/VANE_LAG times the flow angle; its gust is there already
        F[VANE, 0], F[VANE, VANE], b[VANE] = slope / VANE_LAG, -1.0 / VANE_LAG, angle / VANE_LAG
        for j in range(STATES):
            H[0, j] -= gain * (gust_lag - VANE_LAG) * F[VANE, j]
        H[0, VANE] += gain
        d[0] -= gain * (gust_lag - VANE_LAG) * b[VANE]
    else:
        H[0, 0] += gain * slope
        d[0] += gain * angle


@kernel
def longitudinal(t: Any, x: Any, F: Any, b: Any, H: Any, d: Any, gust: bool) -> None:
    """Rows for (w, q, theta, alpha_d[, x1, x2, delay]) -> (alpha, q, theta, az, ax).

    Args:
        t: parameters, LONGITUDINAL_NAMES.
        x: one row of data, ROW_LONGITUDINAL.
        F, b, H, d: written; F (n, n), H (5, n) with n = STATES if `gust`, else LONGITUDINAL_STATES.
    """
    n = STATES if gust else LONGITUDINAL_STATES
    clear(F, b, H, d, n)
    u, per_u, angle, slope, force, moment, hat = x[0], x[1], x[2], x[3], x[4], x[5], x[6]
    az_w, az_q, az_c = force * t[1] * slope, force * t[2] * hat, force * (t[0] + t[1] * angle + t[3] * x[7])
    late = t[17] / (2.0 * TAIL_CHORDS)
    F[0, 0], F[0, 1], F[0, 2], b[0] = az_w, az_q + u, x[9], az_c + x[8] + x[11]
    F[1, 0], F[1, 1], F[1, 3] = moment * (t[5] + late) * slope, moment * (t[6] - t[17]) * hat, -moment * late
    b[1] = moment * (t[4] + (t[5] + late) * angle + t[7] * x[7]) + x[10]
    F[2, 1], b[2] = x[12], x[13]
    F[3, 0], F[3, 3], b[3] = 0.5 * x[17] * slope, -0.5 * x[17], 0.5 * x[17] * angle
    cx = force * (t[9] + 2.0 * t[10] * x[15])
    if gust:
        arrival = 2.0 * per_u * moment * t[18] * (t[6] - t[17]) / (2.0 * TAIL_CHORDS)
        for j in range(2):
            share = GUST_1 if j == 0 else GUST_2
            F[0, 4 + j], F[3, 4 + j] = -az_w * share, -F[3, 0] * share
            F[1, 4 + j] = (arrival - F[1, 0]) * share
            F[6, 4 + j] = x[17] * share
            F[VANE, 4 + j] = -slope * share / VANE_LAG
            H[3, 4 + j], H[4, 4 + j] = -az_w * share, -cx * slope * share
        F[1, 6], F[6, 6] = -arrival, -x[17]
        gust_states(F, 4, x[16])
    flow_angle(F, b, H, d, angle, slope, t[11], t[12], t[19], gust)
    H[1, 1], d[1] = 1.0, t[14]
    H[2, 2], H[2, 1], d[2] = 1.0, -t[13] * x[12], t[16] - t[13] * x[13]
    H[3, 0], H[3, 1], d[3] = az_w, az_q, az_c + t[15]
    H[4, 0] = cx * slope
    d[4] = x[14] + force * (t[8] + t[9] * angle + t[10] * (2.0 * x[15] * angle - x[15] * x[15]))


@kernel
def lateral(t: Any, x: Any, inverse: Any, F: Any, b: Any, H: Any, d: Any, gust: bool) -> None:
    """Rows for (v, p, r, phi[, x1, x2]) -> (beta, p, r, phi, ay); `inverse`: of [[Ixx, -Ixz], [-Ixz, Izz]] (2, 2)."""
    n = STATES if gust else LATERAL_STATES
    clear(F, b, H, d, n)
    angle, slope, force, moment, hat = x[2], x[3], x[4], x[5], x[6]
    ay_v, ay_p, ay_r = force * t[1] * slope, force * t[2] * hat, force * t[3] * hat
    ay_c = force * (t[0] + t[1] * angle + t[4] * x[8])
    F[0, 0], F[0, 1], F[0, 2], F[0, 3], b[0] = ay_v, ay_p + x[1], ay_r - x[0], x[10], ay_c + x[9]
    roll_v, roll_p, roll_r = moment * t[6] * slope, moment * t[7] * hat + x[11], moment * t[8] * hat + x[12]
    roll_c = moment * (t[5] + t[6] * angle + t[9] * x[7] + t[10] * x[8])
    yaw_v, yaw_p, yaw_r = moment * t[12] * slope, moment * t[13] * hat + x[14], moment * t[14] * hat + x[13]
    yaw_c = moment * (t[11] + t[12] * angle + t[15] * x[7] + t[16] * x[8])
    for i in range(2):
        on_roll, on_yaw = inverse[i, 0], inverse[i, 1]
        F[1 + i, 0] = on_roll * roll_v + on_yaw * yaw_v
        F[1 + i, 1] = on_roll * roll_p + on_yaw * yaw_p
        F[1 + i, 2] = on_roll * roll_r + on_yaw * yaw_r
        b[1 + i] = on_roll * roll_c + on_yaw * yaw_c
    F[3, 1], F[3, 2], b[3] = 1.0, x[16], x[15]
    if gust:
        for j in range(2):
            share = GUST_1 if j == 0 else GUST_2
            for i in range(3):
                moved = ay_v if i == 0 else F[i, 0]
                F[i, 4 + j] = -moved * share
            F[VANE, 4 + j] = -slope * share / VANE_LAG
            H[4, 4 + j] = -ay_v * share
        gust_states(F, 4, x[18])
    flow_angle(F, b, H, d, angle, slope, t[17], t[18], t[24], gust)
    for j in range(n):
        H[3, j] = -t[19] * F[3, j]
    H[1, 1], d[1] = 1.0, t[20]
    H[2, 2], d[2] = 1.0, t[21]
    H[3, 3] += 1.0
    d[3] = t[23] - t[19] * b[3]
    H[4, 0], H[4, 1], H[4, 2], d[4] = ay_v, ay_p, ay_r, ay_c + t[22]
