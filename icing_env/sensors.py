"""What the instruments of NASA's icing research aircraft read: lag, boom oscillation, filter, scale, bias, noise.

Instruments: true airspeed, flow vanes on a nose boom, three rate gyros, vertical and directional gyro, three
accelerometers, surface positions, torque and speed of the propellers, static pressure and temperature, GPS, liquid
water and drop size, hinge moments (founding paper, section on the research aircraft; Melody 2004 for the hinge
moments). The boom oscillates at 7 Hz and a 10 Hz low pass is applied in flight (the paper): here a first-order one on
every fast channel alike, controls included, so that filtering shifts none against another. Flow angles and
accelerations are corrected to the c.g., as in the records.

measured = (1 + scale) x (truth behind lag, boom and filter - delay x its rate) + bias + drift x time + noise, and
what `icing_env.crosstalk` adds.
"""

from __future__ import annotations

import math
from typing import Any

from icing_env.atmosphere import pressure_altitude
from icing_env.crosstalk import crosstalk, gyro_crosstalk
from icing_env.frames import direction_cosines, euler_angles, to_local
from icing_env.jit import kernel
from icing_env.propulsion import torque
from icing_env.random import BLOCK, STREAM_SENSORS, normal4
from icing_env.types import Field

NOISY = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "psi", "ax", "ay", "az", "elevator", "aileron",
         "rudder", "thrust", "pressure", "temperature", "lwc", "mvd", "hinge_moment")  # fmt: skip
BIASED = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az", "elevator", "aileron", "rudder",
          "pressure", "temperature", "altitude")  # fmt: skip
SCALED = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az", "altitude", "thrust")
DELAYED = ("alpha", "beta", "p", "q", "r", "phi", "theta")
DRIFTING = ("airspeed", *DELAYED, "ax", "ay", "az", "altitude")

SENSOR_PARAMETERS: list[Field] = [
    *((f"noise_{c}", "of the channel", "standard deviation of the noise") for c in NOISY),
    *((f"bias_{c}", "of the channel", "constant error") for c in BIASED),
    *((f"scale_{c}", "1", "relative error") for c in SCALED),
    *((f"delay_{c}", "s", "delay of the reading, to first order; negative: the reading leads") for c in DELAYED),
    *((f"drift_{c}", "of the channel per s", "growth of its error since the start") for c in DRIFTING),
    ("pitot_lag", "s", "time constant of the airspeed"),
    ("pitot_alpha", "1/rad", "position error: relative airspeed error per angle of attack"),
    ("vane_lag", "s", "time constant of the flow vanes"),
    ("vane_position_error", "m", "error of the boom length used in the correction to the c.g."),
    ("boom_frequency", "Hz", "natural frequency of the nose boom"),
    ("boom_damping", "1", "its damping ratio"),
    ("boom_gain", "rad s2/m", "flow-angle error per normal acceleration"),
    ("filter_frequency", "Hz", "cut-off of the anti-boom low pass"),
]


@kernel
def lag_gain(dt: float, time_constant: float) -> float:
    """Share of the way a first-order lag goes in `dt`; exactly 1 without lag."""
    return 1.0 - math.exp(-dt/time_constant) if time_constant > 0.0 else 1.0


@kernel
def hold_filter_constants(s: Any, p: Any, dt: float) -> None:
    """Constants of lags, low pass and boom for a step `dt`; the boom's are its exact transition matrix."""
    s.gain_pitot, s.gain_vane = lag_gain(dt, p.pitot_lag), lag_gain(dt, p.vane_lag)
    s.gain_filter = 1.0 - math.exp(-2.0*math.pi*p.filter_frequency*dt)
    s.filter_rate = s.gain_filter/((1.0 - s.gain_filter)*dt) if s.gain_filter < 1.0 else 0.0
    omega, zeta = 2.0*math.pi*p.boom_frequency, p.boom_damping
    damped = omega*math.sqrt(1.0 - zeta*zeta)
    decay = math.exp(-zeta*omega*dt)
    cosine, sine = decay*math.cos(damped*dt), decay*math.sin(damped*dt)
    s.boom_xx = cosine + zeta*omega/damped*sine
    s.boom_xv = sine/damped
    s.boom_vx = -omega*omega/damped*sine
    s.boom_vv = cosine - zeta*omega/damped*sine


