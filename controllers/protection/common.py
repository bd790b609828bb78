"""What every way of keeping the limits shares: the moment at the limit, airspeed and power, tail and roll recovery.

* moments: those of the clean aircraft, or of the estimate as far as the elevator has excited it
* airspeed: below airspeed_limit, predicted by its measured rate, nose-down elevator and power in proportion
* tailplane stall: stick back in proportion to the separated share that the hinge moment shows; the flap limit comes
  down with it, power stays (NASA tailplane icing programme)
* roll upset: power up; the limits of alpha and bank have come in, so that the aileron law rolls level
"""

from __future__ import annotations

from typing import Any

from controllers.kernels import airspeed_rate, clip, positive_part
from icing_env.atmosphere import G0
from icing_env.jit import kernel
from icing_env.types import Field

COMMON_FIELDS: list[Field] = [
    ("Cm_flap", "1/rad", "pitching moment of the flap"),
    ("elevator_round", "rad", "half width of the rounded corner of the elevator limit"),
    ("elevator_min", "rad", "elevator limit, trailing edge up"),
    ("elevator_max", "rad", "elevator limit, trailing edge down"),
    ("excitation_low", "1", "excitation below which derivatives are those of the clean aircraft"),
    ("excitation_high", "1", "excitation above which they are those of the estimate"),
    ("ratio_low", "1", "derivative over its clean value from which an estimate is believed"),
    ("ratio_high", "1", "up to which it is"),
    ("ratio_fade", "1", "width over which the belief fades in and out"),
    ("lead_airspeed", "s", "prediction time of the airspeed"),
    ("K_airspeed", "rad s/m", "nose-down elevator per predicted lack of airspeed"),
    ("airspeed_elevator_max", "rad", "most nose-down elevator for lack of airspeed"),
    ("airspeed_round", "m/s", "half width of the rounded corner of the airspeed limit"),
    ("K_throttle", "s/m", "throttle per predicted lack of airspeed"),
    ("aileron_round", "rad", "half width of the rounded corner of the aileron limit"),
    ("aileron_max", "rad", "aileron limit, both ways"),
    ("tail_stick", "rad", "stick back, as elevator, with the tailplane separated by tail_share"),
    ("tail_share", "1", "separated share of the tailplane at which all of it is given"),
    ("upset_throttle", "0..1", "least power in a roll upset"),
]


@kernel
def trust(excitation: float, health: float, g: Any) -> float:
    """Share 0..1 of the estimate in what is believed of the derivatives."""
    if health != 1.0:
        return 0.0
    return clip((excitation - g.excitation_low)/(g.excitation_high - g.excitation_low), 0.0, 1.0)


@kernel
def plausible(ratio: float, g: Any) -> float:
    """1 where a derivative over its clean value is one that ice or another aircraft of the type can have, fading to 0.

    Gusts that the tail meets late make derivatives of the wrong sign or thrice their size; ice multiplies by 0.3 to 1.
    """
    inside = min(ratio - g.ratio_low, g.ratio_high - ratio)
    return clip(inside/g.ratio_fade, 0.0, 1.0)


@kernel
def pitching_moment(m: Any, e: Any, frame: Any, g: Any) -> tuple[float, float, float]:
    """Cm at alpha and elevator zero, with flap, and its slopes with alpha and elevator, as believed now."""
    cm_0 = frame.Cm_0 + g.Cm_flap*m.flap
    cm_alpha, cm_elevator = frame.Cm_alpha, frame.Cm_elevator
    share = trust(e.excitation_longitudinal, e.health, g)
    share *= plausible(e.Cm_alpha/cm_alpha, g)*plausible(e.Cm_elevator/cm_elevator, g)
    if share > 0.0:
        cm_0 += share*(e.Cm_0 - cm_0)
        cm_alpha += share*(e.Cm_alpha - cm_alpha)
        cm_elevator += share*(e.Cm_elevator - cm_elevator)
    return cm_0, cm_alpha, cm_elevator


@kernel
def stick_back(a: Any, g: Any) -> float:
    """Elevator [rad] taken off the command while the tailplane stalls."""
    return a.tail_stall*g.tail_stick*clip(a.tail_share/g.tail_share, 0.0, 1.0)


@kernel
def airspeed_lack(a: Any, m: Any, g: Any) -> float:
    """How far the predicted airspeed is below its limit [m/s], 0 above it."""
    predicted = m.airspeed + g.lead_airspeed*airspeed_rate(m, G0)
    return positive_part(a.airspeed_limit - predicted, g.airspeed_round)


@kernel
def give_power(c: Any, a: Any, lack: float, g: Any) -> None:
    """Power for what lacks of airspeed [m/s], and in a roll upset; never less than was asked for."""
    more, least = g.K_throttle*lack, g.upset_throttle*a.roll_upset
    if not (more > 0.0 or least > 0.0):
        return
    c.throttle_left = max(c.throttle_left, min(max(c.throttle_left + more, least), 1.0))
    c.throttle_right = max(c.throttle_right, min(max(c.throttle_right + more, least), 1.0))


@kernel
def keep_pitch(c: Any, a: Any, m: Any, least: float, g: Any) -> None:
    """Elevator no further up than `least`, and further down for lack of airspeed; power; stick back on tail stall."""
    wanted = c.elevator
    held = max(wanted - stick_back(a, g), min(g.elevator_min, wanted))
    change = positive_part(min(least, g.elevator_max) - held, g.elevator_round)
    lack = airspeed_lack(a, m, g)
    change += (1.0 - a.tail_stall)*min(g.K_airspeed*lack, g.airspeed_elevator_max)
    give_power(c, a, lack, g)
    if change > 0.0:
        held = max(held, min(held + change, g.elevator_max))
    c.elevator = held
    a.intervention = held - wanted


@kernel
def keep_roll(c: Any, a: Any, least: float, most: float, g: Any) -> None:
    """Aileron between `least` and `most`, with rounded corners (positive rolls left)."""
    raised = positive_part(min(least, g.aileron_max) - c.aileron, g.aileron_round)
    lowered = positive_part(c.aileron - max(most, -g.aileron_max), g.aileron_round)
    a.intervention_aileron = 0.0
    if raised > 0.0 or lowered > 0.0:
        a.intervention_aileron = raised - lowered
        c.aileron = c.aileron + raised - lowered
