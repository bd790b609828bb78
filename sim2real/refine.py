"""The leading explanations flown about their own fitted sizes and nuisances, before they are reported.

Polynomials between the sizes flown, and signatures that add, hold only nearby: where an effect is large or bends (a
rate limit, a stall), what the polynomial misses would be blamed on a second effect. Each leading set is therefore flown
where it was fitted, with its own slopes, and fitted by Gauss-Newton; its evidence is corrected by what it gained or
lost.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.candidates import NUISANCE_STEP, Bank
from sim2real.evidence import Evidence, compare, predicted
from sim2real.form import Form, gain, own_terms, room, split, with_terms
from sim2real.generic import UnknownFit, fit_unknown
from sim2real.hypotheses import Hypothesis, Posterior, forgive, normalised
from sim2real.predictor import innovations
from sim2real.reconstruct import Reconstruction
from sim2real.references import Baseline
from sim2real.sets import Modes, SetFit, integrate
from sim2real.sizes import in_powers
from sim2real.terms import Term, pushes

LEADING, LIKELY = 3, 0.02  # explanations that are flown again, and how probable they have to be
CERTAIN = 0.05  # probability of no gap above which nothing is: sizes near zero have no likelihood of Gaussian shape
MOST = 8  # explanations flown again before the best need not be one of them
ROUNDS = 4
SETTLED = 0.2  # gain of half the whitened square that is worth another round
FARTHEST = 15.0  # standard deviations of a nuisance: its prior counts, and what is beyond may not fly


@dataclass(frozen=True)
class Point:
    """A set at given sizes [k] and nuisances [n], flown.

    cost: half the whitened square it leaves, the nuisances' prior included, tempered; slope and information: of sizes
    (in ranges of their parameters), then nuisances.
    """

    sizes: FloatArray
    nuisances: FloatArray
    cost: float
    slope: FloatArray
    information: FloatArray


def leading(posterior: Posterior) -> list[Hypothesis]:
    """Explanations to fly again where there is a gap at all: the probable ones, and the best single effect."""
    if posterior.none > CERTAIN:
        return []
    known = [h for h in posterior.hypotheses if h.unknown is None]
    chosen = [h for h in known if h.probability > LIKELY][:LEADING]
    chosen += [h for h in known if len(h.effects) == 1 and h not in chosen][:1]
    return chosen if any(h.effects for h in chosen) else []


def refine(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence], baseline: Baseline,
           start: Callable[[Hypothesis], FloatArray], posterior: Posterior) -> Posterior:
    """The posterior with its leading explanations fitted where they lie, until the best of them has been flown.

    Args:
        flights: the records about the baseline.
        evidences: as gathered, for their gains and whitening.
        start: best nuisances [n] of a hypothesis as far as the linear fit knows.
    """
    found: list[Hypothesis] = list(posterior.hypotheses)
    before, points = list(found), dict[int, Point]()
    nothing, noise = float(posterior.reduced[0, 0]), np.inf
    if posterior.tempering > 1.0:
        noise = sum(e.samples for e in evidences) / posterior.tempering
    waiting = [found.index(h) for h in leading(posterior)]
    while waiting and len(points) < MOST:
        for i in waiting:
            at = start(found[i])
            points[i] = _settle(flights, candidates, evidences, baseline, posterior.tempering, found[i].fit, at)
            found[i] = _corrected(found[i], points[i], posterior)
            if found[i].effects:
                own = tuple(own_terms(found[i].effects, candidates.terms))
                left = _left_over(flights, candidates, evidences, baseline, posterior.tempering, found[i].fit,
                                  points[i], own)
                square = room(found[i].fit, posterior.reduced, own)
                found[i] = replace(found[i], form=gain(left[1:, 1:], left[1:, 0], square, found[i].fit.misfit))
        found = forgive(_inherited(found, before, points), nothing, _least(found, points, noise))
        best = max((i for i, h in enumerate(found) if h.unknown is None), key=lambda i: found[i].log_posterior)
        waiting = [] if best in points else [best]
    # something unknown beside a set is believed only where the set has been flown: beside the best, and the best alone
    ranked = sorted(points, key=lambda i: -found[i].log_posterior)
    others: list[Hypothesis] = []
    for i in dict.fromkeys([ranked[0], *[j for j in ranked if len(found[j].effects) == 1][:1]]):
        beside = [h for h in found if h.unknown is not None and h.effects == found[i].effects]
        left = _left_over(flights, candidates, evidences, baseline, posterior.tempering, found[i].fit, points[i],
                          candidates.terms)
        home, more = _beside(candidates, posterior, left, found[i], beside)
        found[i] = replace(found[i], form=with_terms(found[i].form, home))
        others += more
    known = [h for h in found if h.unknown is None or (not h.effects and found[ranked[0]].effects)]
    least = min([_least(found, points, noise), *(h.left for h in others)])
    return replace(posterior, hypotheses=normalised(forgive(known + others, nothing, least), 0.0))


def _inherited(found: Sequence[Hypothesis], before: Sequence[Hypothesis], points: Iterable[int]) -> list[Hypothesis]:
    """Sets that were not flown, corrected by as much as the largest flown set within them was.

    What polynomials in its size miss of an effect they miss in every set that holds it; else the sets that nobody has
    flown yet would always look best.
    """
    flown, out = [j for j in points if found[j].effects], list(found)
    for i, h in enumerate(before):
        within = [j for j in flown if set(before[j].effects) <= set(h.effects)]
        if i in flown or not within:
            continue
        nearest = max(within, key=lambda j: len(before[j].effects))
        now, then = found[nearest], before[nearest]
        more = now.fit.misfit - then.fit.misfit
        form, unknown = h.form, h.unknown
        if form is not None:
            form = _moved(form, now.form, then.form, more)
        if unknown is not None:
            unknown = replace(unknown, misfit=unknown.misfit + more)
        out[i] = replace(h, fit=replace(h.fit, misfit=h.fit.misfit + more), form=form, unknown=unknown,
                         log_evidence=h.log_evidence + now.log_evidence - then.log_evidence)
    return out


def _moved(form: Form, now: Form | None, then: Form | None, more: float) -> Form:
    """A form corrected by as much as another was, or by `more` of whitened square where the two cannot be compared."""
    if now is None or then is None or not len(form.gained) == len(now.gained) == len(then.gained):
        return Form(form.gained, tuple(left + more for left in form.left))
    ways = range(len(form.gained))
    return Form(tuple(form.gained[k] + now.gained[k] - then.gained[k] for k in ways),
                tuple(form.left[k] + now.left[k] - then.left[k] for k in ways))


def _least(found: Sequence[Hypothesis], points: Iterable[int], noise: float) -> float:
    """What noise alone would leave, as far as what was flown shows."""
    return min([noise, *(found[i].left for i in points)])


def _left_over(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence], baseline: Baseline,
               tempering: float, fit: SetFit, point: Point, terms: Sequence[Term]) -> FloatArray:
    """Inner products of what a set leaves where it was flown (row 0) and generic terms, all else integrated out."""
    k, n = len(point.sizes), len(point.nuisances)
    first, count = 1 + k + n, len(terms)
    steps = _steps(fit, point.sizes)
    moved = tuple(replace(term, row=first + j) for j, term in enumerate(terms))
    gram = np.zeros((first + count, first + count))
    for flight, evidence in zip(flights, evidences, strict=True):
        rows = _rows(flight, candidates, fit, point.sizes, steps, point.nuisances)
        base = innovations(replace(flight, parameters=rows[:1]), rows[:1], evidence.gain.K)[:, 0]
        pushed = pushes(replace(flight, measured=predicted(flight, base)), moved)
        rows = np.concatenate([rows, np.repeat(rows[:1], count)])
        gram += compare(flight, rows, pushed, evidence.gain, evidence.factor, moved).gram / tempering
    gram[first - n : first, first - n : first] += baseline.precision
    gram[first - n : first, 0] += baseline.precision @ point.nuisances
    gram[0, first - n : first] = gram[first - n : first, 0]
    gram[0, 0] += point.nuisances @ baseline.precision @ point.nuisances
    gone = np.arange(1, first)
    inner = gram[np.ix_(gone, gone)] + 1e-2 * np.diag(np.arange(first - 1) < k)
    reduced = gram - gram[:, gone] @ np.linalg.solve(inner, gram[gone])
    kept = np.concatenate([[0], np.arange(first, first + count)])
    return np.asarray(reduced[np.ix_(kept, kept)])


def _beside(candidates: Bank, posterior: Posterior, left: FloatArray, known: Hypothesis,
            others: Sequence[Hypothesis]) -> tuple[UnknownFit | None, list[Hypothesis]]:
    """Terms of a set's own form, and the unknown beside it (or alone), judged on what it leaves where it was flown."""
    moved = tuple(replace(term, row=1 + j) for j, term in enumerate(candidates.terms))
    own: UnknownFit | None = None
    fits = fit_unknown(left, replace(candidates, terms=moved))
    if known.effects:
        own, fits = split(known.fit, posterior.reduced, fits)
    if not fits:
        return own, []
    best = max(fits, key=lambda u: u.log_evidence)
    add = float(logsumexp([u.log_evidence for u in fits]) - np.log(len(fits)))
    weights = {t.row: best.weights[1 + j] for j, t in enumerate(candidates.terms) if 1 + j in best.weights}
    return own, [replace(other, fit=known.fit, unknown=replace(best, weights=weights),
                          log_evidence=known.log_evidence + add) for other in others]  # fmt: skip


