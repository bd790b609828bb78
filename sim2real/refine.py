"""The leading explanations flown about their own fitted sizes and nuisances, before they are reported.

Polynomials between the sizes flown, and signatures that add, hold only nearby: where an effect is large or bends (a
rate limit, a stall), what the polynomial misses would be blamed on a second effect. Each leading set is therefore flown
where it was fitted, with its own slopes, and fitted by Gauss-Newton; its evidence is corrected by what it gained or
lost. Beside the best single effect, where it was flown, the whole library is then tried again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from icing_env.record import FloatArray
from sim2real.corrections import corrected, inherited
from sim2real.courses import Remainder
from sim2real.form import (
    FORGIVEN,
    OTHER_FORM,
    SHARES,
    UNKNOWN_FORGIVEN,
    Form,
    Liberty,
    energies,
    gain,
    given,
    home,
    own_terms,
    room,
    shares,
    split,
    with_terms,
)
from sim2real.generic import UnknownFit, fit_unknown
from sim2real.hypotheses import (
    P_BESIDE,
    P_NONE,
    P_UNKNOWN,
    Hypothesis,
    Posterior,
    forgive,
    is_home,
    normalised,
    set_prior,
)
from sim2real.points import Flying, Point
from sim2real.sets import SetFit
from sim2real.singles import EffectFit, fit_family
from sim2real.terms import Term

LEADING, LIKELY = 2, 0.02  # explanations that are flown again, and how probable they have to be
CERTAIN = 0.05  # probability of no gap above which nothing is: sizes near zero have no likelihood of Gaussian shape
MOST = 7  # explanations flown again; what looks better then and has not been flown is not believed
FEW_PLACES = 5  # components at which courses of time are freed together
COMPANIONS, WORTH = 2, 5.0  # effects flown beside the best single one, and the log evidence that they have to add


def leading(posterior: Posterior) -> list[Hypothesis]:
    """Explanations to fly again where there is a gap at all: the probable ones, and the best single effect."""
    if posterior.none > CERTAIN:
        return []
    known = sorted((h for h in posterior.hypotheses if h.unknown is None), key=lambda h: -h.log_posterior)
    chosen = [h for h in known if h.probability > LIKELY][:LEADING]
    chosen += [h for h in known if len(h.effects) == 1 and h not in chosen][:1]
    return chosen if any(h.effects for h in chosen) else []


def refine(flying: Flying, start: Callable[[Hypothesis], FloatArray], posterior: Posterior) -> Posterior:
    """The posterior with its leading explanations fitted where they lie, until the best of them has been flown.

    Args:
        flying: the records, and what flying along them takes.
        start: best nuisances [n] of a hypothesis as far as the linear fit knows.
        posterior: of the linear fit.
    """
    search = _Search(flying, start, posterior)
    search.fly([search.nothing_at_all(), *(search.found.index(h) for h in leading(posterior))])
    search.fly(search.companions())
    while len(search.points) < MOST and (best := search.best()) not in search.points:
        search.fly([search.first_of(best)])
    return search.posterior()


class _Search:
    """Hypotheses, as they are known so far, and those of them that have been flown."""

    def __init__(self, flying: Flying, start: Callable[[Hypothesis], FloatArray], posterior: Posterior) -> None:
        self.flying, self.start, self.linear = flying, start, posterior
        self.found = list(posterior.hypotheses)
        self.before = list(self.found)  # as the linear fit has them
        self.points: dict[int, Point] = {}
        self.left: dict[int, Remainder] = {}
        self.generic: dict[int, list[UnknownFit]] = {}
        self.added: set[int] = set()  # proposed beside a flown one: no linear fit to correct others by
        self.nothing, self.noise = float(posterior.reduced[0, 0]), np.inf
        if posterior.tempering > 1.0:
            self.noise = sum(e.samples for e in flying.evidences) / posterior.tempering

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

    def first_of(self, i: int) -> int:
        """A single effect of set `i` that was not flown yet, the most probable first; else the set.

        What flying a single effect corrects, all sets that hold it inherit.
        """
        alone = [j for j, h in enumerate(self.found) if j not in self.points and h.unknown is None
                 and len(h.effects) == 1 and set(h.effects) < set(self.found[i].effects)]  # fmt: skip
        return max(alone, key=lambda j: self.found[j].log_posterior, default=i)

    def _fly(self, i: int) -> None:
        h = self.found[i]
        self.points[i] = self.flying.settle(h.fit, self.start(h))
        h = corrected(h, self.points[i], self.linear)
        self.left[i] = self.flying.left_over(h.fit, self.points[i])
        left = self.left[i].reduced()
        self.generic[i] = self._fit_unknown(left)
        if h.effects:
            rows, square = self._room(h)
            form = gain(left[np.ix_(rows, rows)], left[rows, 0], square, h.fit.misfit, shares(len(h.effects)))
            h = replace(h, form=replace(form, free=self._free(i, h.fit)), instead=None)
        else:
            self.nothing = h.fit.misfit
        self.found[i] = h

    def _room(self, h: Hypothesis) -> tuple[list[int], FloatArray]:
        """Rows of the generic terms at home of a set in what it leaves, and what `room` there is for each."""
        own = own_terms(h.effects, _moved(self.flying.candidates.terms))
        return [term.row for term in own], room(h.fit, self.linear.reduced, own, self.nothing)

    def _free(self, i: int, fit: SetFit, beside: UnknownFit | None = None) -> tuple[Liberty, ...]:
        """What free courses of time would take: at home of each effect, or where something unknown is; then at all.

        What a member may leave there goes with what it explains: one that explains little would else be named for the
        freedom of its home.
        """
        each = [home((family.effect.name,)) for family in fit.families]
        most = [FORGIVEN**2 * e for e in energies(fit, self.linear.reduced, max(self.nothing - fit.misfit, 0.0))]
        taken = 0.0
        if beside is not None:
            taken = fit.misfit - beside.misfit
            each, most = [*each, {beside.component}], [*most, UNKNOWN_FORGIVEN**2 * taken]
        found = [Liberty(max(self.flying.courses.free(self.left[i], at) - taken, 0.0), len(at), share)
                 for at, share in zip(each, most, strict=True)]
        together = set().union(*each)
        if len(each) > 1 and len(together) <= FEW_PLACES:
            free = max(self.flying.courses.free(self.left[i], together) - taken, 0.0)
            found.append(Liberty(free, len(together), sum(min(at.free, at.most) for at in found)))
        return tuple(found)

    def nothing_at_all(self) -> int:
        """Index of no gap."""
        return next(i for i, h in enumerate(self.found) if not h.effects and h.unknown is None)

    def _least(self) -> float:
        """What noise alone would leave, as far as what was flown shows."""
        return min([self.noise, *(self.found[i].left for i in self.points)])

    def _bare(self) -> float:
        """The same where the best of them may do whatever it likes at home."""
        flown = [self.found[i] for i in self.points]
        return min(h.fit.misfit if h.form is None else h.form.bare() for h in flown)

    def _ranked(self, effects: int | None = None) -> list[int]:
        """Flown hypotheses, the best first; those of so many effects alone if given."""
        chosen = [i for i in self.points if effects is None or len(self.found[i].effects) == effects]
        return sorted(chosen, key=lambda i: -self.found[i].log_posterior)

    def companions(self) -> list[int]:
        """Pairs of the best single effect, where it was flown, with whatever explains most of what it leaves.

        And of what no free course of time would explain where that effect enters: its own form would hide a second one.
        """
        if not (alone := self._ranked(1)):
            return []
        first, out = self.found[alone[0]], dict[str, EffectFit]()
        for reduced in self.flying.beside(first.fit, self.points[alone[0]], home(first.effects)):
            best: dict[str, EffectFit] = {}
            for family in self.flying.candidates.families:
                name = family.effect.name
                if name in self.linear.fits and name not in first.effects:
                    fit = fit_family(reduced, family)
                    if name not in best or fit.log_evidence > best[name].log_evidence:
                        best[name] = fit
            promising = sorted(best.values(), key=lambda fit: -fit.log_evidence)[:COMPANIONS]
            out |= {fit.family.effect.name: fit for fit in promising if fit.log_evidence > WORTH}
        return [self._propose(first, fit) for fit in out.values()]

    def _propose(self, first: Hypothesis, second: EffectFit) -> int:
        """Index of the pair, with sizes as found beside the first."""
        known = {h.effects: i for i, h in enumerate(self.found) if h.unknown is None}
        names = tuple(sorted((*first.effects, second.family.effect.name)))
        spread = np.array([[((second.high95 - second.low95) / 3.92) ** 2]])
        one = first.fit
        covariance = np.zeros((1, 1)) if one.covariance is None else one.covariance
        fit = SetFit((*one.families, second.family), one.log_evidence + second.log_evidence,
                     (*one.estimate, second.estimate), (*one.low95, second.low95), (*one.high95, second.high95),
                     np.block([[covariance, np.zeros((1, 1))], [np.zeros((1, 1)), spread]]),
                     (one.weights or {}) | second.weights, second.misfit)  # fmt: skip
        if names in known:
            i = known[names]
            if i not in self.points:
                self.found[i] = replace(self.found[i], fit=fit)
            return i
        self.found.append(Hypothesis(fit, None, set_prior(names, len(self.linear.fits)), fit.log_evidence))
        self.before.append(self.found[-1])
        self.added.add(len(self.found) - 1)
        return len(self.found) - 1

    def _beside(self, i: int) -> tuple[UnknownFit | None, list[Hypothesis]]:
        """Terms of a flown set's form, and something unknown beside it (alone if it is empty), its own form allowed."""
        known = self.found[i]
        left, gained, own = self.left[i].reduced(), 0.0, None
        fits = self.generic[i] if known.effects else [u for u in self.generic[i] if not self._named(u)]
        if known.effects and known.form is not None:
            own, fits = split(known.fit, fits, self.nothing, self.linear.raw)
            ways = [known.form.way(k, self.nothing, self._least(), self._bare()) for k in range(len(known.form.gained))]
            if 0 < (k := int(np.argmax(ways))) <= len(SHARES):
                gained = known.form.gained[k] + float(np.log(OTHER_FORM))
                left = given(left, *self._room(known), SHARES[k - 1])
                fits = split(known.fit, self._fit_unknown(left), self.nothing, self.linear.raw)[1]
        if not fits:
            return own, []
        best = max(fits, key=lambda u: u.log_evidence)
        more = float(logsumexp([u.log_evidence for u in fits]) - np.log(len(fits)))
        prior = np.log(P_BESIDE / (1.0 - P_NONE)) + known.log_prior if known.effects else np.log(P_UNKNOWN)
        return own, [Hypothesis(known.fit, best, float(prior),
                                known.log_evidence + gained + more,
                                Form((0.0,), (best.left,), self._free(i, known.fit, best)))]

    def _fit_unknown(self, left: FloatArray) -> list[UnknownFit]:
        """Generic terms on what a flown set leaves; their weights in rows of the bank."""
        bank = self.flying.candidates
        return [replace(u, weights={bank.terms[row - 1].row: w for row, w in u.weights.items()})
                for u in fit_unknown(left, replace(bank, terms=_moved(bank.terms)))]

    def _named(self, unknown: UnknownFit) -> bool:
        """Whether generic terms alone are another form of a single effect of the library."""
        return any(is_home(h, unknown, self.nothing, self.linear.raw) for h in self.found)

    def posterior(self) -> Posterior:
        """All hypotheses with their probabilities.

        Something unknown is believed only beside what has been flown: nothing, the best set, the best single effect.
        """
        ranked, others = self._ranked(), list[Hypothesis]()
        found = list(self.found)
        for i in dict.fromkeys([self.nothing_at_all(), ranked[0], *self._ranked(1)[:1]]):
            own, beside = self._beside(i)
            found[i] = replace(found[i], form=with_terms(found[i].form, own))
            others += beside
        bound = found[ranked[0]].log_posterior
        chosen = [i for i, h in enumerate(found) if i in self.points or (h.unknown is None and h.log_posterior < bound)]
        flown, kept = [k for k, i in enumerate(chosen) if i in self.points], [found[i] for i in chosen] + others
        least = min([self._least(), *(h.left for h in others)])
        bare = self._bare()
        told = normalised(forgive(kept, self.nothing, least, bare, flown), 0.0)
        return replace(self.linear, hypotheses=told, bare=bare, settled=self.points[ranked[0]].nuisances)


def _moved(terms: Sequence[Term]) -> tuple[Term, ...]:
    """The terms with their rows in what a flown set leaves, itself being row 0."""
    return tuple(replace(term, row=1 + j) for j, term in enumerate(terms))
