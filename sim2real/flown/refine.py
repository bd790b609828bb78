"""The leading explanations flown about their own fitted sizes and nuisances, before they are reported.

Polynomials between the sizes flown, and signatures that add, hold only nearby: where an effect is large or bends (a
rate limit, a stall), what the polynomial misses would be blamed on a second effect. Each leading set is therefore flown
where it was fitted, with its own slopes, and fitted by Gauss-Newton; its evidence is corrected by what it gained or
lost. Beside the best single effects, where they were flown, the whole library is then tried again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from icing_env.record import FloatArray
from sim2real.flown.beside_unknown import accompanied
from sim2real.flown.companions import companions, leading, together, told_by_paths, without
from sim2real.flown.corrections import corrected, inherited, lost
from sim2real.flown.liberty import AtLiberty
from sim2real.flown.other_form import Bent, flown_unknown, other_form
from sim2real.flown.points import Flying
from sim2real.flown.steps import Places, Point
from sim2real.flown.usual_form import usual_form
from sim2real.posterior.any_course import beside, wander_fits, with_courses
from sim2real.posterior.any_delay import late_fits
from sim2real.posterior.forgiveness import forgive
from sim2real.posterior.form import OTHER_FORM, SHARES, WORTH, Form, home, shares, with_terms
from sim2real.posterior.generic import UnknownFit, fit_unknown_left
from sim2real.posterior.home_terms import given
from sim2real.posterior.hypotheses import Hypothesis, Posterior, Settled, is_home, normalised
from sim2real.posterior.likeness import SHAPE, alike, split
from sim2real.posterior.prior import set_prior, unknown_prior
from sim2real.posterior.sets import SetFit
from sim2real.signatures.courses import Remainder
from sim2real.signatures.tempering import noise

TRIED = 3  # components whose generic terms are flown beside nothing
MOST = 12  # explanations flown again; what looks better then and has not been flown is not believed
PART = 0.1  # of what a set is more probable than nothing (in logarithms), that an effect flown for its sake is alone
TAKEN = 4.0  # whitened square above luck, that generic terms take of what leaves room for a companion (assumed)


def refine(flying: Flying, start: Callable[[Hypothesis], FloatArray], posterior: Posterior, places: Places,
           before: Hypothesis | None = None) -> Posterior:  # fmt: skip
    """The posterior with its leading explanations fitted where they lie, until the best of them has been flown.

    Args:
        start: nuisances [n] that a hypothesis is settled from.
        places: where sets settled before: they are settled from there; added to.
        before: what was best when these were flown last: it is flown again, whatever the linear fit says of it now.
    """
    search = _Search(flying, start, posterior, places)
    search.fly([search.nothing_at_all(), *(search.found.index(h) for h in leading(posterior))])
    if before is not None and before.effects:
        search.fly([search.propose(before.fit)])
    search.fly(search.companions())
    while (following := search.following()) is not None:
        search.fly([following])
    return search.posterior()


class _Search:
    """Hypotheses, as they are known so far, and those of them that have been flown."""
    def __init__(self, flying: Flying, start: Callable[[Hypothesis], FloatArray], posterior: Posterior,
                 places: Places) -> None:  # fmt: skip
        self.flying, self.start, self.linear, self.places = flying, start, posterior, places
        self.found = list(posterior.hypotheses)
        self.before = list(self.found)  # as the linear fit has them
        self.points: dict[int, Point] = {}
        self.left: dict[int, Remainder] = {}
        self.bent: dict[int, Bent] = {}
        self.generic: dict[int, list[UnknownFit]] = {}
        self.beginning: dict[int, FloatArray] = {}  # nuisances that sets within a flown one start from
        self.added: set[int] = set()  # proposed beside a flown one: no linear fit to correct others by
        self.nothing = self.own_numbers = float(posterior.reduced[0, 0])
        self.noise = noise(flying.evidences, posterior.tempering)

    def fly(self, waiting: Iterable[int]) -> None:
        """Fly hypotheses, and correct by them those that were not flown."""
        for i in waiting:
            if i not in self.points:
                self._fly(i)
        found = inherited(self.found, self.before, [j for j in self.points if j not in self.added], self.points)
        self.found = forgive(found, self.nothing, self._least(), self._bare(), list(self.points))

    def best(self) -> int:
        """The most probable known set, flown or not."""
        known = [i for i, h in enumerate(self.found) if h.unknown is None]
        return max(known, key=lambda i: self.found[i].log_posterior)

    def following(self) -> int | None:
        """What to fly next: of the best set, unless that was flown, else what is left of it without one member.

        A single effect that explains a good part goes first: what flying it corrects, all its sets inherit. Once MOST
        were flown, only what is left of the best of them.
        """
        best, bare = self.best(), self.before[self.nothing_at_all()].log_posterior
        if len(self.points) >= MOST:
            best = max(self.points, key=lambda i: self.found[i].log_posterior)
        if best in self.points:
            return next((i for i in self._less(best) if i not in self.points), None)
        least = PART * (self.found[best].log_posterior - bare)
        alone = [j for j, h in enumerate(self.found) if j not in self.points and h.unknown is None
                 and len(h.effects) == 1 and set(h.effects) < set(self.found[best].effects)
                 and h.log_posterior - bare > least]
        return max(alone, key=lambda j: self.found[j].log_posterior, default=best)

    def _less(self, i: int) -> list[int]:
        """Indices of a flown set without each of its members, from where it settled if they were not flown yet."""
        fit = self.found[i].fit
        found = [self.propose(without(fit, m)) for m in range(len(fit.families)) if len(fit.families) > 1]
        self.beginning = dict.fromkeys(found, self.points[i].nuisances) | self.beginning
        return found

    def _fly(self, i: int) -> None:
        h = self.found[i]
        self.points[i] = self._settled(i, h)
        self.found[i] = h = corrected(h, self.points[i], self.linear, self.flying.candidates.families)
        if lost(self.points[i], self.linear):
            return
        self.left[i] = self.flying.left_over(h.fit, self.points[i])
        left = self.left[i].reduced()
        places = home(h.effects) if h.effects else {u.component for u in self.linear.courses if u.log_evidence > 0.0}
        fits = fit_unknown_left(left, self.flying.candidates)
        path = float(left[0, 0]), self.flying.tempering, home(h.effects)
        self.generic[i] = with_courses(fits, [*beside(self.flying.courses, self.left[i], places),
                                              *wander_fits(self.left[i].wander, *path),
                                              *late_fits(self.left[i].late, *path)])
        if h.effects:
            instead = usual_form(self.flying, h.fit, self.points[i], left)
            self.found[i] = replace(h, form=self._form(i, h), instead=instead)
        else:
            self.nothing, self.own_numbers = h.fit.misfit, self.left[i].unbounded()

    def _settled(self, i: int, h: Hypothesis) -> Point:
        fit, nuisances = self.places.begin(h.fit, self.beginning[i] if i in self.beginning else self.start(h))
        point = self.flying.settle(fit, nuisances)
        self.places.keep(h.fit, point)
        return point

    def _form(self, i: int, h: Hypothesis) -> Form:
        """Another form of a flown set, itself flown where it takes much."""
        flown, at_liberty = Bent(self.points[i], self.left[i]), self._at_liberty(h.fit)
        form, bent = other_form(self.flying, h.fit, flown, *at_liberty.room(flown), shares(h.effects))
        form = replace(form, free=at_liberty.free(self.left[i]))
        if bent is None:
            return form
        self.bent[i] = bent
        return replace(form, bent=at_liberty.free(bent.left))

    def _at_liberty(self, fit: SetFit) -> AtLiberty:
        left = {h.effects: h.fit.misfit for h in self.found if h.unknown is None}
        rest = [tuple(sorted(name for name in fit.effects if name != own)) for own in fit.effects]
        less = [min(left.get(some, np.inf) for some in (names, *((name,) for name in names))) for names in rest]
        missed = [max(more - fit.misfit, 0.0) for more in less]
        return AtLiberty(self.flying, self.linear, fit, self.nothing, missed)

    def nothing_at_all(self) -> int:
        """Index of no gap."""
        return next(i for i, h in enumerate(self.found) if not h.effects and h.unknown is None)

    def _least(self) -> float:
        """What noise alone would leave, as far as what was flown shows."""
        return min([self.noise, *(self.found[i].left for i in self.points)])

    def _bare(self) -> float:
        """The same where the best of them may do whatever it likes at home."""
        return min(h.fit.misfit if h.form is None else h.form.bare() for h in map(self.found.__getitem__, self.points))

    def _ranked(self, effects: int | None = None) -> list[int]:
        """Hypotheses that fly, the best first; those of so many effects alone if given."""
        chosen = [i for i in self.left if effects in (None, len(self.found[i].effects))]
        return sorted(chosen, key=lambda i: -self.found[i].log_posterior)

    def companions(self) -> list[int]:
        """Pairs of the best single effects, where they were flown: with what may be forgiven them, and as they are."""
        alone = self._ranked(1)
        two = sorted(alone, key=lambda i: -self.found[i].log_evidence)[:2]
        lacking = all(len(self.points[i].held) for i in two)  # numbers went as far as they may: neither is all of it
        return [j for i in dict.fromkeys(alone[:1] + two[: 1 + lacking]) for j in self._companions(i)]

    def _companions(self, i: int) -> list[int]:
        first, left = self.found[i].fit, float(self.left[i].reduced()[0, 0])
        room = any(left - u.left > TAKEN for u in self.generic[i]) or told_by_paths(self.linear, first)
        able = room or len(self.points[i].held)
        others = companions(self.flying, self.linear, first, self.points[i]) if able else []
        return [self.propose(together(first, fit)) for fit in others]

    def propose(self, fit: SetFit) -> int:
        """Index of a set, with sizes as proposed if it was not flown yet."""
        names = tuple(sorted(fit.effects))
        known = {h.effects: i for i, h in enumerate(self.found) if h.unknown is None}
        if names in known:
            i = known[names]
            if i not in self.points:
                self.found[i] = replace(self.found[i], fit=fit)
            return i
        self.found.append(Hypothesis(fit, None, set_prior(names, len(self.linear.fits)), fit.log_evidence))
        self.before.append(self.found[-1])
        self.added.add(len(self.found) - 1)
        return len(self.found) - 1

    def _own(self, i: int) -> tuple[UnknownFit | None, list[UnknownFit]]:
        """Generic terms beside a flown set that are a form of it, and those that are not."""
        known = self.found[i]
        if not known.effects or known.form is None:
            return None, self.generic[i]
        explained = self._at_liberty(known.fit).explained()
        return split(known.fit, known.form, self.generic[i], self.nothing, self.linear.raw, explained)

    def _beside(self, i: int) -> list[Hypothesis]:
        """Something unknown beside a flown set (alone if it is empty), its own form allowed."""
        known, remainder, gained = self.found[i], self.left[i], 0.0
        if len(known.effects) > 1:  # a third cause: two effects of no account would pay for its terms
            return []
        fits = self._own(i)[1]
        if known.effects and known.form is not None:
            ways = [known.form.way(k, self.nothing, self._least(), self._bare()) for k in range(len(known.form.gained))]
            if 0 < (k := int(np.argmax(ways))) <= len(SHARES):
                gained = known.form.gained[k] + float(np.log(OTHER_FORM))
                remainder = self.bent[i].left if i in self.bent else remainder
                left = remainder.reduced()
                at_liberty = self._at_liberty(known.fit)
                left = given(left, *at_liberty.room(Bent(self.points[i], remainder)), SHARES[k - 1])
                fits = fit_unknown_left(left, self.flying.candidates)
                fits = split(known.fit, known.form, fits, self.nothing, self.linear.raw, at_liberty.explained())[1]
        fits, flown = self._flown(i, fits) if not known.effects else (fits, {})
        fits = [u for u in fits if not self._named(u, known)]
        if not fits:
            return []
        best = max(fits, key=lambda u: u.log_evidence)
        settled = flown.get(best.component, self._where(i))
        more = float(logsumexp([u.log_evidence for u in fits]) - np.log(len(fits)))
        prior = unknown_prior(known.log_prior if known.effects else None)
        return [Hypothesis(known.fit, best, prior, known.log_evidence + gained + more,
                           Form((0.0,), (best.left,), self._at_liberty(known.fit).free(remainder, best)),
                           settled=settled)]

    def _flown(self, i: int, fits: Iterable[UnknownFit]) -> tuple[list[UnknownFit], dict[str, Settled]]:
        """Generic terms beside nothing, the best of them flown if they are worth it; and where these settled.

        The best few where some of the model's own numbers went as far as they may: perhaps for want of them.
        """
        fits, settled = sorted(fits, key=lambda u: -u.log_evidence), dict[str, Settled]()
        for j, u in enumerate(fits[: TRIED if len(self.points[i].held) else 1]):
            if u.weights and u.log_evidence > WORTH:
                fits[j], point = flown_unknown(self.flying, self.found[i].fit, Bent(self.points[i], self.left[i]), u)
                settled[u.component] = point.settled
        return fits, settled

    def _where(self, i: int) -> Settled:
        """Nuisances where a flown set settled, in its other form if it was flown in one."""
        return (self.bent[i].point if i in self.bent else self.points[i]).settled

    def _named(self, unknown: UnknownFit, beside: Hypothesis) -> bool:
        """Whether generic terms are another form of a single effect of the library; beside others, the like of it.

        A number of the model that is farther off than it may be is no proof of an effect that could stand in for it.
        """
        raw = self.linear.raw
        if not beside.effects:
            told = self.own_numbers - unknown.misfit
            return any(is_home(h, unknown, told, self.own_numbers - self._by_numbers(i), raw)
                       for i, h in enumerate(self.found))  # fmt: skip
        return any(alike(h.fit, unknown, raw) > SHAPE for h in self.found
                   if len(h.effects) == 1 and h.unknown is None and h.effects[0] not in beside.effects)  # fmt: skip

    def _by_numbers(self, i: int) -> float:
        """Whitened square that a set leaves beside the model's own numbers, however far these would have to go."""
        return self.left[i].unbounded() if i in self.left else self.found[i].fit.misfit

    def posterior(self) -> Posterior:
        """All hypotheses with their probabilities.

        Something unknown is believed only beside what was flown, nothing or the best single effect, or as flown alone.
        """
        ranked, others = self._ranked(), list[Hypothesis]()
        found = list(self.found)
        for i in ranked:
            found[i] = replace(found[i], form=with_terms(found[i].form, self._own(i)[0]), settled=self._where(i))
        tried = dict.fromkeys([self.nothing_at_all(), ranked[0], *self._ranked(1)[:1]])
        for i in tried:
            others += self._beside(i) if i in self.left else []
        more = accompanied(others, self.linear, self.flying.candidates)
        others += [h for h in more if h.effects not in {found[i].effects for i in tried}]  # these are known better
        bound = found[ranked[0]].log_posterior
        chosen = [i for i, h in enumerate(found) if i in self.points or (h.unknown is None and h.log_posterior < bound)]
        flown, kept = [k for k, i in enumerate(chosen) if i in self.points], [found[i] for i in chosen] + others
        least = min([self._least(), *(h.left for h in others)])
        bare = self._bare()
        told = forgive(kept, self.nothing, least, bare, flown)
        bound = max(told[k].log_posterior for k in flown)
        told = [h for k, h in enumerate(told) if k in flown or h.unknown is not None or h.log_posterior <= bound]
        best, *_ = hypotheses = normalised(told, 0.0)
        return replace(self.linear, hypotheses=hypotheses, bare=bare if best.unknown is None else min(bare, best.left))