@kernel
def advance_boom(s: Any, p: Any, drive: float) -> None:
    """Nose boom as a damped oscillator under a normal acceleration [m/s2] held over the step."""
    rest = p.boom_gain*drive
    away, rate = s.boom_position - rest, s.boom_rate
    s.boom_position = rest + s.boom_xx*away + s.boom_xv*rate
    s.boom_rate = s.boom_vx*away + s.boom_vv*rate


@kernel
def start_instruments(x: Any, felt: tuple, s: Any, c: Any, p: Any, dt: float) -> None:
    """Settle every lag and filter on the present flight condition; `felt`: of `dynamics.loads`."""
    hold_filter_constants(s, p, dt)
    fx, fy, fz, _l, _m, _n, airspeed, alpha, beta, _rho, _tl, _tr, _he, _ha, _ps = felt
    s.pitot, s.vane_alpha, s.vane_beta = airspeed, alpha, beta
    s.boom_position, s.boom_rate = 0.0, 0.0
    s.filtered_alpha, s.filtered_beta = alpha, beta
    s.filtered_p, s.filtered_q, s.filtered_r = x.p, x.q, x.r
    s.filtered_ax, s.filtered_ay, s.filtered_az = fx*c.per_mass, fy*c.per_mass, fz*c.per_mass
    s.filtered_elevator, s.filtered_aileron, s.filtered_rudder = x.elevator, x.aileron, x.rudder


@kernel
def filter_flow_and_inertial(x: Any, s: Any, c: Any, p: Any, airspeed: float, alpha: float, beta: float, fx: float,
                             fy: float, fz: float) -> None:
    """Lags of pitot and vanes, the boom, then the same low pass on every fast channel."""
    cut, per_mass = s.gain_filter, c.per_mass
    offset = p.vane_position_error/max(airspeed, 1.0)
    s.vane_alpha += s.gain_vane*(alpha + offset*x.q - s.vane_alpha)
    s.vane_beta += s.gain_vane*(beta - offset*x.r - s.vane_beta)
    advance_boom(s, p, fz*per_mass + p.gravity_sea_level)
    s.pitot += s.gain_pitot*(airspeed*(1.0 + p.pitot_alpha*alpha) - s.pitot)
    s.filtered_alpha += cut*(s.vane_alpha + s.boom_position - s.filtered_alpha)
    s.filtered_beta += cut*(s.vane_beta - s.filtered_beta)
    s.filtered_p += cut*(x.p - s.filtered_p)
    s.filtered_q += cut*(x.q - s.filtered_q)
    s.filtered_r += cut*(x.r - s.filtered_r)
    s.filtered_ax += cut*(fx*per_mass - s.filtered_ax)
    s.filtered_ay += cut*(fy*per_mass - s.filtered_ay)
    s.filtered_az += cut*(fz*per_mass - s.filtered_az)
    s.filtered_elevator += cut*(x.elevator - s.filtered_elevator)
    s.filtered_aileron += cut*(x.aileron - s.filtered_aileron)
    s.filtered_rudder += cut*(x.rudder - s.filtered_rudder)


