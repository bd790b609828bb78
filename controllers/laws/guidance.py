"""Guidance: the outer loops that every classical law shares, from targets to pitch, bank and power.

Successive loop closure (McRuer, Ashkenas & Graham, Aircraft Dynamics and Automatic Control, chapters 7-8; Stevens,
Lewis & Johnson, Aircraft Control and Simulation, 3rd ed., section 4.6). A law's memory has GUIDANCE_FIELDS, its gains
have GUIDANCE_GAINS_FIELDS; its inner loop, from pitch and bank asked for to the surfaces, is its own.

* s = qbar_reference / qbar: surface power goes with dynamic pressure
* vertical speed and airspeed: complementary filters of acceleration with pressure altitude and pitot, so that neither
  gusts on the vane nor noise of the pitot move the controls
* theta_command = pitch trim + K (climb-rate error)/V + compensation of the lift lost in a bank
* bank_command = atan(V K_psi (heading error)/g), slewed
* throttle = trim + K_V (airspeed error) + K_climb (climb-rate command)

The advisory limits what is asked for, with a margin so that the protection has nothing to do: bank, pitch, angle of
attack (lowers the pitch command), flap, lowest airspeed (raises the airspeed target, and the climb yields to the
airspeed: where full power does not sustain level flight, by the descent that it does sustain).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import air_density, airspeed_of, airspeed_rate, clip, integrated, wrapped
from controllers.parameters import read_parameters
from icing_env.atmosphere import G0
from icing_env.jit import kernel
from icing_env.types import Field, structured

GUIDANCE_FIELDS: list[Field] = [
    ("engaged", "0/1", "0 until the first step, which starts the integrators where the controls are"),
    ("altitude", "m", "altitude of the complementary filter"),
    ("climb_rate", "m/s", "vertical speed of the complementary filter"),
    ("airspeed", "m/s", "airspeed of the complementary filter"),
    ("climb_command", "m/s", "climb rate asked for now, slewed"),
    ("pitch_trim", "rad", "integrator of the climb-rate hold"),
    ("throttle_trim", "0..1", "integrator of the airspeed hold"),
    ("bank_command", "rad", "bank asked for now, slewed"),
]
GUIDANCE_GAINS_FIELDS: list[Field] = [
    ("qbar_reference", "Pa", "dynamic pressure at which the surface gains hold"),
    ("scale_min", "1", "least scaling of the surface gains"),
    ("scale_max", "1", "largest scaling of the surface gains"),
    ("K_climb", "1", "pitch command per error of the flight-path angle"),
    ("K_climb_integral", "1/s", "its integral"),
    ("K_altitude", "1/s", "climb-rate command per altitude error"),
    ("K_turn", "rad", "pitch added per excess load factor in a bank, at the reference dynamic pressure"),
    ("vertical_bandwidth", "rad/s", "natural frequency of the baro-inertial filter"),
    ("vertical_damping", "1", "damping of the baro-inertial filter"),
    ("airspeed_bandwidth", "rad/s", "bandwidth of the air-inertial filter"),
    ("K_airspeed", "s/m", "throttle per airspeed error"),
    ("K_airspeed_integral", "1/m", "throttle rate per airspeed error"),
    ("airspeed_gust", "m/s", "lack of airspeed that gusts make: full power for it does not hold the integral"),
    ("K_throttle_climb", "s/m", "throttle per climb-rate command"),
    ("K_speed_priority", "1", "climb rate allowed per airspeed above the limit"),
    ("K_heading", "1/s", "turn rate per heading error"),
    ("climb_max", "m/s", "largest climb and descent rate asked for"),
    ("climb_slew", "m/s2", "slew rate of the climb-rate command"),
    ("theta_min", "rad", "lowest pitch asked for"),
    ("theta_max", "rad", "highest pitch asked for"),
    ("alpha_margin", "rad", "distance kept from the advised alpha limit"),
    ("airspeed_margin", "m/s", "distance kept from the advised airspeed limit"),
    ("bank_margin", "rad", "distance kept from the advised bank limit"),
    ("pitch_margin", "rad", "distance kept from the advised pitch limit"),
    ("bank_max", "rad", "largest bank asked for"),
    ("bank_rate", "rad/s", "slew rate of the bank command"),
    ("elevator_min", "rad", "elevator limit, trailing edge up"),
    ("elevator_max", "rad", "elevator limit, trailing edge down"),
    ("aileron_max", "rad", "aileron limit, both ways"),
    ("rudder_max", "rad", "rudder limit, both ways"),
    ("throttle_min", "0..1", "flight idle"),
    ("throttle_max", "0..1", "largest power lever"),
]


def load_gains(name: str | Path, own: list[Field]) -> NDArray[Any]:
    """Gains of a law, one row: those of the outer loops, then its own.

    Args:
        name: the law's file within configs/controllers/, or a path; the outer loops have their own, guidance.toml.
        own: name, unit and meaning of every number of the law's file.

    Raises:
        InputError: a file that does not fit.
    """
    row = np.zeros(1, structured([*GUIDANCE_GAINS_FIELDS, *own]))
    for part in (read_parameters("guidance", GUIDANCE_GAINS_FIELDS), read_parameters(name, own)):
        for field in part.dtype.names or ():
            row[field] = part[field]
    return row


@kernel
def engage_guidance(a: Any, m: Any, t: Any, g: Any) -> None:
    """Start the outer loops where the controls are, so that engaging moves nothing."""
    a.engaged = 1.0
    a.altitude = m.altitude
    a.climb_rate = airspeed_of(m)*math.sin(m.theta - m.alpha*math.cos(m.phi))
    a.climb_command = a.climb_rate
    a.airspeed = m.airspeed
    a.pitch_trim = m.theta
    climb = 0.0 if t.pitch_mode == 0.0 else a.climb_rate
    a.throttle_trim = 0.5*(m.throttle_left + m.throttle_right) - g.K_throttle_climb*climb
    a.bank_command = m.phi


@kernel
def surface_scale(m: Any, g: Any) -> float:
    """Scaling of surface gains with dynamic pressure, within its bounds."""
    qbar = 0.5*air_density(m)*airspeed_of(m)*airspeed_of(m)
    return clip(g.qbar_reference/qbar, g.scale_min, g.scale_max)


@kernel
def navigate(a: Any, m: Any, g: Any, dt: float) -> None:
    """Complementary filters: acceleration integrated, corrected by pressure altitude and by pitot."""
    w = g.vertical_bandwidth
    cos_theta = math.cos(m.theta)
    up = m.ax*math.sin(m.theta) - (m.ay*math.sin(m.phi) + m.az*math.cos(m.phi))*cos_theta - G0
    error = m.altitude - a.altitude
    a.altitude += dt*(a.climb_rate + 2.0*g.vertical_damping*w*error)
    a.climb_rate += dt*(up + w*w*error)
    a.airspeed += dt*(airspeed_rate(m, G0) + g.airspeed_bandwidth*(m.airspeed - a.airspeed))


@kernel
def sustained(a: Any, adv: Any) -> float:
    """Climb rate [m/s] at which full power keeps the airspeed, where that is a descent; else 0."""
    return a.airspeed*min(adv.climb_spare, 0.0)


@kernel
def climb_command(a: Any, t: Any, adv: Any, g: Any, dt: float) -> float:
    """Climb rate asked for [m/s], slewed; it yields where the airspeed nears its limit."""
    wanted = t.climb_rate
    if t.pitch_mode == 1.0:
        wanted = g.K_altitude*(t.altitude - a.altitude)
    spare = g.K_speed_priority*(a.airspeed - adv.airspeed_limit - g.airspeed_margin) + sustained(a, adv)
    slew = g.climb_slew*dt
    a.climb_command += clip(clip(min(wanted, spare), -g.climb_max, g.climb_max) - a.climb_command, -slew, slew)
    return a.climb_command


@kernel
def turn_alpha(m: Any, g: Any, scale: float) -> float:
    """Angle of attack [rad] that the level turn at this bank needs beyond level flight."""
    return g.K_turn*scale*(1.0/max(math.cos(m.phi), 0.5) - 1.0)


@kernel
def pitch_command(a: Any, m: Any, t: Any, adv: Any, g: Any, climb: float, scale: float, dt: float) -> float:
    """Pitch angle asked for [rad], limited by the advised angle of attack."""
    low, high = g.theta_min, min(g.theta_max, adv.pitch_limit - g.pitch_margin)
    ceiling = clip(m.theta + adv.alpha_limit - g.alpha_margin - m.alpha, low, high)
    if t.pitch_mode == 0.0:
        a.pitch_trim = m.theta
        return clip(t.theta, low, ceiling)
    error = (climb - a.climb_rate)/airspeed_of(m)
    wanted = a.pitch_trim + g.K_climb*error + turn_alpha(m, g, scale)
    a.pitch_trim = integrated(a.pitch_trim, g.K_climb_integral*error*dt, wanted, low, ceiling)
    return clip(wanted, low, ceiling)


@kernel
def hold_airspeed(a: Any, c: Any, m: Any, t: Any, adv: Any, g: Any, climb: float, dt: float) -> None:
    """Both power levers.

    The integral is held at full power to which it, the climb and more than a gust's error have brought the levers, not
    where gusts take them there: an aircraft that needs much of its power would settle below its speed.
    """
    wanted = t.throttle
    if t.speed_mode == 1.0:
        error = max(t.airspeed, adv.airspeed_limit + g.airspeed_margin) - a.airspeed
        wanted = a.throttle_trim + g.K_airspeed*error + g.K_throttle_climb*climb
        held = wanted - g.K_airspeed*clip(error, 0.0, g.airspeed_gust)
        rate = g.K_airspeed_integral*error*dt
        a.throttle_trim = integrated(a.throttle_trim, rate, held, g.throttle_min, g.throttle_max)
    else:
        a.throttle_trim = t.throttle
    c.throttle_left = c.throttle_right = clip(wanted, g.throttle_min, g.throttle_max)


@kernel
def slew_bank(a: Any, wanted: float, adv: Any, g: Any, dt: float) -> bool:
    """Move the bank asked for towards `wanted` [rad], within the limits; True once it is there."""
    limit = max(min(g.bank_max, adv.bank_limit - g.bank_margin), 0.0)
    left = clip(wanted, -limit, limit) - a.bank_command
    slew = g.bank_rate*dt
    a.bank_command += clip(left, -slew, slew)
    return abs(left) <= slew


@kernel
def command_bank(a: Any, m: Any, t: Any, adv: Any, g: Any, dt: float) -> bool:
    """Move the bank asked for towards the target, within the limits; True once it is there."""
    wanted = t.phi
    if t.roll_mode == 1.0:
        wanted = math.atan(airspeed_of(m)*g.K_heading*wrapped(t.heading - m.psi)/G0)
    return slew_bank(a, wanted, adv, g, dt)


@kernel
def turn_pitch_rate(m: Any) -> float:
    """Pitch rate [rad/s] of the level turn at this bank: (g/V) sin phi tan phi."""
    return G0/airspeed_of(m)*math.sin(m.phi)*math.tan(clip(m.phi, -1.3, 1.3))


@kernel
def turn_yaw_rate(m: Any) -> float:
    """Yaw rate [rad/s] of the level turn at this bank: (g/V) sin phi cos theta."""
    return G0/airspeed_of(m)*math.sin(m.phi)*math.cos(m.theta)


@kernel
def guide(a: Any, c: Any, m: Any, t: Any, adv: Any, g: Any, scale: float, dt: float) -> float:
    """Outer loops of one step: power and flap into `c`, bank asked for into `a`; returns the pitch asked for [rad]."""
    navigate(a, m, g, dt)
    climb = 0.0 if t.pitch_mode == 0.0 else climb_command(a, t, adv, g, dt)
    theta = pitch_command(a, m, t, adv, g, climb, scale, dt)
    hold_airspeed(a, c, m, t, adv, g, climb, dt)
    c.flap = max(min(t.flap, adv.flap_limit), 0.0)
    return theta
