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
from sim2real.form import Form, at_home, gain, own_terms, room, shares, split, with_terms
from sim2real.generic import UnknownFit, fit_unknown
from sim2real.hypotheses import Hypothesis, Posterior, forgive, normalised, pair_prior
from sim2real.points import Flying, Point
from sim2real.sets import Modes, SetFit, integrate
from sim2real.singles import EffectFit, fit_family
from sim2real.sizes import in_powers

LEADING, LIKELY = 2, 0.02  # explanations that are flown again, and how probable they have to be
CERTAIN = 0.05  # probability of no gap above which nothing is: sizes near zero have no likelihood of Gaussian shape
MOST = 8  # explanations flown again; what looks better then and has not been flown is not believed
COMPANIONS, WORTH = 2, 5.0  # effects flown beside the best single one, and the log evidence that they have to add


def leading(posterior: Posterior) -> list[Hypothesis]:
    """Explanations to fly again where there is a gap at all: the probable ones, and the best single effect."""
    if posterior.none > CERTAIN:
        return []
    known = [h for h in posterior.hypotheses if h.unknown is None]
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
    search.fly([search.found.index(h) for h in leading(posterior)])
    search.fly(search.companions())
    while len(search.points) < MOST and (best := search.best()) not in search.points:
        search.fly([best])
    return search.posterior()


class _Search:
    """Hypotheses, as they are known so far, and those of them that have been flown."""

    def __init__(self, flying: Flying, start: Callable[[Hypothesis], FloatArray], posterior: Posterior) -> None:
        self.flying, self.start, self.linear = flying, start, posterior
        self.found = list(posterior.hypotheses)
        self.before = list(self.found)  # as the linear fit has them
        self.points: dict[int, Point] = {}
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
        found = _inherited(self.found, self.before, [j for j in self.points if j not in self.added], self.points)
        self.found = forgive(found, self.nothing, self._least())

    def best(self) -> int:
        """The most probable known set, flown or not."""
        known = [i for i, h in enumerate(self.found) if h.unknown is None]
        return max(known, key=lambda i: self.found[i].log_posterior)

    def _fly(self, i: int) -> None:
        h = self.found[i]
        self.points[i] = self.flying.settle(h.fit, self.start(h))
        h = _corrected(h, self.points[i], self.linear)
        left = self.flying.left_over(h.fit, self.points[i])
        bank = self.flying.candidates
        moved = tuple(replace(term, row=1 + j) for j, term in enumerate(bank.terms))
        self.generic[i] = fit_unknown(left, replace(bank, terms=moved))
        if h.effects:
            own = own_terms(h.effects, moved)
            rows = [term.row for term in own]
            form = gain(left[np.ix_(rows, rows)], left[rows, 0], room(h.fit, self.linear.reduced, own), h.fit.misfit,
                        shares(len(h.effects)))
            elsewhere = [u for u in self.generic[i] if u.log_evidence > 0.0 and not at_home(u.component, h.effects)]
            most = max((float(left[0, 0]) - u.misfit for u in elsewhere), default=0.0)
            h = replace(h, form=replace(form, foreign=most))
        self.found[i] = h

    def _least(self) -> float:
        """What noise alone would leave, as far as what was flown shows."""
        return min([self.noise, *(self.found[i].left for i in self.points)])

    def _ranked(self, effects: int | None = None) -> list[int]:
        """Flown hypotheses, the best first; those of so many effects alone if given."""
        chosen = [i for i in self.points if effects is None or len(self.found[i].effects) == effects]
        return sorted(chosen, key=lambda i: -self.found[i].log_posterior)

    def companions(self) -> list[int]:
        """Pairs of the best single effect, where it was flown, with whatever explains most of what it leaves."""
        if not (alone := self._ranked(1)):
            return []
        first = self.found[alone[0]]
        reduced = self.flying.beside(first.fit, self.points[alone[0]])
        best: dict[str, EffectFit] = {}
        for family in self.flying.candidates.families:
            name = family.effect.name
            if name in self.linear.fits and name not in first.effects:
                fit = fit_family(reduced, family)
                if name not in best or fit.log_evidence > best[name].log_evidence:
                    best[name] = fit
        promising = sorted(best.values(), key=lambda fit: -fit.log_evidence)[:COMPANIONS]
        return [self._propose(first, fit) for fit in promising if fit.log_evidence > WORTH]

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
        self.found.append(Hypothesis(fit, None, pair_prior(len(self.linear.fits)), fit.log_evidence))
        self.before.append(self.found[-1])
        self.added.add(len(self.found) - 1)
        return len(self.found) - 1

    def posterior(self) -> Posterior:
        """All hypotheses with their probabilities.

        Something unknown beside a set is believed only where the set has been flown: beside the best one, and beside
        the best of single effects.
        """
        ranked, others = self._ranked(), list[Hypothesis]()
        found = list(self.found)
        for i in dict.fromkeys([ranked[0], *self._ranked(1)[:1]]):
            known, fits = found[i], self.generic[i]
            if known.effects:
                home, fits = split(known.fit, self.linear.reduced, fits)
                found[i] = replace(known, form=with_terms(known.form, home))
            others += [_beside(h, known, fits, self.flying) for h in found
                       if h.unknown is not None and h.effects == known.effects and fits]
        bound = found[ranked[0]].log_posterior
        kept = [h for i, h in enumerate(found) if i in self.points or (h.unknown is None and h.log_posterior < bound)
                or (h.unknown is not None and not h.effects and found[ranked[0]].effects)] + others  # fmt: skip
        least = min([self._least(), *(h.left for h in others)])
        return replace(self.linear, hypotheses=normalised(forgive(kept, self.nothing, least), 0.0))


