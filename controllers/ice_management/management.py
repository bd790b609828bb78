"""The ice management system: its functions in their order, over rows of aircraft.

It sees measurements and estimates only. The four functions of Bragg et al. (AIAA-2000-0360): `sense` and characterise
the ice, `operate` the ice protection, `limits` of the envelope, adapt the control laws; and tell the crew, for which
`power` is judged apart because it looks at what is asked for.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.ice_management.limits import limit_envelope
from controllers.ice_management.operate import operate_protection
from controllers.ice_management.sense import characterise
from controllers.ice_management.upsets import limit_flap, sense_upsets
from icing_env.jit import entry
from icing_env.types import ADVISORY


def init(n: int) -> NDArray[Any]:
    """Advisories for `n` aircraft before the first step: no ice, nothing limited (ADVISORY rows)."""
    advisory = np.zeros(n, ADVISORY)
    for name in ("alpha_limit", "bank_limit", "flap_limit", "pitch_limit"):
        advisory[name] = 0.5 * math.pi
    advisory["load_factor_limit"] = 10.0  # beyond any structure
    return advisory


@entry
def step(
    advisory: NDArray[Any],
    estimate: NDArray[Any],
    measurement: NDArray[Any],
    airframe: NDArray[Any],
    tuning: NDArray[Any],
    dt: float,
) -> None:
    """One step of every ice management, in place.

    Args:
        advisory: ADVISORY rows, one per aircraft; what they held before is the memory.
        estimate: ESTIMATE rows.
        measurement: MEASUREMENT rows.
        airframe: one row for all or one per aircraft, with `wing_area` m2, `mass` kg, `alpha_stall` rad and the clean
            derivatives by name.
        tuning: one IMS_TUNING row for all, or one per aircraft.
        dt: time since the last step [s].
    """
    for i in range(len(advisory)):
        a, e, m = advisory[i], estimate[i], measurement[i]
        frame = airframe[i if len(airframe) > 1 else 0]
        g = tuning[i if len(tuning) > 1 else 0]
        characterise(a, e, frame, g, dt)
        operate_protection(a, m, g, dt)
        sense_upsets(a, m, frame, g, dt)
        limit_envelope(a, m, e, frame, g, dt)
        limit_flap(a, m, e, frame, g)
