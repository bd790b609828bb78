"""Two PT6A turboprops with constant-speed propellers.

* shaft power asked for: throttle x rated power x (1 - a (1 - delta) - b (1 - delta)^2), delta the pressure ratio
  (power lapse; a and b fitted to the PT6A-27 table of JSBSim: 2135 psf 1.0, 1684 .85, 1496 .779, 1048 .586)
* spool: first-order lag of the shaft power
* thrust: T = e eta P / sqrt(V^2 + V_s^2): efficiency eta at speed, static thrust eta P / V_s (McCormick, chapter 6:
  the constant-speed propeller between static and cruise; V_s assumed constant), e the loss by ice on the blades
* torque from power and the governed speed of rotation
"""

from __future__ import annotations

import math
from typing import Any

from icing_env.atmosphere import P0
from icing_env.jit import kernel
from icing_env.types import Field

PROPULSION_PARAMETERS: list[Field] = [
    ("power_rated", "W", "shaft power of one engine, full throttle, sea level"),
    ("power_lapse", "1", "a: loss of power with pressure, linear"),
    ("power_lapse2", "1", "b: loss of power with pressure, quadratic"),
    ("propeller_efficiency", "1", "efficiency at speed"),
    ("propeller_static_speed", "m/s", "V_s: static thrust is efficiency times power over it"),
    ("spool_time", "s", "time constant of the shaft power"),
    ("propeller_rpm", "1/min", "governed speed of rotation"),
    ("engine_arm_y", "m", "engine to the plane of symmetry"),
    ("engine_arm_z", "m", "thrust line below the c.g. (above: negative)"),
    ("thrust_factor_left", "1", "thrust of the left propeller over nominal"),
    ("thrust_factor_right", "1", "thrust of the right propeller over nominal"),
]


@kernel
def power_available(pressure: float, p: Any) -> float:
    """Shaft power [W] of one engine at full throttle and a static pressure [Pa]."""
    loss = 1.0 - pressure*(1.0/P0)
    return p.power_rated*(1.0 - loss*(p.power_lapse + p.power_lapse2*loss))


@kernel
def thrust_per_power(airspeed: float, c: Any, p: Any) -> float:
    """Thrust of one propeller per shaft power [N/W] at an axial airspeed [m/s]."""
    vs = p.propeller_static_speed
    return c.efficiency*p.propeller_efficiency/math.sqrt(airspeed*airspeed + vs*vs)


@kernel
def torque(power: float, p: Any) -> float:
    """Shaft torque [N m] at the governed speed."""
    return power*60.0/(2.0*math.pi*p.propeller_rpm)
