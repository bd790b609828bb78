"""From inner products to probabilities: no gap, effects alone or together, or something the library lacks.

All is linear in the nuisances and in the generic terms (Gaussian priors, integrated out in closed form); sizes of
effects are integrated on grids, signatures between the sizes flown interpolated. With the residual
r(s) = v + sum a_i(s) D_i and nuisance signatures G ~ N(0, I):

    log L(s) = -r' (I + G G')^-1 r / 2,    (I + G G')^-1 = I - G (I + G'G)^-1 G'
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from icing_env.record import FloatArray
from sim2real.library.candidates import NUISANCE_STEP, Bank
from sim2real.library.sizes import flown_weights, in_powers
from sim2real.posterior.any_course import with_courses
from sim2real.posterior.forgiveness import forgive
from sim2real.posterior.form import Form, energies, may_bend, own_powers, own_terms, room, shares, squares, with_terms
from sim2real.posterior.generic import UnknownFit, beside, fit_unknown
from sim2real.posterior.home_terms import gain, without
from sim2real.posterior.hypotheses import Hypothesis, Posterior, homes, normalised
from sim2real.posterior.likeness import split
from sim2real.posterior.prior import P_NONE, set_prior, single_prior, unknown_prior
from sim2real.posterior.sets import INTEGRATED, SetFit, firm, grow, integrate, pairs, sizes_tried
from sim2real.posterior.singles import EffectFit, ambiguity, fit_family

CLEARLY = 3.0  # log evidence by which another parameter than its first is told of an effect (assumed)
BESIDE, MOST_BESIDE = 6, 2  # leading sets that something unknown is tried beside, and effects they may have

def reduce(gram: FloatArray, bank: Bank, precision: FloatArray | None = None) -> FloatArray:
    """Inner products after the nuisances are integrated out.

    Args:
        precision: prior precision of the nuisances in their own units; identity if omitted.
    """
    g = np.arange(1, 1 + len(bank.nuisances))
    inner = gram[np.ix_(g, g)] / NUISANCE_STEP**2 + (np.eye(len(g)) if precision is None else precision)
    cross = gram[:, g] / NUISANCE_STEP
    return np.asarray(gram - cross @ np.linalg.solve(firm(inner), cross.T))


def nuisance_mean(gram: FloatArray, bank: Bank, weights: dict[int, float]) -> FloatArray:
    """Best nuisances [n], in standard deviations from where `gram` was flown, with the rows of an explanation added.

    Their prior is in `gram` (see `with_prior`).
    """
    together = {0: 1.0} | weights
    rows, w = list(together), np.array(list(together.values()))
    g = np.arange(1, 1 + len(bank.nuisances))
    inner = gram[np.ix_(g, g)] / NUISANCE_STEP**2
    return np.asarray(-np.linalg.solve(inner, gram[g][:, rows] @ w / NUISANCE_STEP), dtype=np.float64)


def with_prior(gram: FloatArray, bank: Bank, precision: FloatArray, centre: FloatArray) -> FloatArray:
    """Inner products with the nuisances' prior counted as data, for a model already moved by `centre`.

    The prior's residual at the model is L' centre with precision = L L', and L' for a step in each direction.
    """
    n = len(bank.nuisances)
    root = np.linalg.cholesky(precision).T
    data = np.column_stack([root @ centre, NUISANCE_STEP * root])
    out = gram.copy()
    out[: n + 1, : n + 1] += data.T @ data
    return out


class Linear:
    """What inner products say of known effects, their sizes and forms; all that is asked for again is kept.

    Attributes:
        gram: inner products of all records.
        bank: what was flown.
        untestable: effects left out.
        reduced: inner products, nuisances integrated out.
    """

    def __init__(self, gram: FloatArray, bank: Bank, untestable: Sequence[str], precision: FloatArray | None = None
                 ) -> None:  # fmt: skip
        """Args: precision: prior precision of the nuisances; identity if omitted."""
        self.gram, self.bank, self.untestable = gram, bank, tuple(untestable)
        self.reduced = reduce(gram, bank, precision)

    @cached_property
    def known(self) -> tuple[dict[str, EffectFit], list[Hypothesis]]:
        """Every effect by itself; and no gap, single effects, pairs and triples as the library has them."""
        return _known(self.reduced, self.bank, self.untestable)

    @cached_property
    def formed(self) -> list[Hypothesis]:
        """The same hypotheses with their other forms."""
        return [replace(h, form=_form(self.reduced, self.gram, self.bank, h.fit)) if h.effects else h
                for h in self.known[1]]

    @cached_property
    def unknown(self) -> list[UnknownFit]:
        """Generic terms alone, by component."""
        return list(fit_unknown(self.reduced, self.bank))


def attribute(linear: Linear, noise: float = np.inf, courses: Sequence[UnknownFit] = ()) -> Posterior:
    """Posterior over no gap, sets of effects, and the unknown alone or beside them.

    Args:
        linear: what the inner products say.
        noise: whitened square that noise alone would leave, if known to be less than the best explanation leaves.
        courses: `course_fits` of what the model leaves.
    """
    reduced, gram, bank, (fits, _) = linear.reduced, linear.gram, linear.bank, linear.known
    found, unknown_fits = homes(linear.formed, with_courses(linear.unknown, courses), float(reduced[0, 0]), gram)
    least = min([h.left for h in found] + [u.left for u in unknown_fits] + [noise])
    found = forgive(found, float(reduced[0, 0]), least)
    for known in _leading(found):
        at_home, beside_it = _with_unknown(reduced, gram, bank, known, unknown_fits)
        found[found.index(known)] = replace(known, form=with_terms(known.form, at_home))
        found += beside_it
    kept = normalised(forgive(found, float(reduced[0, 0]), min(least, *(h.left for h in found))), 0.0)
    return Posterior(kept, fits, ambiguity(reduced, fits, _inclusion(kept)), reduced,
                     raw=gram, courses=tuple(courses))


def least_misfit(linear: Linear) -> float:
    """Whitened square that the best of all explanations leaves over, none of them in another form."""
    found, alone = linear.known[1], linear.unknown
    beside_known = [h for known in _leading(found)
                    for h in _with_unknown(linear.reduced, linear.gram, linear.bank, known, alone)[1]]
    return min([h.fit.misfit for h in found] + [u.misfit for u in alone]
               + [h.unknown.misfit for h in beside_known if h.unknown])  # fmt: skip


def _known(reduced: FloatArray, bank: Bank, untestable: Sequence[str]) -> tuple[dict[str, EffectFit], list[Hypothesis]]:
    by_family = {f: fit_family(reduced, f) for f in bank.families if f.effect.name not in untestable}
    names = list(dict.fromkeys(f.effect.name for f in by_family))
    alternatives = {n: [e for f, e in by_family.items() if f.effect.name == n] for n in names}
    fits = {n: _best(own) for n, own in alternatives.items()}
    found = [Hypothesis(SetFit(misfit=float(reduced[0, 0])), None, np.log(P_NONE), 0.0)]
    single = single_prior(len(names))
    for name, own in alternatives.items():
        parameters = len({e.family.parameter.name for e in own})  # of equal prior; pieces of a range share one
        log = float(np.logaddexp.reduce([e.log_evidence for e in own]) - np.log(parameters))
        found.append(Hypothesis(of_one(fits[name]), None, single, log))
    return fits, found + _several(reduced, bank, [i for i, f in enumerate(bank.families) if f in by_family])


def _leading(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Sets that something unknown is tried beside, nothing at all among them."""
    few = [h for h in found if len(h.effects) <= MOST_BESIDE]
    leading = sorted(few, key=lambda h: -h.log_posterior)[:BESIDE]
    return leading if found[0] in leading else [*leading, found[0]]


