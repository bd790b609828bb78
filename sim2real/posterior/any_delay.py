"""Something unknown on an actuator's path: it answers late. Paths have no free course of time; this is what they have.

One number, no more, and it has to say all: whatever lag, gearing and generic terms do together would do for any
actuator, and an actuator of second order is late too, by a part.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from sim2real.actuators.lateness import LONGEST, Late
from sim2real.library.terms import PURE_DELAY
from sim2real.posterior.form import FORGIVEN
from sim2real.posterior.generic import UnknownFit


def late_fits(found: Mapping[str, Late], misfit: float, tempering: float, taken: Collection[str] = ()
              ) -> list[UnknownFit]:  # fmt: skip
    """Evidence of a delay on each path, any up to the longest as likely, over what is left without.

    Args:
        found: of `lateness`.
        misfit: whitened square that is left without, tempered.
        taken: components that something known enters at: what is late there is its affair.
    """
    out = []
    for component, late in found.items():
        if component not in taken and late.left < FORGIVEN**2:
            gain, error = late.gain / tempering, late.error * float(np.sqrt(tempering))
            chance = float(np.log(min(np.sqrt(2.0 * np.pi) * error / LONGEST, 1.0)))
            term = (PURE_DELAY, late.delay, error)
            out.append(UnknownFit(component, 0.5 * gain + chance, (term,), misfit - gain, {}))
    return out


def is_delay(unknown: UnknownFit) -> bool:
    """Whether it is a delay: that says all of a path, so that an effect that says a part of it is not what it is."""
    return unknown.terms[0][0] == PURE_DELAY