@kernel
def read_quietly(s: Any, m: Any, p: Any) -> None:
    """Flow, inertial and surface channels without their noise: delay, scale, bias and drift (to `m.time`)."""
    rate, t = s.filter_rate, m.time
    alpha = s.filtered_alpha - p.delay_alpha*rate*(s.vane_alpha + s.boom_position - s.filtered_alpha)
    beta = s.filtered_beta - p.delay_beta*rate*(s.vane_beta - s.filtered_beta)
    roll = s.filtered_p - p.delay_p*rate*(s.p - s.filtered_p)
    pitch = s.filtered_q - p.delay_q*rate*(s.q - s.filtered_q)
    yaw = s.filtered_r - p.delay_r*rate*(s.r - s.filtered_r)
    m.airspeed = (1.0 + p.scale_airspeed)*s.pitot + p.bias_airspeed + p.drift_airspeed*t
    m.alpha = (1.0 + p.scale_alpha)*alpha + p.bias_alpha + p.drift_alpha*t
    m.beta = (1.0 + p.scale_beta)*beta + p.bias_beta + p.drift_beta*t
    m.elevator = s.filtered_elevator + p.bias_elevator
    m.p = (1.0 + p.scale_p)*roll + p.bias_p + p.drift_p*t
    m.q = (1.0 + p.scale_q)*pitch + p.bias_q + p.drift_q*t
    m.r = (1.0 + p.scale_r)*yaw + p.bias_r + p.drift_r*t
    m.aileron = s.filtered_aileron + p.bias_aileron
    m.ax = (1.0 + p.scale_ax)*s.filtered_ax + p.bias_ax + p.drift_ax*t
    m.ay = (1.0 + p.scale_ay)*s.filtered_ay + p.bias_ay + p.drift_ay*t
    m.az = (1.0 + p.scale_az)*s.filtered_az + p.bias_az + p.drift_az*t
    m.rudder = s.filtered_rudder + p.bias_rudder
    crosstalk(s, m, p)


@kernel
def read_gyros_quietly(x: Any, m: Any, p: Any, phi: float, theta: float) -> None:
    """Bank and pitch without their noise, from the true ones: as `read_quietly`, delayed by their own rates."""
    attitude = direction_cosines(x.e0, x.e1, x.e2, x.e3)
    across = attitude[5]*x.q + attitude[8]*x.r  # cos(theta) (q sin(phi) + r cos(phi))
    plane = max(attitude[5]*attitude[5] + attitude[8]*attitude[8], 1e-9)
    phi_rate = x.p - attitude[2]*across/plane
    theta_rate = (attitude[8]*x.q - attitude[5]*x.r)/math.sqrt(plane)
    m.phi = (1.0 + p.scale_phi)*(phi - p.delay_phi*phi_rate) + p.bias_phi + p.drift_phi*m.time
    m.theta = (1.0 + p.scale_theta)*(theta - p.delay_theta*theta_rate) + p.bias_theta + p.drift_theta*m.time
    gyro_crosstalk(m, p, phi, theta)


@kernel
def read_fast(s: Any, m: Any, p: Any) -> None:
    """Flow, inertial and surface channels: scale, bias and noise (blocks 0 to 3 of the instrument stream)."""
    read_quietly(s, m, p)
    n0, n1, n2, n3 = normal4(s.seed, STREAM_SENSORS, s.step, BLOCK[0])
    m.airspeed += p.noise_airspeed*n0
    m.alpha += p.noise_alpha*n1
    m.beta += p.noise_beta*n2
    m.elevator += p.noise_elevator*n3
    n0, n1, n2, n3 = normal4(s.seed, STREAM_SENSORS, s.step, BLOCK[1])
    m.p += p.noise_p*n0
    m.q += p.noise_q*n1
    m.r += p.noise_r*n2
    m.aileron += p.noise_aileron*n3
    n0, n1, n2, n3 = normal4(s.seed, STREAM_SENSORS, s.step, BLOCK[2])
    m.ax += p.noise_ax*n0
    m.ay += p.noise_ay*n1
    m.az += p.noise_az*n2
    m.rudder += p.noise_rudder*n3