def _settle(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence], baseline: Baseline,
            tempering: float, fit: SetFit, centre: FloatArray) -> Point:
    """Gauss-Newton from a set's linear fit, or the published model if that is nearer; a step that fails is halved."""
    def fly(sizes: FloatArray, nuisances: FloatArray) -> Point:
        return _point(flights, candidates, evidences, baseline, tempering, fit, sizes, nuisances)

    low, high = (np.array([getattr(f.parameter, end) for f in fit.families]) for end in ("low", "high"))
    starts = [fly(np.array(fit.estimate), at) for at in (np.clip(centre, -FARTHEST, FARTHEST), np.zeros_like(centre))]
    best, share = min(starts, key=lambda point: point.cost), 1.0
    for _ in range(ROUNDS):
        step = -share * np.linalg.solve(best.information, best.slope)
        if -0.5 * float(step @ best.slope) < SETTLED:
            break
        k = len(low)
        sizes = np.clip(best.sizes + step[:k] * (high - low), low, high)
        tried = fly(sizes, np.clip(best.nuisances + step[k:], -FARTHEST, FARTHEST))
        best, share = (tried, 1.0) if tried.cost < best.cost else (best, 0.5 * share)
    return best


def _point(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence], baseline: Baseline,
           tempering: float, fit: SetFit, sizes: FloatArray, nuisances: FloatArray) -> Point:
    k, n = len(sizes), len(nuisances)
    steps = _steps(fit, sizes)
    gram = np.zeros((1 + k + n, 1 + k + n))
    for flight, evidence in zip(flights, evidences, strict=True):
        rows = _rows(flight, candidates, fit, sizes, steps, nuisances)
        gram += compare(flight, rows, (), evidence.gain, evidence.factor).gram / tempering
    span = np.array([f.parameter.high - f.parameter.low for f in fit.families])
    unit = np.concatenate([[1.0], span / steps if k else [], np.full(n, 1.0 / NUISANCE_STEP)])
    gram = gram * unit[:, None] * unit
    prior = baseline.precision
    slope, information = gram[1:, 0].copy(), gram[1:, 1:].copy()
    slope[k:] += prior @ nuisances
    information[k:, k:] += prior
    information[:k, :k] += np.eye(k)  # a size moves no farther than its range
    cost = 0.5 * (gram[0, 0] + nuisances @ prior @ nuisances)
    return Point(sizes, nuisances, float(cost), slope, information)


