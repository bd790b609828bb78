"""The aircraft as one chain of equations: air data, coefficients, forces, and the rates of the continuous state.

Flat Earth, rigid body, 3-2-1 quaternion attitude. Stevens, Lewis & Johnson, Aircraft Control and Simulation, 3rd ed.,
eqs. 1.7-18 (translation, rotation with Ixz, kinematics); all in body axes about the c.g.

Records: `x` the continuous state, `s` the gusts now (of the state, or on the way to it), `c` the coefficients as they
are now (ice included), `p` the parameters, `u` the command.
"""

from __future__ import annotations

import math
from typing import Any

from icing_env.actuators import aileron_hinge_moment, elevator_hinge_moment, floated, surface_rate
from icing_env.aerodynamics import CT_MAX, lateral, longitudinal, separation, smootherstep, tail_angle
from icing_env.atmosphere import GAS_CONSTANT, gravity, place_of_static_air, static_air, static_air_near
from icing_env.discrepancy import bent, discrepancy
from icing_env.frames import angle_of, direction_cosines, to_body, to_local
from icing_env.jit import block, kernel
from icing_env.propulsion import power_available, thrust_per_power
from icing_env.severity import iced_aircraft
from icing_env.wind import wind

PER_FLAP_LAG = 5.0  # 1/s, rounds the corner where the flap arrives (assumed)
AIRSPEED_FLOOR = 0.1524  # m/s (0.5 ft/s), floor of the normalised rates (NASA/TM-2015-218675, case 3)


@kernel
def present_aircraft(s: Any, p: Any, c: Any) -> None:
    """The aircraft of this step: coefficients and mass with the ice it carries, and reciprocals for the equations."""
    iced_aircraft(s, p, c)
    c.standard_pressure, c.per_standard_temperature = place_of_static_air(s.altitude)
    c.per_mass, c.per_inertia_yy = 1.0/c.mass, 1.0/p.inertia_yy
    determinant = 1.0/(p.inertia_xx*p.inertia_zz - p.inertia_xz*p.inertia_xz)
    c.per_inertia_xx, c.per_inertia_zz = p.inertia_zz*determinant, p.inertia_xx*determinant
    c.per_inertia_xz = p.inertia_xz*determinant
    c.per_stall_width, c.per_tail_stall_width = 1.0/p.stall_width, 1.0/p.tail_stall_width
    c.per_tail_arm, c.per_spool_time = 1.0/p.tail_arm, 1.0/p.spool_time
    c.per_elevator_lag, c.per_aileron_lag, c.per_rudder_lag = 1.0/p.elevator_lag, 1.0/p.aileron_lag, 1.0/p.rudder_lag
    c.per_elevator_stiffness = 1.0/p.hinge_elevator_stiffness
    c.per_aileron_stiffness = 1.0/p.hinge_aileron_stiffness


@kernel
def air_data(x: Any, attitude: tuple, s: Any, p: Any) -> tuple:
    """Airspeed [m/s], alpha, beta [rad], sine and cosine of alpha, air velocity along body x, y, z, 1/airspeed.

    Inertial velocity less wind less gust; `attitude`: the direction cosines.
    """
    wx, wy, wz = to_body(attitude, *wind(x.altitude, p))
    ua, va, wa = x.u - wx - s.gust_u, x.v - wy - s.gust_v, x.w - wz - s.gust_w
    plane = math.sqrt(ua*ua + wa*wa)
    airspeed = math.sqrt(plane*plane + va*va)
    slowness = 1.0/max(airspeed, AIRSPEED_FLOOR)
    per_plane = 1.0/max(plane, 1e-9)
    sine, cosine = wa*per_plane, ua*per_plane
    return airspeed, angle_of(wa, ua), angle_of(va, plane), sine, cosine, ua, va, wa, slowness


@kernel
def meet_air(x: Any, attitude: tuple, s: Any, c: Any, p: Any) -> tuple:
    """The air that the aircraft meets: density [kg/m3], static pressure [Pa], and what `air_data` returns."""
    kelvin, static, holds = static_air_near(x.altitude, c.standard_pressure, c.per_standard_temperature)
    if not holds:
        kelvin, static = static_air(x.altitude)
    return (air_density(kelvin, static, x.altitude, p), static, *air_data(x, attitude, s, p))


@kernel
def meet_air_near(x: Any, attitude: tuple, s: Any, c: Any, p: Any) -> tuple:
    """`meet_air` by the series alone, and whether that holds: straight-line code, for aircraft side by side."""
    kelvin, static, holds = static_air_near(x.altitude, c.standard_pressure, c.per_standard_temperature)
    return (air_density(kelvin, static, x.altitude, p), static, *air_data(x, attitude, s, p)), holds


@kernel
def air_density(kelvin: float, static: float, altitude: float, p: Any) -> float:
    """Density [kg/m3] of air of a standard temperature [K] at a static pressure [Pa] and an altitude [m]."""
    return denser(altitude, p)*static/(GAS_CONSTANT*(kelvin + p.temperature_offset))


