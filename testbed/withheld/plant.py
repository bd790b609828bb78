"""The aircraft again, from docs/model.md for flaps-up flight in free air, and Bogacki and Shampine's integrator.

Euler angles instead of a quaternion, the third-order Runge-Kutta method of Bogacki & Shampine (Appl. Math. Lett. 2(4),
1989) at 5 ms, gusts that change within a sample. Numbers with a knob are neutral at 0 (`published.py`). Left out, since
they do not act here: flap, ground, hinge-moment float below its limits, ice. SI and radians.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from testbed.withheld.described import described

# positions in the state vector
H, U, V, W, PHI, THETA, PSI, P, Q, R, DE, DA, DR, PL, PR, ADW = range(16)
DE1, DA1, DR1, ADW2, PL2, PR2, SLOSH, SLOSH1, PLAY, BLAG, ALAG = range(16, 27)
STATES = 27
# outputs beside the state
VT, ALPHA, BETA, FX, FY, FZ, TL, TR, ADOT = range(9)
OUTPUTS = 9
DT, SUB = 0.02, 4  # s between samples, integration steps in one


@njit(cache=True)
def air(h: float, p: Any) -> tuple[float, float, float]:
    """Density, share of rated power, gravity: US Standard Atmosphere 1976 below 11 km, docs/model.md 4 and 12."""
    geopotential = 6356766.0 * h / (6356766.0 + h)
    T = 288.15 - 0.0065 * geopotential
    pressure = 101325.0 * (T / 288.15) ** (9.80665 / (287.05287 * 0.0065))
    factor = p.density_factor * (1.0 + p.density_lapse * (1.0 + (h - p.altitude_start) / 300.0))
    loss = 1.0 - pressure / 101325.0
    power = 1.0 - loss * (p.power_lapse + p.power_lapse2 * loss)
    gravity = p.gravity_sea_level * (p.earth_radius / (p.earth_radius + h)) ** 2
    return factor * pressure / (287.05287 * T), power, gravity


@njit(cache=True)
def smooth(y: float) -> float:
    """Quintic step from 0 to 1, docs/model.md 6."""
    t = min(max(y, 0.0), 1.0)
    return t * t * t * (10.0 + t * (6.0 * t - 15.0))


@njit(cache=True)
def surface(x: float, x1: float, target: float, low: float, high: float, lag: float, limit: float, frequency: float,
            soft: float) -> tuple[float, float]:
    """Rates of a surface and of its own rate: first order, first order with a soft limit, or second order."""
    target = min(max(target, low), high)
    if frequency > 0.0:
        return min(max(x1, -limit), limit), frequency * frequency * (target - x) - 1.4 * frequency * x1
    wanted = (target - x) / lag
    if soft > 0.0:
        return limit * math.tanh(wanted / limit), 0.0
    return min(max(wanted, -limit), limit), 0.0


@njit(cache=True)
def bounded(gain: float, x: float, reach: float) -> float:
    """`gain * x` at small x, saturating beyond `reach`."""
    return gain * reach * math.tanh(x / reach)


@njit(cache=True)
def wind(y: Any, p: Any, t: float) -> tuple[float, float, float]:
    """Steady wind along the body's axes at state `y` and time t, m/s."""
    sph, cph, sth, cth = math.sin(y[PHI]), math.cos(y[PHI]), math.sin(y[THETA]), math.cos(y[THETA])
    sps, cps = math.sin(y[PSI]), math.cos(y[PSI])
    above = y[H] - p.altitude_start
    north = p.shear * above + p.shear_bounded * 60.0 * math.tanh(above / 60.0) + p.front * math.tanh((t - 20.0) / 3.0)
    down = -p.wind_up - p.wind_wave * math.sin(2.0 * math.pi * t / 50.0)
    down -= p.thermal * math.exp(-((t - 20.0) / 5.0) ** 2)
    east = p.side_wind_wave * math.sin(2.0 * math.pi * t / 12.0)
    return (north * cth * cps + east * cth * sps - down * sth,
            north * (sph * sth * cps - cph * sps) + east * (sph * sth * sps + cph * cps) + down * sph * cth,
            north * (cph * sth * cps + sph * sps) + east * (cph * sth * sps - sph * cps) + down * cph * cth)


