"""What faults mostly are where they are not as the library has them: explicit, and weighed as that.

A lag of second order instead of first, a gear that bends instead of one that is a line; air that is denser with height
or rises unevenly, where the library has a constant; drag that is there and grows, where it has one at a time. Whatever
generic terms at home could do is forgiven by as much as the library's own form explains, which of a gear whose cube
undoes its line, or of a servo that overshoots, is little.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.actuators.second_order import DAMPING, DAMPINGS, FREQUENCY, SecondOrder, second_order
from sim2real.flown.points import Flying, rows_of
from sim2real.flown.steps import Point
from sim2real.library.bends import DRAG, bends, changes, grows
from sim2real.posterior.generic import UnknownFit, fit_some_left
from sim2real.posterior.sets import SetFit
from sim2real.records.channels import SURFACES
from sim2real.signatures.whitening import SETTLE


def usual_form(flying: Flying, fit: SetFit, point: Point, left: FloatArray) -> UnknownFit | None:
    """A set with its faults in these forms, where that leaves less; all told, and what is left.

    Args:
        point: where the set was flown.
        left: of `Remainder.reduced` there.
    """
    found = [*_lags(flying, fit, point), *_bent(flying, fit, left)]
    if not found:
        return None
    gained, taken = (sum(getattr(u, of) for u in found) for of in ("log_evidence", "misfit"))
    weights = {row: w for u in found for row, w in u.weights.items()}
    return UnknownFit(found[0].component, fit.log_evidence + gained, tuple(term for u in found for term in u.terms),
                      fit.misfit + taken, weights)  # fmt: skip


def _lags(flying: Flying, fit: SetFit, point: Point) -> list[UnknownFit]:
    """Actuators of second order for every lag: evidence and misfit more than the set's.

    The lag that the set has pays for the frequency, a damping as likely anywhere in its range for itself.
    """
    late = [surface for surface in SURFACES if f"{surface}_lag" in fit.effects]
    if not late:
        return []
    flights, first = flying.flights, round(SETTLE / flying.flights[0].dt)
    still = np.zeros(len(point.sizes))
    rows = [rows_of(f, flying.candidates, fit, point.sizes, still, point.nuisances)[:1] for f in flights]
    found = {surface: second_order(flights, rows, surface, first) for surface in late}
    return [_told(surface, actuator, flying.tempering) for surface, actuator in found.items() if actuator is not None]


def _told(surface: str, actuator: SecondOrder, tempering: float) -> UnknownFit:
    gain = actuator.gain / tempering
    error, broad = actuator.errors, float(np.sqrt(tempering))
    width = np.sqrt(2.0 * np.pi) * broad * error[1] / (DAMPINGS[1] - DAMPINGS[0])
    terms = ((f"{surface} {DAMPING}", actuator.damping, broad * error[1]),
             (f"{surface} {FREQUENCY}", actuator.frequency, broad * error[0]))  # fmt: skip
    return UnknownFit(f"{surface}_path", 0.5 * gain + float(np.log(min(width, 1.0))), terms, -gain, {})


def _bent(flying: Flying, fit: SetFit, left: FloatArray) -> list[UnknownFit]:
    """Gears that bend where a surface has no lag, and what grows: evidence and misfit more than the set's."""
    own = [bends(f.effect) for f in fit.families if grows(f.effect) or changes(f.effect) == DRAG
           or (f.effect.name.endswith("_gearing") and f.effect.name.replace("_gearing", "_lag") not in fit.effects)]
    found = [fit_some_left(left, flying.candidates, terms) for terms in own]
    return [replace(u, misfit=u.misfit - float(left[0, 0])) for u in found if u is not None and u.log_evidence > 0.0]