@kernel
def denser(altitude: float, p: Any) -> float:
    """Density over that of pressure and temperature at an altitude [m]."""
    return p.density_factor + p.density_lapse*altitude


@kernel
def forces(x: Any, attitude: tuple, s: Any, c: Any, p: Any) -> tuple:
    """`loads` in the air that the aircraft meets."""
    return loads(x, meet_air(x, attitude, s, c, p), s, c, p)


@kernel
def loads(x: Any, air: tuple, s: Any, c: Any, p: Any) -> tuple:
    """Aerodynamic and propulsive force [N] and moment about the c.g. [N m], and what instruments and controls need.

    `air`: of `meet_air`. Returns: Fx, Fy, Fz, L, M, N, airspeed, alpha, beta, density, thrust left, thrust right,
    elevator and aileron hinge moments, static pressure.
    """
    density, static, airspeed, alpha, beta, sine, cosine, ua, va, wa, slowness = air
    qbar = 0.5*density*airspeed*airspeed
    half = 0.5*slowness
    pa, qa, ra = x.p - s.gust_p, x.q - s.gust_q, x.r - s.gust_r
    phat, qhat, rhat = pa*p.span*half, qa*p.chord*half, ra*p.span*half

    per_power = thrust_per_power(ua, c, p)
    thrust_left = p.thrust_factor_left*x.power_left*per_power
    thrust_right = p.thrust_factor_right*x.power_right*per_power
    thrust = thrust_left + thrust_right
    qs = qbar*p.wing_area
    ct = min(thrust/max(qs, 1e-9), CT_MAX) - p.CT_reference

    wingtip = phat*p.panel_arm
    flap_shift = p.alpha_stall_flap*x.flap
    left = separation(alpha - wingtip, c.alpha_stall_left + flap_shift, c, p)
    right = separation(alpha + wingtip, c.alpha_stall_right + flap_shift, c, p)
    arrival = (s.gust_w - s.gust_w_tail)*slowness
    alpha_tail = tail_angle(alpha, arrival, qa, slowness, x, p)
    tail = smootherstep((-alpha_tail - c.alpha_tail_stall)*c.per_tail_stall_width)
    height = 16.0*(x.altitude - p.ground_altitude)
    low = p.span*p.span/(p.span*p.span + height*height)

    axial_left, axial_right, lift_left, lift_right, rest_x, rest_z, cm = longitudinal(
        alpha, sine, cosine, qhat, left, right, tail, ct, low, arrival, x, c, p)
    cy, cl, cn = lateral(alpha, beta, phat, rhat, 0.5*(left + right), x, c, p)
    # a stalled tailplane keeps only the download it had at the onset
    cm -= tail*p.Cm_alpha_tail*(alpha_tail + c.alpha_tail_stall)
    cl += 0.5*p.lift_arm*(lift_right - lift_left)
    cn -= 0.5*p.lift_arm*(axial_right - axial_left)
    bluff = 0.5*density*airspeed*p.wing_area*(c.CD_parasite + p.CD_alpha2*sine*sine)
    more_x, more_y, more_z, more_l, more_m, more_n = discrepancy(
        alpha, beta, (phat, qhat, rhat), airspeed, ct, qs*cy - bluff*va, slowness, x, c, p)

    fx = qs*(0.5*(axial_left + axial_right) + rest_x + more_x) - bluff*ua + thrust
    fy = qs*(cy + more_y) - bluff*va
    fz = qs*(0.5*(lift_left + lift_right) + rest_z + more_z) - bluff*wa
    roll = qs*p.span*(cl + more_l) - p.cg_shift_y*fz + p.cg_shift_z*fy
    pitch = qs*p.chord*(cm + more_m) - p.cg_shift_z*fx + p.cg_shift_x*fz + p.engine_arm_z*thrust
    yaw = qs*p.span*(cn + more_n) - p.cg_shift_x*fy + p.cg_shift_y*fx + p.engine_arm_y*(thrust_left - thrust_right)
    hinge_e = elevator_hinge_moment(qbar, alpha_tail, tail, x, p)
    hinge_a = aileron_hinge_moment(qbar, left, right, x, p)
    return (fx, fy, fz, roll, pitch, yaw, airspeed, alpha, beta, density, thrust_left, thrust_right,
            hinge_e, hinge_a, static)


