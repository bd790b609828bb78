"""A lag that is a servo of second order, in words of its own: how fast it is, and how it is damped.

Told beside the effect, and not flown: the actuators of `icing_env` are of first order, and what the records' other form
leaves of a lag is flown as the generic terms of its path.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim2real.actuators.second_order import DAMPING, FREQUENCY
from sim2real.closing.discrepancy import SHOWN, Description
from sim2real.posterior.form import WORTH
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.records.channels import SURFACES


def servos(explained: Hypothesis) -> tuple[Description, ...]:
    """Frequency and damping of every actuator that is of second order, where they say much that a lag does not.

    Args:
        explained: a hypothesis with what says it better than the library's form of its effects, if anything does.
    """
    instead = explained.instead
    if instead is None or explained.fit.misfit - instead.misfit < 2.0 * WORTH:
        return ()
    told = [_told(surface, instead.terms) for surface in SURFACES]
    return tuple(servo for servo in told if servo.terms and abs(servo.terms[0][1]) > SHOWN * servo.terms[0][2])


def _told(surface: str, terms: Sequence[tuple[str, float, float]]) -> Description:
    """Those of one surface, the damping first."""
    own = {name: (name.removeprefix(f"{surface} "), size, error) for name, size, error in terms}
    told = tuple(own[name] for name in (f"{surface} {DAMPING}", f"{surface} {FREQUENCY}") if name in own)
    return Description(f"{surface}_path", told, {}, np.diag([error**2 for _, _, error in told]))
