"""The aircraft again, from docs/model.md for flaps-up flight in free air, and Bogacki and Shampine's integrator.

Euler angles instead of a quaternion, the third-order Runge-Kutta method of Bogacki & Shampine (Appl. Math. Lett. 2(4),
1989) at 5 ms, gusts that change within a sample. Numbers with a knob are neutral at 0 (`published.py`). Left out, since
they do not act here: flap, ground, hinge-moment float below its limits, ice. SI and radians.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from testbed.withheld.aerodynamics import forces, half_wings, lateral, pitching
from testbed.withheld.compiled import compiled, part
from testbed.withheld.described import described

# positions in the state vector
H, U, V, W, PHI, THETA, PSI, P, Q, R, DE, DA, DR, PL, PR, ADW = range(16)
DE1, DA1, DR1, ADW2, PL2, PR2, SLOSH, SLOSH1, PLAY, BLAG, ALAG = range(16, 27)
STATES = 27
# outputs beside the state
VT, ALPHA, BETA, FX, FY, FZ, TL, TR, ADOT = range(9)
OUTPUTS = 9
# gusts: velocities of the air along the body axes, the vertical one at the tail, rates of the air about the axes
G_U, G_V, G_W, G_TAIL, G_P, G_Q, G_R = range(7)
GUSTS = 7
DT, SUB = 0.02, 4  # s between samples, integration steps in one


@compiled
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


@compiled
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


@compiled
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


@part
def flow(y: Any, p: Any, g: Any, t: float) -> tuple[float, tuple[float, ...]]:
    """Speed of the air along body x, and `met` as in `aerodynamics`."""
    uw, vw, ww = wind(y, p, t)
    ua, va, wa = y[U] - uw - g[G_U], y[V] - vw - g[G_V], y[W] - ww - g[G_W]
    plane = math.sqrt(ua * ua + wa * wa)
    V_ = math.sqrt(plane * plane + va * va)
    half = 2.0 * V_
    return ua, (V_, math.atan2(wa, ua), math.atan2(va, plane), wa / plane, ua / plane,
                (y[P] - g[G_P]) * p.span / half, (y[Q] - g[G_Q]) * p.chord / half,
                (y[R] - g[G_R]) * p.span / half)  # fmt: skip


@part
def engines(y: Any, p: Any, ua: float, a: float, fast: float) -> tuple[float, float]:
    """Thrust of the left and the right one, N; `fast`: airspeed over 72 m/s."""
    per = p.propeller_efficiency / math.sqrt(ua * ua + p.propeller_static_speed**2) * (1.0 + p.thrust_at_72 * fast**2)
    return (p.thrust_factor_left * y[PL] * per * (1.0 + p.left_of_alpha * (a - 0.03)),
            p.thrust_factor_right * y[PR] * per * (1.0 + p.thrust_right_at_72 * fast**2))


@part
def coefficients(y: Any, p: Any, g: Any, t: float, met: Any, facing: Any, ct: float, qS: float,
                 weight: float) -> tuple[float, ...]:  # fmt: skip
    """CX, CY, CZ, Cl, Cm, Cn; `facing`: sin(phi) cos(theta), sin(theta); `qS`: dynamic pressure times wing area, N."""
    V_, a, b, _sa, _ca, ph, qh, rh = met
    de = y[PLAY] if p.elevator_play > 0.0 else y[DE]
    de = de / (1.0 + p.blowback * (V_ / 72.0)**2)
    moved = de, y[DA], y[DR]
    wings = half_wings(met, p)
    cx, cz = forces(met, moved, wings, ct, (a - y[ALAG]) / 0.05, t, p)
    tail = (g[G_W] - g[G_TAIL]) / V_, (y[Q] - g[G_Q]) * p.tail_arm / V_, y[ADW], y[ADW2]
    cm = pitching(met, moved, wings[0], ct, tail, t, p)
    slipped = b - y[BLAG]
    cy, cl, cn = lateral(met, moved, wings, ct, -qS * cz / weight - 1.0, slipped, t, p)
    mx, my, mz, ml, mm, mn = described(p, t, V_, a, b, ph, qh, rh, de, y[DA], y[DR], ct,
                                       slipped / 0.1 * p.span / (2.0 * V_), *facing)  # fmt: skip
    return cx + mx, cy + my, cz + mz, cl + ml, cm + mm, cn + mn


@part
def loads(y: Any, p: Any, t: float, qS: float, c: Any, tl: float, tr: float, mass: float) -> tuple[float, ...]:
    """Forces X, Y, Z, N, and moments L, M, N about the c.g., N m, of the coefficients `c`."""
    cx, cy, cz, cl, cm, cn = c
    thrust = tl + tr
    X, Y, Z = qS * cx + thrust, qS * cy, qS * cz
    slosh = p.slosh_mass * 6.0 * (y[SLOSH] - y[PHI])  # N per unit angle: assumed pendulum in the tanks
    aside = p.cg_shift_y + p.fuel_shift * (t / 40.0)
    X += p.surge * thrust * math.sin(2.0 * math.pi * t / 3.0)
    L = qS * p.span * cl - aside * Z + p.cg_shift_z * Y + p.slosh_mass * 9.8 * 2.5 * y[SLOSH]
    Y = Y + slosh
    ahead = p.cg_shift_x + p.loose_load * y[THETA] + p.fuel_surge * X / mass
    M = (qS * p.chord * cm - p.cg_shift_z * X + ahead * Z
         + p.engine_arm_z * thrust + p.gyroscopic * y[R])  # fmt: skip
    N = qS * p.span * cn - p.cg_shift_x * Y + aside * X + p.engine_arm_y * (tl - tr) - p.gyroscopic * y[Q]
    return X, Y, Z, L, M, N


@part
def rigid_body(y: Any, p: Any, d: Any, attitude: Any, gravity: float, f: Any, moments: Any) -> None:
    """Newton and Euler: rates of motion under specific forces `f`, m/s2, and moments about the c.g., N m.

    `attitude`: sine and cosine of phi, of theta.
    """
    sph, cph, sth, cth = attitude
    L, M, N = moments
    Ix, Iy, Iz, Ixz = p.inertia_xx, p.inertia_yy, p.inertia_zz, p.inertia_xz
    roll = L + Ixz * y[P] * y[Q] + (Iy - Iz) * y[Q] * y[R]
    yaw = N - Ixz * y[Q] * y[R] + (Ix - Iy) * y[P] * y[Q]
    D = Ix * Iz - Ixz * Ixz
    d[H] = y[U] * sth - (y[V] * sph + y[W] * cph) * cth
    d[U] = y[R] * y[V] - y[Q] * y[W] - gravity * sth + f[0]
    d[V] = y[P] * y[W] - y[R] * y[U] + gravity * sph * cth + f[1]
    d[W] = y[Q] * y[U] - y[P] * y[V] + gravity * cph * cth + f[2]
    d[PSI] = (y[Q] * sph + y[R] * cph) / cth
    d[PHI] = y[P] + sth * d[PSI]
    d[THETA] = y[Q] * cph - y[R] * sph
    d[P] = (Iz * roll + Ixz * yaw) / D
    d[Q] = (M + (Iz - Ix) * y[P] * y[R] - Ixz * (y[P] ** 2 - y[R] ** 2)) / Iy
    d[R] = (Ix * yaw + Ixz * roll) / D


@part
def follow(y: Any, p: Any, u: Any, t: float, b: float, fast: float, d: Any) -> None:
    """Rates of the surfaces, behind commands `u` and what else moves them."""
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


@part
def spool(y: Any, p: Any, u: Any, full: float, d: Any) -> None:
    """Rates of the engines' power; `full`: what they have here, W."""
    wl, wr = full * min(max(u[3], 0.0), 1.0), full * min(max(u[4], 0.0), 1.0)
    if p.spool_second > 0.0:
        d[PL2], d[PR2] = (wl - y[PL2]) / p.spool_second, (wr - y[PR2]) / p.spool_second
        wl, wr = y[PL2], y[PR2]
    else:
        d[PL2], d[PR2] = 0.0, 0.0
    d[PL] = (wl - y[PL]) / (p.spool_time + (p.spool_down if wl < y[PL] else 0.0))
    d[PR] = (wr - y[PR]) / (p.spool_time + (p.spool_down if wr < y[PR] else 0.0))


