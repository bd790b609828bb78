"""Power required against power available: whether the speed asked for can be kept at this height and bank.

* drag is what thrust leaves of acceleration and climb, D = T - m (V_dot + g sin gamma); full thrust is the measured
  thrust over the power lever (Anderson, Aircraft Performance and Design, sections 5.4 and 5.9: specific excess power)
* both are carried to the speed that is asked for, or an aircraft that has slowed down for want of power would seem to
  have enough: D(V_a) = (D - D_i) r^2 + D_i/r^2, r = V_a/V, with the clean polar's drag due to lift D_i; the thrust of a
  given power goes as 1/sqrt(V^2 + V_s^2) (`icing_env.propulsion`)

Speed and height can be held where D is below full thrust; the crew is told from 90 % on.
"""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from controllers.kernels import air_density, airspeed_of, airspeed_rate, clip
from icing_env.atmosphere import G0
from icing_env.jit import entry, kernel
from icing_env.types import Field

POWER_FIELDS: list[Field] = [
    ("power_time", "s", "time constant of the share of the power available that level flight needs"),
    ("power_start", "s", "least time constant, at the start of a flight"),
    ("power_lacking", "1", "share from which power is lacking"),
    ("power_enough", "1", "share below which it no longer is"),
    ("power_lever", "0..1", "lever below which thrust says nothing about full power"),
    ("power_carry", "1", "largest ratio of the speed asked for to that flown, and of the other way round"),
]


@kernel
def lift_drag(m: Any, frame: Any) -> float:
    """Drag due to lift [N] of the clean polar at the measured angle of attack."""
    ca, sa = math.cos(m.alpha), math.sin(m.alpha)
    axial = frame.CX_0 + m.alpha*(frame.CX_alpha + m.alpha*frame.CX_alpha2)
    zero = frame.CZ_0/(frame.CX_0 - frame.CZ_alpha)  # angle of no lift, `testbed.oracle.zero_lift_drag`
    least = -(frame.CX_0 + zero*(frame.CX_alpha + zero*frame.CX_alpha2))/math.cos(zero)
    speed = airspeed_of(m)
    pressure = 0.5*air_density(m)*speed*speed*frame.wing_area
    return pressure*max(-axial*ca - (frame.CZ_0 + frame.CZ_alpha*m.alpha)*sa - least, 0.0)


@kernel
def sense_power(a: Any, m: Any, t: Any, frame: Any, g: Any, dt: float) -> None:
    """Share of the power available that steady flight at the speed asked for needs, and whether that is too much."""
    lever = 0.5*(m.throttle_left + m.throttle_right)
    thrust = m.thrust_left + m.thrust_right
    gamma = m.theta - m.alpha*math.cos(m.phi)
    drag = thrust - frame.mass*(airspeed_rate(m, G0) + G0*math.sin(gamma))
    speed, still = airspeed_of(m), frame.propeller_static_speed
    asked = t.airspeed if t.speed_mode == 1.0 and t.airspeed > 0.0 else speed
    asked = clip(asked, speed/g.power_carry, speed*g.power_carry)
    ratio, lift = (asked/speed)*(asked/speed), lift_drag(m, frame)
    carried = (drag - lift)*ratio + lift/ratio
    full = math.sqrt((speed*speed + still*still)/(asked*asked + still*still))
    share = carried*lever/(thrust*full) if lever > g.power_lever and thrust > 0.0 else 0.0
    if math.isfinite(share):
        time = clip(m.time, g.power_start, g.power_time)
        a.power_share += (clip(share, 0.0, 2.0) - a.power_share)*(1.0 - math.exp(-dt/time))
    if a.power_share > g.power_lacking:
        a.power_lacking = 1.0
    elif a.power_share < g.power_enough:
        a.power_lacking = 0.0


@entry
def judge(advisory: NDArray[Any], measurement: NDArray[Any], target: NDArray[Any], airframe: NDArray[Any],
          tuning: NDArray[Any], dt: float) -> None:
    """Whether the power suffices, for every aircraft: `power_lacking` of `advisory`, in place.

    Args:
        advisory: ADVISORY rows.
        measurement: MEASUREMENT rows.
        target: TARGET rows: which airspeed is asked for, where `speed_mode` says that one is.
        airframe: PARAMETERS rows of the clean aircraft, one for all or one each.
        tuning: one IMS_TUNING row for all, or one per aircraft.
        dt: time since the last step [s].
    """
    for i in range(len(advisory)):
        frame = airframe[i if len(airframe) > 1 else 0]
        sense_power(advisory[i], measurement[i], target[i], frame, tuning[i if len(tuning) > 1 else 0], dt)