def _best(own: Sequence[EffectFit]) -> EffectFit:
    """The first parameter of those that would show, or one that is far likelier, and piece of its range.

    The smallest size is any piece's.
    """
    shows = {e.family.parameter.name for e in own if e.smallest is not None}
    able = [e for e in own if not shows or e.family.parameter.name in shows]
    likeliest, usual = (max(some, key=lambda e: e.log_evidence) for some in (
        able, [e for e in able if e.family.parameter is able[0].family.parameter]))
    best = likeliest if likeliest.log_evidence > usual.log_evidence + CLEARLY else usual
    shown = [e.smallest for e in own if e.smallest is not None and e.family.parameter is best.family.parameter]
    return replace(best, smallest=min(shown, key=lambda s: abs(s - best.family.parameter.neutral), default=None))


def _inclusion(found: Sequence[Hypothesis]) -> dict[str, float]:
    out: dict[str, float] = {}
    for hypothesis in found:
        for name in hypothesis.effects:
            out[name] = out.get(name, 0.0) + hypothesis.probability
    return out


def of_one(fit: EffectFit) -> SetFit:
    """An effect by itself as a set."""
    spread = ((fit.high95 - fit.low95) / 3.92) ** 2
    return SetFit((fit.family,), fit.log_evidence, (fit.estimate,), (fit.low95,), (fit.high95,), np.array([[spread]]),
                  fit.weights, fit.misfit)