@part
def trail(y: Any, p: Any, V_: float, a: float, b: float, fy: float, d: Any) -> None:
    """Rates of downwash, fuel, play and what is late; `fy`: specific force to the side, m/s2."""
    d[ADW] = (a - y[ADW]) * V_ / p.tail_arm
    d[ADW2] = (y[ADW] - y[ADW2]) * V_ / p.tail_arm
    d[SLOSH], d[SLOSH1] = y[SLOSH1], 9.0 * (y[PHI] * 0.3 + fy / 9.8 - y[SLOSH]) - 0.6 * y[SLOSH1]
    gap = y[DE] - y[PLAY]
    d[PLAY] = (gap - min(max(gap, -p.elevator_play), p.elevator_play)) / 0.02
    d[BLAG] = (b - y[BLAG]) / 0.1
    d[ALAG] = (a - y[ALAG]) / 0.05


@compiled
def rates(y: Any, p: Any, u: Any, g: Any, t: float, d: Any, o: Any) -> None:
    """Rates `d` of state `y` and outputs `o` under commands `u` and gusts `g` [GUSTS] at time t."""
    density, lapse, gravity = air(y[H], p)
    ua, met = flow(y, p, g, t)
    V_, a, b = met[0], met[1], met[2]
    fast = V_ / 72.0
    qS = 0.5 * density * V_ * V_ * p.wing_area
    mass = p.mass * (1.0 - (p.load_dropped if t > 20.0 else 0.0))
    tl, tr = engines(y, p, ua, a, fast)
    ct = min((tl + tr) / qS, 1.0) - p.CT_reference
    attitude = sph, _cph, sth, cth = math.sin(y[PHI]), math.cos(y[PHI]), math.sin(y[THETA]), math.cos(y[THETA])
    c = coefficients(y, p, g, t, met, (sph * cth, sth), ct, qS, mass * gravity)
    X, Y, Z, L, M, N = loads(y, p, t, qS, c, tl, tr, mass)
    fx, fy, fz = X / mass, Y / mass, Z / mass
    rigid_body(y, p, d, attitude, gravity, (fx, fy, fz), (L, M, N))
    follow(y, p, u, t, b, fast, d)
    spool(y, p, u, p.power_rated * lapse, d)
    trail(y, p, V_, a, b, fy, d)
    o[VT], o[ALPHA], o[BETA], o[FX], o[FY], o[FZ], o[TL], o[TR], o[ADOT] = V_, a, b, fx, fy, fz, tl, tr, d[ALAG]