@kernel
def rigid_body(x: Any, attitude: tuple, dx: Any, fx: float, fy: float, fz: float, roll: float, pitch: float,
               yaw: float, c: Any, p: Any) -> None:
    """Newton and Euler: rates of velocity, attitude, rotation and position from force [N] and moment [N m]."""
    g = gravity(x.altitude, p.gravity_sea_level, p.earth_radius)
    dx.u = x.r*x.v - x.q*x.w + attitude[2]*g + fx*c.per_mass
    dx.v = x.p*x.w - x.r*x.u + attitude[5]*g + fy*c.per_mass
    dx.w = x.q*x.u - x.p*x.v + attitude[8]*g + fz*c.per_mass
    dx.e0 = -0.5*(x.e1*x.p + x.e2*x.q + x.e3*x.r)
    dx.e1 = 0.5*(x.e0*x.p + x.e2*x.r - x.e3*x.q)
    dx.e2 = 0.5*(x.e0*x.q + x.e3*x.p - x.e1*x.r)
    dx.e3 = 0.5*(x.e0*x.r + x.e1*x.q - x.e2*x.p)
    ixx, iyy, izz, ixz = p.inertia_xx, p.inertia_yy, p.inertia_zz, p.inertia_xz
    rolling = roll + ixz*x.p*x.q + (iyy - izz)*x.q*x.r
    yawing = yaw - ixz*x.q*x.r + (ixx - iyy)*x.p*x.q
    dx.p = c.per_inertia_xx*rolling + c.per_inertia_xz*yawing
    dx.q = (pitch + (izz - ixx)*x.p*x.r - ixz*(x.p*x.p - x.r*x.r))*c.per_inertia_yy
    dx.r = c.per_inertia_zz*yawing + c.per_inertia_xz*rolling
    north, east, down = to_local(attitude, x.u, x.v, x.w)
    dx.north, dx.east, dx.altitude = north, east, -down


@kernel
def surfaces(x: Any, dx: Any, u: Any, air: tuple, hinge_e: float, hinge_a: float, c: Any, p: Any) -> None:
    """Rates of the control surfaces; `air`: of `meet_air`."""
    airspeed, alpha, beta = air[2], air[3], air[4]
    pushed = p.elevator_of_airspeed*airspeed + p.elevator_of_alpha*alpha
    pushed += p.elevator_of_aileron*x.aileron + p.elevator_of_rudder*x.rudder
    told = bent(p.elevator_gearing*u.elevator + p.elevator_offset, x.elevator, p.elevator_cube, p.elevator_side,
                p.elevator_magnitude, p.elevator_direction, pushed)
    dx.elevator = surface_rate(x.elevator, told + floated(hinge_e, p.hinge_elevator_hold, c.per_elevator_stiffness),
                               p.elevator_min, p.elevator_max, c.per_elevator_lag, p.elevator_rate)
    pushed = p.aileron_of_airspeed*airspeed + p.aileron_of_p*x.p
    pushed += p.aileron_of_elevator*x.elevator + p.aileron_of_rudder*x.rudder
    told = bent(p.aileron_gearing*u.aileron + p.aileron_offset, x.aileron, p.aileron_cube, p.aileron_side,
                p.aileron_magnitude, p.aileron_direction, pushed)
    dx.aileron = surface_rate(x.aileron, told + floated(hinge_a, p.hinge_aileron_hold, c.per_aileron_stiffness),
                              p.aileron_min, p.aileron_max, c.per_aileron_lag, p.aileron_rate)
    pushed = p.rudder_of_airspeed*airspeed + p.rudder_of_beta*beta
    pushed += p.rudder_of_elevator*x.elevator + p.rudder_of_aileron*x.aileron
    told = bent(p.rudder_gearing*u.rudder + p.rudder_offset, x.rudder, p.rudder_cube, p.rudder_side,
                p.rudder_magnitude, p.rudder_direction, pushed)
    dx.rudder = surface_rate(x.rudder, told, p.rudder_min, p.rudder_max, c.per_rudder_lag, p.rudder_rate)


@kernel
def flap_and_engines(x: Any, dx: Any, u: Any, static: float, c: Any, p: Any) -> None:
    """Rates of the flap and the shaft powers."""
    dx.flap = surface_rate(x.flap, u.flap, 0.0, p.flap_max, PER_FLAP_LAG, p.flap_rate)
    full = power_available(static, p)
    dx.power_left = (full*min(max(u.throttle_left, 0.0), 1.0) - x.power_left)*c.per_spool_time
    dx.power_right = (full*min(max(u.throttle_right, 0.0), 1.0) - x.power_right)*c.per_spool_time


@block
def derivative(x: Any, dx: Any, s: Any, c: Any, p: Any, u: Any) -> None:
    """Rates of the whole continuous state, written into `dx`."""
    attitude = direction_cosines(x.e0, x.e1, x.e2, x.e3)
    rates(x, dx, attitude, meet_air(x, attitude, s, c, p), s, c, p, u)


@kernel
def rates(x: Any, dx: Any, attitude: tuple, air: tuple, s: Any, c: Any, p: Any, u: Any) -> None:
    """Rates of the whole continuous state in known air (of `meet_air`), written into `dx`."""
    (fx, fy, fz, roll, pitch, yaw, airspeed, alpha, _beta, _density, _left, _right,
     hinge_e, hinge_a, static) = loads(x, air, s, c, p)
    rigid_body(x, attitude, dx, fx, fy, fz, roll, pitch, yaw, c, p)
    surfaces(x, dx, u, air, hinge_e, hinge_a, c, p)
    flap_and_engines(x, dx, u, static, c, p)
    dx.alpha_downwash = (alpha - x.alpha_downwash)*max(airspeed, AIRSPEED_FLOOR)*c.per_tail_arm