def _steps(fit: SetFit, sizes: FloatArray) -> FloatArray:
    """Step of each size for its slope: about its uncertainty, inwards."""
    out = np.zeros(len(sizes))
    for m, (family, size) in enumerate(zip(fit.families, sizes, strict=True)):
        low, high = family.parameter.low, family.parameter.high
        spread = 0.0 if fit.covariance is None else float(np.sqrt(fit.covariance[m, m]))
        step = min(max(spread, 1e-3 * (high - low)), 0.1 * (high - low))
        out[m] = step if size + step <= high else -step
    return out


def _rows(flight: Reconstruction, candidates: Bank, fit: SetFit, sizes: FloatArray, steps: FloatArray,
          nuisances: FloatArray) -> NDArray:
    """PARAMETERS: the set where it is fitted, then a step of each size, then a step of each nuisance."""
    k, n = len(sizes), len(nuisances)
    rows = np.repeat(flight.parameters, 1 + k + n)
    for j, (direction, size) in enumerate(zip(candidates.nuisances, nuisances, strict=True)):
        own = np.full(len(rows), size)
        own[1 + k + j] += NUISANCE_STEP
        direction.apply(rows, slice(None), flight.power_from, own)
    moved = np.tile(sizes, (len(rows), 1))
    moved[1 : 1 + k] += np.diag(steps)
    return effects.with_effects(rows, {f.effect.name: {f.parameter.name: moved[:, m]}
                                       for m, f in enumerate(fit.families)})  # fmt: skip


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
