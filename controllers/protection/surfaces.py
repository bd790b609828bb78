"""Envelope protection between any controller and the actuators: angle of attack, airspeed, bank, flap.

One law for each: the angle or speed is predicted a little ahead from its measured rate, and the surface may not go
beyond the deflection that would bring the prediction to its limit. Far inside, the command passes bit by bit; near the
limit the corner is rounded; beyond it the surface follows the law alone. The elevator is only ever moved nose-down.

* alpha: elevator >= trim(alpha_limit) + K_alpha (alpha + lead alpha_rate - alpha_limit), where trim is the elevator
  that balances the pitching moment at the limit, -(Cm_0 + Cm_alpha alpha_limit + Cm_flap flap)/Cm_elevator
* airspeed: below airspeed_limit, predicted by its measured rate, nose-down elevator and power in proportion
* bank: aileron >= K_phi (phi + lead p - bank_limit) on the right, mirrored on the left
* flap <= flap_limit

Merret, Hossain & Bragg (AIAA 2002-0814) protect the same variables; the closed-loop limiting of Hossain et al.
(AIAA 2003-25) bounds the reference instead of the surface.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import airspeed_rate, alpha_rate, clip, positive_part
from controllers.parameters import read_parameters
from icing_env.atmosphere import G0
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

PROTECTION_FIELDS: list[Field] = [
    ("lead_alpha", "s", "prediction time of the angle of attack"),
    ("K_alpha", "1", "elevator per predicted excess of angle of attack"),
    ("Cm_flap", "1/rad", "pitching moment of the flap"),
    ("elevator_round", "rad", "half width of the rounded corner of the elevator limit"),
    ("elevator_max", "rad", "elevator limit, trailing edge down"),
    ("excitation_low", "1", "excitation below which the trim at the limit is that of the clean aircraft"),
    ("excitation_high", "1", "excitation above which it is that of the estimate"),
    ("lead_airspeed", "s", "prediction time of the airspeed"),
    ("K_airspeed", "rad s/m", "nose-down elevator per predicted lack of airspeed"),
    ("airspeed_elevator_max", "rad", "most nose-down elevator for lack of airspeed"),
    ("airspeed_round", "m/s", "half width of the rounded corner of the airspeed limit"),
    ("K_throttle", "s/m", "throttle per predicted lack of airspeed"),
    ("lead_bank", "s", "prediction time of the bank angle"),
    ("K_bank", "1", "aileron per predicted excess of bank"),
    ("aileron_round", "rad", "half width of the rounded corner of the aileron limit"),
    ("aileron_max", "rad", "aileron limit, both ways"),
]
PROTECTION = structured(PROTECTION_FIELDS)


def load_tuning(name: str | Path = "envelope_protection") -> NDArray[Any]:
    """Gains of the protection, one row of PROTECTION. Raises InputError for a file that does not fit."""
    return read_parameters(name, PROTECTION_FIELDS)


@kernel
def elevator_at_limit(a: Any, m: Any, e: Any, frame: Any, g: Any) -> float:
    """Elevator [rad] that balances the pitching moment at the advised angle of attack."""
    share = 0.0
    if e.health == 1.0:
        share = clip((e.excitation_longitudinal - g.excitation_low)/(g.excitation_high - g.excitation_low), 0.0, 1.0)
    cm_0 = frame.Cm_0 + g.Cm_flap*m.flap
    cm_alpha, cm_elevator = frame.Cm_alpha, frame.Cm_elevator
    if share > 0.0 and e.Cm_elevator < 0.5*frame.Cm_elevator:
        cm_0 += share*(e.Cm_0 - cm_0)
        cm_alpha += share*(e.Cm_alpha - cm_alpha)
        cm_elevator += share*(e.Cm_elevator - cm_elevator)
    return clip(-(cm_0 + cm_alpha*a.alpha_limit)/cm_elevator, -g.elevator_max, g.elevator_max)


@kernel
def airspeed_lack(a: Any, m: Any, g: Any) -> float:
    """How far the predicted airspeed is below its limit [m/s], 0 above it."""
    predicted = m.airspeed + g.lead_airspeed*airspeed_rate(m, G0)
    return positive_part(a.airspeed_limit - predicted, g.airspeed_round)


@kernel
def protect_pitch(c: Any, a: Any, m: Any, e: Any, frame: Any, g: Any) -> None:
    """Angle of attack and airspeed, through elevator and power."""
    predicted = m.alpha + g.lead_alpha*alpha_rate(m, G0)
    least = elevator_at_limit(a, m, e, frame, g) + g.K_alpha*(predicted - a.alpha_limit)
    wanted = c.elevator
    change = positive_part(min(least, g.elevator_max) - wanted, g.elevator_round)
    lack = airspeed_lack(a, m, g)
    if lack > 0.0:
        change += min(g.K_airspeed*lack, g.airspeed_elevator_max)
        power = g.K_throttle*lack
        c.throttle_left = max(c.throttle_left, min(c.throttle_left + power, 1.0))
        c.throttle_right = max(c.throttle_right, min(c.throttle_right + power, 1.0))
    if change > 0.0:
        c.elevator = max(wanted, min(wanted + change, g.elevator_max))
    a.intervention = c.elevator - wanted


@kernel
def protect_bank(c: Any, a: Any, m: Any, g: Any) -> None:
    """Bank, through the aileron (positive rolls left)."""
    predicted = m.phi + g.lead_bank*m.p
    least = min(g.K_bank*(predicted - a.bank_limit), g.aileron_max)
    most = max(g.K_bank*(predicted + a.bank_limit), -g.aileron_max)
    raised = positive_part(least - c.aileron, g.aileron_round)
    lowered = positive_part(c.aileron - most, g.aileron_round)
    a.intervention_aileron = raised - lowered
    if raised > 0.0 or lowered > 0.0:
        c.aileron = c.aileron + raised - lowered


def init(n: int) -> NDArray[Any]:
    """Memory of `n` aircraft: this protection has none."""
    return np.zeros(n)


@entry
def protect(memory: NDArray[Any], command: NDArray[Any], advisory: NDArray[Any], measurement: NDArray[Any],
            estimate: NDArray[Any], airframe: NDArray[Any], tuning: NDArray[Any], dt: float) -> None:
    """Keep every aircraft inside its advised envelope: changes `command` and the advisory's `intervention` in place.

    Args:
        memory: of `init`, not used.
        command: COMMAND rows as the controller wants them; changed only near or beyond a limit.
        advisory: ADVISORY rows with the limits.
        measurement: MEASUREMENT rows.
        estimate: ESTIMATE rows.
        airframe: one row for all or one per aircraft, with the clean `Cm_0`, `Cm_alpha` and `Cm_elevator`.
        tuning: one PROTECTION row for all, or one per aircraft.
        dt: time since the last step [s]; the law has no memory and does not use it.
    """
    for i in range(len(command)):
        c, a, m, e = command[i], advisory[i], measurement[i], estimate[i]
        frame = airframe[i if len(airframe) > 1 else 0]
        g = tuning[i if len(tuning) > 1 else 0]
        protect_pitch(c, a, m, e, frame, g)
        protect_bank(c, a, m, g)
        c.flap = min(c.flap, a.flap_limit)