def _beside(h: Hypothesis, known: Hypothesis, fits: Sequence[UnknownFit], flying: Flying) -> Hypothesis:
    """Something unknown beside a set (or alone), as what the set leaves where it was flown has it."""
    best = max(fits, key=lambda u: u.log_evidence)
    more = float(logsumexp([u.log_evidence for u in fits]) - np.log(len(fits)))
    weights = {t.row: best.weights[1 + j] for j, t in enumerate(flying.candidates.terms) if 1 + j in best.weights}
    return replace(h, fit=known.fit, unknown=replace(best, weights=weights), log_evidence=known.log_evidence + more)


def _inherited(found: Sequence[Hypothesis], before: Sequence[Hypothesis], bases: Iterable[int],
               points: Iterable[int]) -> list[Hypothesis]:
    """Sets that were not flown, corrected by as much as the largest set within them was that was.

    What polynomials in its size miss of an effect they miss in every set that holds it; else the sets that nobody has
    flown yet would always look best.
    """
    flown, out = [j for j in bases if found[j].effects], list(found)
    for i, h in enumerate(before):
        within = [j for j in flown if set(before[j].effects) <= set(h.effects)]
        if i in points or not within:
            continue
        nearest = max(within, key=lambda j: len(before[j].effects))
        now, then = found[nearest], before[nearest]
        more = now.fit.misfit - then.fit.misfit
        form, unknown = h.form, h.unknown
        if form is not None:
            form = _moved(form, now, then, h.fit.misfit + more)
        if unknown is not None:
            unknown = replace(unknown, misfit=unknown.misfit + more)
        out[i] = replace(h, fit=replace(h.fit, misfit=h.fit.misfit + more), form=form, unknown=unknown,
                         log_evidence=h.log_evidence + now.log_evidence - then.log_evidence)
    return out


def _moved(form: Form, now: Hypothesis, then: Hypothesis, misfit: float) -> Form:
    """A form corrected by as much as that of a set within was; `misfit` is what the larger set leaves now."""
    more, one, other = now.fit.misfit - then.fit.misfit, now.form, then.form
    if one is None or other is None or not len(form.gained) == len(one.gained) == len(other.gained):
        return Form(form.gained, tuple(left + more for left in form.left))
    ways = range(len(form.gained))
    return Form(tuple(form.gained[k] + one.gained[k] - other.gained[k] for k in ways),
                tuple(form.left[k] + one.left[k] - other.left[k] for k in ways),
                max(one.foreign - max(now.fit.misfit - misfit, 0.0), 0.0))


def _corrected(hypothesis: Hypothesis, point: Point, posterior: Posterior) -> Hypothesis:
    """Evidence and sizes of a set from where it settled: its likelihood is taken as Gaussian there."""
    none = 0.5 * float(posterior.reduced[0, 0])
    last: FloatArray = np.asarray(np.linalg.solve(point.information, point.slope), np.float64)
    cost = point.cost - 0.5 * float(point.slope @ last)
    k = len(point.sizes)
    if k == 0:
        return replace(hypothesis, log_evidence=none - cost, fit=replace(hypothesis.fit, misfit=2.0 * cost))
    inner, across = point.information[:k, :k], point.information[:k, k:]
    alone = np.asarray(inner - across @ np.linalg.solve(point.information[k:, k:], across.T), np.float64)
    fit = _integrated(hypothesis.fit, point.sizes, last[:k], cost, alone)
    log = fit.log_evidence + none
    return replace(hypothesis, log_evidence=log, fit=replace(fit, log_evidence=log))


def _integrated(fit: SetFit, sizes: FloatArray, last: FloatArray, cost: float, information: FloatArray) -> SetFit:
    """Prior times a Gaussian likelihood of the sizes; log_evidence is the log of its integral.

    Args:
        sizes, last: where the set was flown, and the step (in ranges of the parameters) that is left.
        cost, information: half the whitened square there, and its second derivative per square of range.
    """
    families, k = fit.families, len(sizes)
    size = 1 + max(max(f.rows) for f in families)
    base = in_powers(np.zeros((size, size)), families)
    span = np.array([f.parameter.high - f.parameter.low for f in families])
    x = np.clip((sizes - last * span - base.neutral) / base.reach, base.low, base.high)
    H = information * np.outer(base.reach / span, base.reach / span)
    gram = np.zeros((1 + k, 1 + k))
    gram[0, 0], gram[0, 1:], gram[1:, 0], gram[1:, 1:] = 2.0 * cost + x @ H @ x, -H @ x, -H @ x, H
    modes = Modes(np.arange(k)[None], x[None], np.array([cost]), H[None], np.zeros(1))
    found = integrate(replace(base, gram=gram, degree=1), modes, 0)
    return replace(found, log_evidence=found.log_evidence - 0.5 * float(gram[0, 0]))
