"""Power required against power available: whether the speed and height flown now can be kept.

Drag is what thrust leaves of acceleration and climb, D = T - m (V_dot + g sin gamma); full thrust is the measured
thrust over the power lever. Speed and height can be held where D is below it; the crew is told from 90 % on.
(Anderson, Aircraft Performance and Design, sections 5.4 and 5.9: specific excess power.)
"""

from __future__ import annotations

import math
from typing import Any

from controllers.kernels import airspeed_rate, clip
from icing_env.atmosphere import G0
from icing_env.jit import kernel
from icing_env.types import Field

POWER_FIELDS: list[Field] = [
    ("power_time", "s", "time constant of the share of the power available that level flight needs"),
    ("power_lacking", "1", "share from which power is lacking"),
    ("power_enough", "1", "share below which it no longer is"),
    ("power_lever", "0..1", "lever below which thrust says nothing about full power"),
]


@kernel
def sense_power(a: Any, m: Any, frame: Any, g: Any, dt: float) -> None:
    """Share of the power available that steady flight at this speed and height needs, and whether that is too much."""
    lever = 0.5*(m.throttle_left + m.throttle_right)
    thrust = m.thrust_left + m.thrust_right
    gamma = m.theta - m.alpha*math.cos(m.phi)
    drag = thrust - frame.mass*(airspeed_rate(m, G0) + G0*math.sin(gamma))
    share = drag*lever/thrust if lever > g.power_lever and thrust > 0.0 else 0.0
    if math.isfinite(share):
        a.power_share += (clip(share, 0.0, 2.0) - a.power_share)*(1.0 - math.exp(-dt/g.power_time))
    if a.power_share > g.power_lacking:
        a.power_lacking = 1.0
    elif a.power_share < g.power_enough:
        a.power_lacking = 0.0
