"""Envelope protection between any controller and the actuators: angle of attack, airspeed, bank, flap.

One law for each: the angle or speed is predicted a little ahead from its measured rate, and the surface may not go
beyond the deflection that would bring the prediction to its limit. Far inside, the command passes bit by bit; near the
limit the corner is rounded; beyond it the surface follows the law alone. The elevator is only ever moved nose-down,
but for a tailplane stall.

* alpha: elevator >= trim(alpha_limit) + K_alpha (alpha + lead alpha_rate - alpha_limit), where trim is the elevator
  that balances the pitching moment at the limit, -(Cm_0 + Cm_alpha alpha_limit + Cm_flap flap)/Cm_elevator
* bank: aileron >= K_phi (phi + lead p - bank_limit) on the right, mirrored on the left
* flap <= flap_limit; airspeed, power, recoveries: `controllers.protection.common`

Merret, Hossain & Bragg (AIAA 2002-0814) protect the same variables; the closed-loop limiting of Hossain et al.
(AIAA 2003-25) bounds the reference instead of the surface.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import alpha_rate, clip
from controllers.parameters import read_parameters
from controllers.protection.common import COMMON_FIELDS, keep_pitch, keep_roll, pitching_moment
from icing_env.atmosphere import G0
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

PROTECTION_FIELDS: list[Field] = [
    *COMMON_FIELDS,
    ("lead_alpha", "s", "prediction time of the angle of attack"),
    ("K_alpha", "1", "elevator per predicted excess of angle of attack"),
    ("lead_bank", "s", "prediction time of the bank angle"),
    ("K_bank", "1", "aileron per predicted excess of bank"),
]
PROTECTION = structured(PROTECTION_FIELDS)


def load_tuning(name: str | Path = "envelope_protection") -> NDArray[Any]:
    """Gains of the protection, one row of PROTECTION. Raises InputError for a file that does not fit."""
    return read_parameters(name, PROTECTION_FIELDS)


@kernel
def least_elevator(a: Any, m: Any, e: Any, frame: Any, g: Any) -> float:
    """Elevator [rad] that may not be undercut: what balances at the advised alpha, and more as that comes near."""
    cm_0, cm_alpha, cm_elevator = pitching_moment(m, e, frame, g)
    balance = clip(-(cm_0 + cm_alpha*a.alpha_limit)/cm_elevator, -g.elevator_max, g.elevator_max)
    predicted = m.alpha + g.lead_alpha*alpha_rate(m, G0)
    return balance + g.K_alpha*(predicted - a.alpha_limit)


@kernel
def protect_row(c: Any, a: Any, m: Any, e: Any, frame: Any, g: Any) -> None:
    """Every limit of one aircraft."""
    keep_pitch(c, a, m, least_elevator(a, m, e, frame, g), g)
    predicted = m.phi + g.lead_bank*m.p
    keep_roll(c, a, g.K_bank*(predicted - a.bank_limit), g.K_bank*(predicted + a.bank_limit), g)
    c.flap = min(c.flap, a.flap_limit)


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
        frame = airframe[i if len(airframe) > 1 else 0]
        protect_row(command[i], advisory[i], measurement[i], estimate[i], frame, tuning[i if len(tuning) > 1 else 0])