@njit(cache=True)
def rates(y: Any, p: Any, u: Any, g: Any, t: float, d: Any, o: Any) -> None:
    """Rates `d` of state `y` and outputs `o` under commands `u` and gusts `g` (u, v, w, w at the tail) at time t."""
    density, lapse, gravity = air(y[H], p)
    sph, cph, sth, cth = math.sin(y[PHI]), math.cos(y[PHI]), math.sin(y[THETA]), math.cos(y[THETA])
    uw, vw, ww = wind(y, p, t)
    ua, va, wa = y[U] - uw - g[0], y[V] - vw - g[1], y[W] - ww - g[2]
    plane = math.sqrt(ua * ua + wa * wa)
    V_ = math.sqrt(plane * plane + va * va)
    a, b = math.atan2(wa, ua), math.atan2(va, plane)
    sa, ca = wa / plane, ua / plane
    qS = 0.5 * density * V_ * V_ * p.wing_area
    ph, qh, rh = (y[P] * p.span / (2.0 * V_), y[Q] * p.chord / (2.0 * V_), y[R] * p.span / (2.0 * V_))
    fast = V_ / 72.0
    mass = p.mass * (1.0 - (p.load_dropped if t > 20.0 else 0.0))

    # engines
    per = p.propeller_efficiency / math.sqrt(ua * ua + p.propeller_static_speed**2) * (1.0 + p.thrust_at_72 * fast**2)
    tl = p.thrust_factor_left * y[PL] * per * (1.0 + p.left_of_alpha * (a - 0.03))
    tr = p.thrust_factor_right * y[PR] * per * (1.0 + p.thrust_right_at_72 * fast**2)
    thrust = tl + tr
    ct = min(thrust / qS, 1.0) - p.CT_reference

    # surfaces as the air meets them
    de = y[PLAY] if p.elevator_play > 0.0 else y[DE]
    de = de / (1.0 + p.blowback * fast**2)
    da, dr = y[DA], y[DR]

    # half wings
    al, ar = a - p.panel_arm * ph, a + p.panel_arm * ph
    left = smooth(max(al - p.alpha_stall, -al - p.alpha_stall_negative) / p.stall_width)
    right = smooth(max(ar - p.alpha_stall, -ar - p.alpha_stall_negative) / p.stall_width)
    share = 0.5 * (left + right)
    plate = -sa / (0.283 + 0.222 * abs(sa))
    lift = p.CZ_0 + p.CZ_alpha * a + bounded(p.CZ_alpha_soft, a, 0.35)
    zl = (1.0 - left) * lift + left * plate
    zr = (1.0 - right) * (lift + p.CZ_alpha_right * a) + right * plate
    axial = a * (p.CX_alpha + p.CX_alpha2 * a)
    xl = p.CX_0 + (1.0 - left) * axial
    xr = p.CX_0 + p.CX_0_right + (1.0 - right) * axial
    zw = 0.5 * (zl + zr)
    drag = p.CD_parasite + p.CD_alpha * (a / 0.06) ** 2 + p.CD_lift * zw * zw + p.brake_drag * abs(dr)
    gone = t / 40.0
    drag += p.CD_beta2 * b * b + p.aileron_brake * abs(da) + (p.door if t > 20.0 else 0.0) - 0.2 * p.flap_creep * gone
    drag += p.elevator_drag * de * de
    adot = (a - y[ALAG]) / 0.05
    cx = 0.5 * (xl + xr) - drag * ca
    cz = (zw - drag * sa + p.CZ_q * qh + p.CZ_elevator * de + p.CZ_CT * ct
          + p.CZ_alphadot * adot * p.chord / (2.0 * V_) + p.CZ_beta2 * b * b + p.CZ_ct_alpha * ct * a
          + p.flap_creep * gone + p.CZ_hysteresis * math.tanh(adot / 0.05) + p.CZ_aileron_abs * abs(da))  # fmt: skip
    load = -qS * cz / (mass * gravity) - 1.0

    # tail
    arrival = (g[2] - g[3]) / V_
    at = a + arrival - p.downwash_slope * y[ADW] + p.tail_incidence + y[Q] * p.tail_arm / V_
    tail = smooth((-at - p.alpha_tail_stall) / p.tail_stall_width)
    lagging = p.chord / (2.0 * p.tail_arm)
    cm = (p.Cm_0 + p.Cm_alpha * ((1.0 - share) * a + share * p.Cm_alpha_separated * sa)
          + bounded(p.Cm_alpha_soft, a, 0.35) + bounded(p.Cm_q_soft, qh, 0.008)
          + (p.Cm_q - p.Cm_alphadot) * qh + p.Cm_alphadot * lagging * (a - y[ADW])
          + p.Cm_downwash2 * (lagging * (a - y[ADW2]) - 2.0 * qh) + p.Cm_alpha_tail * arrival
          + (p.Cm_elevator * de + bounded(p.Cm_elevator_soft, de, 0.2)) * (1.0 + p.Cm_elevator_CT * ct)
          * (1.0 - p.tail_stall_elevator_loss * tail)
          + p.Cm_CT * ct + p.Cm_ct2 * (ct + 6.0 * ct * ct) - tail * p.Cm_alpha_tail * (at + p.alpha_tail_stall)
          + p.Cm_at_72 * fast + p.Cm_aileron * da + p.Cm_beta2 * b * b + p.Cm_hump * (a - 0.03) ** 3
          + p.Cm_rotor_wake * ct * (a - 0.03) + p.Cm_alpha_q * (a - 0.03) * qh
          + 0.1 * p.flap_creep * gone + p.Cm_p * ph + p.trim_runs * max(t - 15.0, 0.0) / 25.0)  # fmt: skip

    # lateral
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
          + p.Cn_betadot * (b - y[BLAG]) / 0.1 * p.span / (2.0 * V_) + p.Cn_pfactor * a * ct
          + p.Cn_alpha_aileron * a * da)  # fmt: skip

    bdot = (b - y[BLAG]) / 0.1 * p.span / (2.0 * V_)
    mx, my, mz, ml, mm, mn = described(p, t, V_, a, b, ph, qh, rh, de, da, dr, ct, bdot, sph * cth, sth)
    cx, cy, cz, cl, cm, cn = cx + mx, cy + my, cz + mz, cl + ml, cm + mm, cn + mn

    # forces, moments about the c.g., rigid body
    X, Y, Z = qS * cx + thrust, qS * cy, qS * cz
    slosh = p.slosh_mass * 6.0 * (y[SLOSH] - y[PHI])  # N per unit angle: assumed pendulum in the tanks
    aside = p.cg_shift_y + p.fuel_shift * gone
    X += p.surge * thrust * math.sin(2.0 * math.pi * t / 3.0)
    L = qS * p.span * cl - aside * Z + p.cg_shift_z * Y + p.slosh_mass * 9.8 * 2.5 * y[SLOSH]
    Y = Y + slosh
    ahead = p.cg_shift_x + p.loose_load * y[THETA] + p.fuel_surge * X / mass
    M = (qS * p.chord * cm - p.cg_shift_z * X + ahead * Z
         + p.engine_arm_z * thrust + p.gyroscopic * y[R])  # fmt: skip
    N = qS * p.span * cn - p.cg_shift_x * Y + aside * X + p.engine_arm_y * (tl - tr) - p.gyroscopic * y[Q]
    fx, fy, fz = X / mass, Y / mass, Z / mass
    Ix, Iy, Iz, Ixz = p.inertia_xx, p.inertia_yy, p.inertia_zz, p.inertia_xz
    roll = L + Ixz * y[P] * y[Q] + (Iy - Iz) * y[Q] * y[R]
    yaw = N - Ixz * y[Q] * y[R] + (Ix - Iy) * y[P] * y[Q]
    D = Ix * Iz - Ixz * Ixz
    d[H] = y[U] * sth - (y[V] * sph + y[W] * cph) * cth
    d[U] = y[R] * y[V] - y[Q] * y[W] - gravity * sth + fx
    d[V] = y[P] * y[W] - y[R] * y[U] + gravity * sph * cth + fy
    d[W] = y[Q] * y[U] - y[P] * y[V] + gravity * cph * cth + fz
    d[PSI] = (y[Q] * sph + y[R] * cph) / cth
    d[PHI] = y[P] + sth * d[PSI]
    d[THETA] = y[Q] * cph - y[R] * sph
    d[P] = (Iz * roll + Ixz * yaw) / D
    d[Q] = (M + (Iz - Ix) * y[P] * y[R] - Ixz * (y[P] ** 2 - y[R] ** 2)) / Iy
    d[R] = (Ix * yaw + Ixz * roll) / D

    # surfaces and engines
    te = p.elevator_gearing * u[0] + p.elevator_cubic * u[0] * (u[0] / 0.1) ** 2
    te += p.elevator_offset + p.elevator_float * fast**2 + p.elevator_hunt * math.sin(2.0 * math.pi * 0.8 * t)
    ta = u[1] - min(max(u[1], -p.aileron_dead), p.aileron_dead)
    ta = p.aileron_gearing * ta + p.aileron_cubic * ta * (ta / 0.1) ** 2
    ta = y[DA] if abs(ta - y[DA]) < p.aileron_friction else ta
    tu = p.rudder_gearing * u[2] + p.rudder_cubic * u[2] * (u[2] / 0.1) ** 2
    tu += p.rudder_one_sided * max(u[2], 0.0) + p.rudder_of_aileron * u[1] + p.yaw_damper * y[R] + p.rudder_floats * b
    lag = p.elevator_lag + (p.elevator_up_lag if te < y[DE] else 0.0)
    d[DE], d[DE1] = surface(y[DE], y[DE1], te, p.elevator_min, p.elevator_max, lag, p.elevator_rate,
                            p.elevator_frequency, p.elevator_soft_rate)  # fmt: skip
    d[DA], d[DA1] = surface(y[DA], y[DA1], ta, p.aileron_min, p.aileron_max, p.aileron_lag, p.aileron_rate,
                            p.aileron_frequency, 0.0)  # fmt: skip
    d[DR], d[DR1] = surface(y[DR], y[DR1], tu, p.rudder_min, p.rudder_max, p.rudder_lag, p.rudder_rate,
                            p.rudder_frequency, 0.0)  # fmt: skip
    full = p.power_rated * lapse
    wl, wr = full * min(max(u[3], 0.0), 1.0), full * min(max(u[4], 0.0), 1.0)
    if p.spool_second > 0.0:
        d[PL2], d[PR2] = (wl - y[PL2]) / p.spool_second, (wr - y[PR2]) / p.spool_second
        wl, wr = y[PL2], y[PR2]
    else:
        d[PL2], d[PR2] = 0.0, 0.0
    d[PL] = (wl - y[PL]) / (p.spool_time + (p.spool_down if wl < y[PL] else 0.0))
    d[PR] = (wr - y[PR]) / (p.spool_time + (p.spool_down if wr < y[PR] else 0.0))

    # lags and oscillators
    d[ADW] = (a - y[ADW]) * V_ / p.tail_arm
    d[ADW2] = (y[ADW] - y[ADW2]) * V_ / p.tail_arm
    d[SLOSH], d[SLOSH1] = y[SLOSH1], 9.0 * (y[PHI] * 0.3 + fy / 9.8 - y[SLOSH]) - 0.6 * y[SLOSH1]
    gap = y[DE] - y[PLAY]
    d[PLAY] = (gap - min(max(gap, -p.elevator_play), p.elevator_play)) / 0.02
    d[BLAG] = (b - y[BLAG]) / 0.1
    d[ALAG] = adot
    o[VT], o[ALPHA], o[BETA], o[FX], o[FY], o[FZ], o[TL], o[TR], o[ADOT] = V_, a, b, fx, fy, fz, tl, tr, adot