def _several(reduced: FloatArray, bank: Bank, testable: list[int]) -> list[Hypothesis]:
    """Pairs and triples of effects."""
    if len(testable) < 3:
        return []
    problem, n = in_powers(reduced, bank.families), len({bank.families[i].effect.name for i in testable})
    grid = sizes_tried(problem)
    two = pairs(problem, testable, grid)
    three = grow(problem, two, testable, grid)
    out = []
    for modes in (two, three):
        best = np.argsort(-modes.log)[:INTEGRATED]
        out += _merged([integrate(problem, modes, int(i)) for i in best], n)
    return out


def _merged(fits: list[SetFit], testable: int) -> list[Hypothesis]:
    """One hypothesis for each set of names: where an effect has several parameters, the best of them."""
    chosen: dict[tuple[str, ...], SetFit] = {}
    for fit in fits:
        key = tuple(sorted(fit.effects))
        if key not in chosen or fit.log_evidence > chosen[key].log_evidence:
            chosen[key] = fit
    return [Hypothesis(fit, None, set_prior(fit.effects, testable), fit.log_evidence) for fit in chosen.values()]


def _form(reduced: FloatArray, raw: FloatArray, bank: Bank, fit: SetFit) -> Form:
    """A set in another form (see `sim2real.posterior.form`), its sizes free to give way."""
    terms, slopes = own_terms(fit.effects, bank.terms), _slopes(fit)
    first, rows = 1 + len(slopes), [term.row for term in terms]
    used = sorted({0, *(fit.weights or {}), *(row for slope in slopes for row in slope)})
    chosen = np.array([[w.get(row, 0.0) for row in used] for w in ({0: 1.0} | (fit.weights or {}), *slopes)])
    inner, onto = chosen @ reduced[np.ix_(used, used)] @ chosen.T, chosen @ reduced[np.ix_(used, rows)]
    together = np.block([[inner, onto], [onto.T, reduced[np.ix_(rows, rows)]]])
    kept = np.diag(reduced)[rows] / np.maximum(np.diag(raw)[rows], 1e-9)
    own = squares(fit, reduced)
    square = room(fit, own, may_bend(own, squares(fit, raw)), terms, kept, float(reduced[0, 0]))
    return gain(*without(together, first), square, fit.misfit,
                shares(fit.effects), [term.component for term in terms], powers=own_powers(fit, terms))


def _with_unknown(reduced: FloatArray, raw: FloatArray, bank: Bank, known: Hypothesis,
                  alone: Sequence[UnknownFit]) -> tuple[UnknownFit | None, list[Hypothesis]]:
    """An explanation with something unknown beside it (alone where it explains nothing), and terms of its form."""
    fits: list[UnknownFit] = list(alone)
    own: UnknownFit | None = None
    if known.effects:
        fits = fit_unknown(beside(reduced, known.fit, _slopes(known.fit)), bank)
        nothing = float(reduced[0, 0])
        explained = energies(squares(known.fit, reduced), max(nothing - known.fit.misfit, 0.0))
        own, fits = split(known.fit, known.form, fits, nothing, raw, explained)
    if not fits:
        return own, []
    best = max(fits, key=lambda u: u.log_evidence)
    gained = float(np.logaddexp.reduce([u.log_evidence for u in fits]) - np.log(len(fits)))
    prior = unknown_prior(known.log_prior if known.effects else None)
    return own, [Hypothesis(known.fit, best, prior, known.log_evidence + gained)]


def _slopes(fit: SetFit) -> list[dict[int, float]]:
    """Change of the flown rows' weights for a standard deviation of each estimate."""
    out = []
    spread = np.sqrt(np.diag(fit.covariance)) if fit.covariance is not None else np.zeros(0)
    for family, size, s in zip(fit.families, fit.estimate, spread, strict=True):
        p = family.parameter
        step = max(float(s), 1e-6 * (p.high - p.low))
        up, down = (flown_weights(family, float(np.clip(size + d, p.low, p.high))) for d in (step, -step))
        out.append({row: 0.5 * (up[row] - down[row]) for row in up})
    return out