@compiled
def glide(y: Any, p: Any, u: Any, t: float, h: float, d1: Any, d2: Any, d3: Any, o: Any) -> None:
    """State `y` one step `h` on from time t, in still air; d1, d2, d3 and o are room to work in."""
    still = np.zeros(GUSTS)
    rates(y, p, u, still, t, d1, o)
    rates(y + 0.5 * h * d1, p, u, still, t + 0.5 * h, d2, o)
    rates(y + 0.75 * h * d2, p, u, still, t + 0.75 * h, d3, o)
    y += h * (2.0 * d1 + 3.0 * d2 + 4.0 * d3) / 9.0


@compiled
def fly(row: Any, y0: Any, u0: Any, plan: Any, hold: Any, gusts: Any) -> tuple[Any, Any, Any]:
    """Fly a manoeuvre with a mild pilot who holds attitude; commands change once per sample.

    Args:
        row: one row of DTYPE.
        y0, u0: trimmed state [27] and commands [5].
        plan: what is added to the commands [samples, 5].
        hold: gains on pitch, pitch rate, bank, roll rate (elevator, elevator, aileron, aileron).
        gusts: [samples*SUB + 1, GUSTS], every 5 ms.

    Returns:
        States [samples, 27], outputs [samples, 9], commands [samples, 5]; those of sample k acted until then.
    """
    p = row[0]
    n, h, delay = plan.shape[0], DT / SUB, round(row[0].elevator_delay / DT)
    Y, out, C = np.zeros((n, STATES)), np.zeros((n, OUTPUTS)), np.zeros((n, 5))
    y, d1, d2, d3, o = y0.copy(), np.zeros(STATES), np.zeros(STATES), np.zeros(STATES), np.zeros(OUTPUTS)
    u, g = u0.copy(), np.zeros(GUSTS)
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