@kernel
def read_attitude(x: Any, s: Any, m: Any, p: Any, u: Any) -> float:
    """Attitude (heading kept continuous), flap and levers (block 3); returns a noise to spare."""
    phi, theta, psi = euler_angles(x.e0, x.e1, x.e2, x.e3)
    turn = psi - m.psi
    psi = m.psi + turn - 2.0*math.pi*math.floor(turn*(0.5/math.pi) + 0.5)
    n0, n1, n2, n3 = normal4(s.seed, STREAM_SENSORS, s.step, BLOCK[3])
    read_gyros_quietly(x, m, p, phi, theta)
    m.phi += p.noise_phi*n0
    m.theta += p.noise_theta*n1
    m.psi = psi + p.noise_psi*n2
    m.flap = x.flap
    m.throttle_left, m.throttle_right = u.throttle_left, u.throttle_right
    return n3


@kernel
def read_engines_and_navigation(x: Any, attitude: tuple, s: Any, m: Any, p: Any, thrust_left: float,
                                thrust_right: float, hinge_e: float, hinge_a: float, static: float,
                                noise: float) -> None:
    """Engines, hinge moments, static pressure, GPS, ten times a second (block 4)."""
    n0, n1, n2, n3 = normal4(s.seed, STREAM_SENSORS, s.step, BLOCK[4])
    m.thrust_left = (1.0 + p.scale_thrust)*thrust_left + p.noise_thrust*n0
    m.thrust_right = (1.0 + p.scale_thrust)*thrust_right + p.noise_thrust*n1
    m.hinge_moment_elevator = hinge_e + p.noise_hinge_moment*n2
    m.hinge_moment_aileron = hinge_a + p.noise_hinge_moment*n3
    m.pressure = static + p.bias_pressure + p.noise_pressure*noise
    m.altitude = ((1.0 + p.scale_altitude)*pressure_altitude(m.pressure) + p.bias_altitude
                  + p.drift_altitude*m.time)
    m.torque_left, m.torque_right = torque(x.power_left, p), torque(x.power_right, p)
    m.rpm_left, m.rpm_right = p.propeller_rpm, p.propeller_rpm
    north, east, _down = to_local(attitude, x.u, x.v, x.w)
    m.ground_speed = math.sqrt(north*north + east*east)
    m.track = math.atan2(east, north)


@kernel
def read_slow(s: Any, m: Any, p: Any) -> None:
    """Temperature and cloud probes, once a second (block 5)."""
    n0, n1, n2, _n3 = normal4(s.seed, STREAM_SENSORS, s.step, BLOCK[5])
    m.temperature = s.temperature + p.bias_temperature + p.noise_temperature*n0
    m.lwc = max(0.0, s.lwc*(1.0 + p.noise_lwc*n1))
    m.mvd = s.mvd*max(0.0, 1.0 + p.noise_mvd*n2) if s.lwc > 0.0 else 0.0


@kernel
def read_instruments(x: Any, felt: tuple, s: Any, m: Any, c: Any, p: Any, u: Any, o: Any, ten_hertz: Any,
                     one_hertz: Any) -> None:
    """One sample of every instrument that is due into `m`, and the true air data and load factor into `o`.

    `felt`: of `dynamics.loads`.
    """
    (fx, fy, fz, _l, _m, _n, airspeed, alpha, beta, _rho, thrust_left, thrust_right,
     hinge_e, hinge_a, static) = felt
    filter_flow_and_inertial(x, s, c, p, airspeed, alpha, beta, fx, fy, fz)
    read_fast(s, m, p)
    spare = read_attitude(x, s, m, p, u)
    if ten_hertz:
        attitude = direction_cosines(x.e0, x.e1, x.e2, x.e3)
        read_engines_and_navigation(x, attitude, s, m, p, thrust_left, thrust_right, hinge_e, hinge_a, static, spare)
    if one_hertz:
        read_slow(s, m, p)
    o.load_factor = -fz*c.per_mass/p.gravity_sea_level
    o.airspeed, o.alpha, o.beta = airspeed, alpha, beta
