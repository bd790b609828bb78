"""How free a flown set is to be of another form than the library's: what terms and courses of time at home may take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from icing_env.record import FloatArray
from sim2real.flown.other_form import Bent, flown_squares
from sim2real.flown.points import Flying
from sim2real.library.terms import in_what_is_left
from sim2real.posterior.form import (
    FORGIVEN,
    UNKNOWN_FORGIVEN,
    Liberty,
    energies,
    home,
    may_bend,
    own_terms,
    room,
    squares,
)
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import Posterior
from sim2real.posterior.sets import SetFit
from sim2real.signatures.courses import Remainder

FEW_PLACES = 5  # components at which courses of time are freed together


@dataclass(frozen=True)
class AtLiberty:
    """A set that was flown.

    nothing: whitened square that no explanation leaves; missed: that the set leaves more without each of its members,
    infinite where that is not known.
    """

    flying: Flying
    linear: Posterior
    fit: SetFit
    nothing: float
    missed: Sequence[float]

    def room(self, flown: Bent) -> tuple[list[int], FloatArray]:
        """Rows of the generic terms at home in what the set leaves, and what `room` there is for each.

        Args:
            flown: where, and what it leaves there.
        """
        bank, raw, fit, left = self.flying.candidates, self.linear.raw, self.fit, flown.left.reduced()
        own = own_terms(fit.effects, in_what_is_left(bank.terms))
        rows = [term.row for term in own]
        whole = raw.diagonal()[[bank.terms[row - 1].row for row in rows]]
        kept = left.diagonal()[rows] / np.maximum(whole, 1e-9)
        # by slope or bank, the less: polynomials bend between sizes, and slopes are not those of smaller ones
        by_slope = flown_squares(fit, flown)
        reduced = squares(fit, self.linear.reduced)
        beyond = energies(list(map(min, by_slope[0], reduced)), self.nothing - fit.misfit, self.missed)
        bending = may_bend(beyond, list(map(min, by_slope[1], squares(fit, raw))))
        return rows, room(fit, reduced, bending, own, kept, self.nothing, self.missed)

    def explained(self) -> list[float]:
        """Whitened square that each member explains (`form.energies`)."""
        own = squares(self.fit, self.linear.reduced)
        return energies(own, max(self.nothing - self.fit.misfit, 0.0), self.missed)

    def free(self, left: Remainder, beside: UnknownFit | None = None) -> tuple[Liberty, ...]:
        """What free courses of time would take: at home of each effect, or where something unknown is; then at all.

        What a member may leave there goes with what it explains: one that explains little would else be named for the
        freedom of its home.
        """
        each = [home((family.effect.name,)) for family in self.fit.families]
        most = [FORGIVEN**2 * square for square in self.explained()]
        whole = float(left.reduced()[0, 0])
        rest = whole if beside is None else beside.left
        if beside is not None:
            each, most = [*each, {beside.component}], [*most, UNKNOWN_FORGIVEN**2 * (whole - beside.misfit)]

        def at(places: set[str], most: float) -> Liberty:
            free = max(self.flying.courses.free(left, places) - (whole - rest), 0.0)
            return Liberty(free, len(places), most, rest - free)

        found = [at(*one) for one in zip(each, most, strict=True)]
        all_of_them = set().union(*each)
        if len(each) > 1 and len(all_of_them) <= FEW_PLACES:
            found.append(at(all_of_them, sum(min(one.free, one.most) for one in found)))
        return tuple(found)