@njit(cache=True)
def glide(y: Any, p: Any, u: Any, t: float, h: float, d1: Any, d2: Any, d3: Any, o: Any) -> None:
    """State `y` one step `h` on from time t, in still air; d1, d2, d3 and o are room to work in."""
    still = np.zeros(4)
    rates(y, p, u, still, t, d1, o)
    rates(y + 0.5 * h * d1, p, u, still, t + 0.5 * h, d2, o)
    rates(y + 0.75 * h * d2, p, u, still, t + 0.75 * h, d3, o)
    y += h * (2.0 * d1 + 3.0 * d2 + 4.0 * d3) / 9.0


@njit(cache=True)
def fly(row: Any, y0: Any, u0: Any, plan: Any, hold: Any, gusts: Any) -> tuple[Any, Any, Any]:
    """Fly a manoeuvre with a mild pilot who holds attitude; commands change once per sample.

    Args:
        row: one row of DTYPE.
        y0, u0: trimmed state [27] and commands [5].
        plan: what is added to the commands [samples, 5].
        hold: gains on pitch, pitch rate, bank, roll rate (elevator, elevator, aileron, aileron).
        gusts: [samples*SUB + 1, 4], velocities of the air along the body axes, every 5 ms.

    Returns:
        States [samples, 27], outputs [samples, 9], commands [samples, 5]; those of sample k acted until then.
    """
    p = row[0]
    n, h, delay = plan.shape[0], DT / SUB, round(row[0].elevator_delay / DT)
    Y, out, C = np.zeros((n, STATES)), np.zeros((n, OUTPUTS)), np.zeros((n, 5))
    y, d1, d2, d3, o = y0.copy(), np.zeros(STATES), np.zeros(STATES), np.zeros(STATES), np.zeros(OUTPUTS)
    u, g = u0.copy(), np.zeros(4)
    for k in range(n):
        if k > 0:
            C[k] = u0 + plan[k]
            C[k, 0] += hold[0] * (y[THETA] - y0[THETA]) + hold[1] * y[Q]
            C[k, 1] += hold[2] * (y[PHI] - y0[PHI]) + hold[3] * y[P]
            C[k, 3], C[k, 4] = min(max(C[k, 3], 0.0), 1.0), min(max(C[k, 4], 0.0), 1.0)
            u[:] = C[k]
            u[0] = C[max(k - delay, 0), 0]
            for s in range(SUB):
                i = (k - 1) * SUB + s
                t = i * h
                rates(y, p, u, gusts[i], t, d1, o)
                g[:] = 0.5 * (gusts[i] + gusts[i + 1])
                rates(y + 0.5 * h * d1, p, u, g, t + 0.5 * h, d2, o)
                g[:] = 0.25 * gusts[i] + 0.75 * gusts[i + 1]
                rates(y + 0.75 * h * d2, p, u, g, t + 0.75 * h, d3, o)
                y += h * (2.0 * d1 + 3.0 * d2 + 4.0 * d3) / 9.0
        else:
            C[0] = u0
        rates(y, p, u, gusts[k * SUB], k * DT, d1, o)
        Y[k], out[k] = y, o
    return Y, out, C
