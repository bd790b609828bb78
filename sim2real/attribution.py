"""From inner products to probabilities: no gap, effects alone or together, or something the library lacks.

All is linear in the nuisances and in the generic terms (Gaussian priors, integrated out in closed form); sizes of
effects are integrated on grids, signatures between the sizes flown interpolated. With the residual
r(s) = v + sum a_i(s) D_i and nuisance signatures G ~ N(0, I):

    log L(s) = -r' (I + G G')^-1 r / 2,    (I + G G')^-1 = I - G (I + G'G)^-1 G'
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from icing_env.record import FloatArray
from sim2real.candidates import NUISANCE_STEP, Bank
from sim2real.form import gain, room, shares, split, terms_of, without
from sim2real.generic import UnknownFit, beside, fit_unknown
from sim2real.sets import INTEGRATED, SetFit, grow, integrate, pairs
from sim2real.singles import EffectFit, ambiguity, fit_family
from sim2real.sizes import flown_weights, in_powers

# Prior (assumed): what is left is shared by single effects. A pair is about one per cent as likely as either member.
P_NONE, P_UNKNOWN, P_PAIRS, P_TRIPLES, P_BESIDE = 0.5, 0.05, 0.07, 0.007, 0.007
BESIDE = 6  # leading sets that something unknown is tried beside
KEPT = 1e-5  # sets of several effects less probable than this are dropped


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One explanation: a set of effects (empty: none) and perhaps something unknown beside it.

    `form`: log evidence that the set gains where its effects may have another form than the library's.
    """

    fit: SetFit
    unknown: UnknownFit | None
    log_prior: float
    log_evidence: float
    form: float = 0.0
    probability: float = 0.0

    @property
    def effects(self) -> tuple[str, ...]:
        """Names, in alphabetical order."""
        return tuple(sorted(self.fit.effects))

    @property
    def log_posterior(self) -> float:
        """But for a constant."""
        return self.log_prior + self.log_evidence + self.form

    @property
    def weights(self) -> dict[int, float]:
        """Of the flown rows, beside the model's."""
        return (self.fit.weights or {}) | (self.unknown.weights if self.unknown else {})


@dataclass(frozen=True)
class Posterior:
    """Probabilities that sum to one, with the fits behind them.

    Attributes:
        hypotheses: the most probable first.
        fits: every effect on its own.
        unknown_fits: generic terms on their own, by component.
        classes: effects that one effect cannot be told from.
        reduced: inner products, nuisances integrated out.
        tempering: what the evidence was divided by.
    """

    hypotheses: tuple[Hypothesis, ...]
    fits: dict[str, EffectFit]
    unknown_fits: tuple[UnknownFit, ...]
    classes: dict[str, tuple[str, ...]]
    reduced: FloatArray
    tempering: float = 1.0

    @property
    def none(self) -> float:
        """Probability of no gap."""
        return sum(h.probability for h in self.hypotheses if not h.effects and h.unknown is None)

    @property
    def unknown(self) -> float:
        """Probability that something is there which the library lacks, with or without known effects."""
        return sum(h.probability for h in self.hypotheses if h.unknown is not None)

    @property
    def effects(self) -> dict[str, float]:
        """Probability that each effect is there, alone or with others."""
        found = dict.fromkeys(self.fits, 0.0)
        for hypothesis in self.hypotheses:
            for name in hypothesis.effects:
                found[name] += hypothesis.probability
        return found

    @property
    def best(self) -> Hypothesis:
        """The most probable explanation."""
        return self.hypotheses[0]

    def leading(self, name: str) -> SetFit:
        """The most probable set that holds an effect."""
        return next(h.fit for h in self.hypotheses if name in h.effects)

    @property
    def least_misfit(self) -> float:
        """Whitened square that the best of all explanations leaves over."""
        return min([h.unknown.misfit if h.unknown else h.fit.misfit for h in self.hypotheses]
                   + [u.misfit for u in self.unknown_fits])  # fmt: skip


def reduce(gram: FloatArray, bank: Bank, precision: FloatArray | None = None) -> FloatArray:
    """Inner products after the nuisances are integrated out.

    Args:
        precision: prior precision of the nuisances in their own units; identity if omitted.
    """
    g = np.arange(1, 1 + len(bank.nuisances))
    inner = gram[np.ix_(g, g)] / NUISANCE_STEP**2 + (np.eye(len(g)) if precision is None else precision)
    cross = gram[:, g] / NUISANCE_STEP
    return np.asarray(gram - cross @ np.linalg.solve(inner, cross.T))


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


def attribute(gram: FloatArray, bank: Bank, untestable: Sequence[str],
              precision: FloatArray | None = None) -> Posterior:
    """Posterior over no gap, sets of effects, and the unknown alone or beside them."""
    reduced = reduce(gram, bank, precision)
    by_family = {f: fit_family(reduced, f) for f in bank.families if f.effect.name not in untestable}
    names = list(dict.fromkeys(f.effect.name for f in by_family))
    alternatives = {n: [e for f, e in by_family.items() if f.effect.name == n] for n in names}
    fits = {n: max(found, key=lambda e: e.log_evidence) for n, found in alternatives.items()}
    found = [Hypothesis(SetFit(misfit=float(reduced[0, 0])), None, np.log(P_NONE), 0.0)]
    single = np.log((1.0 - P_NONE - P_UNKNOWN - P_PAIRS - P_TRIPLES - P_BESIDE) / max(len(names), 1))
    for name, own in alternatives.items():
        log = float(logsumexp([e.log_evidence for e in own]) - np.log(len(own)))
        found.append(Hypothesis(_alone(fits[name]), None, single, log))
    found += _several(reduced, bank, [i for i, f in enumerate(bank.families) if f in by_family])
    found = [replace(h, form=_form(reduced, bank, h.fit)) if h.effects else h for h in found]
    leading = sorted(found, key=lambda h: -h.log_posterior)[:BESIDE]
    if found[0] not in leading:
        leading.append(found[0])
    unknown_fits = tuple(fit_unknown(reduced, bank))
    for known in leading:
        form, beside_it = _with_unknown(reduced, bank, known, unknown_fits)
        found[found.index(known)] = replace(known, form=max(known.form, form))
        found += beside_it
    kept = normalised(found)
    return Posterior(kept, fits, unknown_fits, ambiguity(reduced, fits, _inclusion(kept)), reduced)


def normalised(found: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Probabilities of hypotheses, sorted; sets of several that are next to impossible are dropped."""
    logs = np.array([h.log_posterior for h in found])
    share = np.exp(logs - logsumexp(logs))
    keep = [i for i, h in enumerate(found) if share[i] > KEPT or (len(h.effects) < 2 and not (h.effects and h.unknown))]
    total = float(share[keep].sum())
    out = [replace(found[i], probability=float(share[i]) / total) for i in keep]
    return tuple(sorted(out, key=lambda h: -h.probability))


def _inclusion(found: Sequence[Hypothesis]) -> dict[str, float]:
    out: dict[str, float] = {}
    for hypothesis in found:
        for name in hypothesis.effects:
            out[name] = out.get(name, 0.0) + hypothesis.probability
    return out


def _alone(fit: EffectFit) -> SetFit:
    spread = ((fit.high95 - fit.low95) / 3.92) ** 2
    return SetFit((fit.family,), fit.log_evidence, (fit.estimate,), (fit.low95,), (fit.high95,), np.array([[spread]]),
                  fit.weights, fit.misfit)


def _several(reduced: FloatArray, bank: Bank, testable: list[int]) -> list[Hypothesis]:
    """Pairs and triples of effects."""
    if len(testable) < 3:
        return []
    problem, n = in_powers(reduced, bank.families), len({bank.families[i].effect.name for i in testable})
    two = pairs(problem, testable)
    three = grow(problem, two, testable)
    out = []
    for modes, prior, count in ((two, P_PAIRS, n * (n - 1) / 2), (three, P_TRIPLES, n * (n - 1) * (n - 2) / 6)):
        best = np.argsort(-modes.log)[:INTEGRATED]
        out += _merged([integrate(problem, modes, int(i)) for i in best], float(np.log(prior / count)))
    return out


def _merged(fits: list[SetFit], log_prior: float) -> list[Hypothesis]:
    """One hypothesis for each set of names: where an effect has several parameters, the best of them."""
    chosen: dict[tuple[str, ...], SetFit] = {}
    for fit in fits:
        key = tuple(sorted(fit.effects))
        if key not in chosen or fit.log_evidence > chosen[key].log_evidence:
            chosen[key] = fit
    return [Hypothesis(fit, None, log_prior, fit.log_evidence) for fit in chosen.values()]


def _form(reduced: FloatArray, bank: Bank, fit: SetFit) -> float:
    """What another form of its effects adds to a set's evidence (see `sim2real.form`), its sizes free to give way."""
    terms, slopes = terms_of(fit, reduced, bank.terms), _slopes(fit)
    first = 1 + len(slopes)
    chosen = np.zeros((first + len(terms), len(reduced)))
    chosen[0, 0] = 1.0
    for row, weight in (fit.weights or {}).items():
        chosen[0, row] = weight
    for m, slope in enumerate(slopes):
        chosen[1 + m, list(slope)] = list(slope.values())
    chosen[range(first, len(chosen)), [term.row for term in terms]] = 1.0
    return gain(*without(chosen @ reduced @ chosen.T, first), room(fit, reduced, terms), shares(fit))


def _with_unknown(reduced: FloatArray, bank: Bank, known: Hypothesis,
                  alone: Sequence[UnknownFit]) -> tuple[float, list[Hypothesis]]:
    """An explanation with something unknown beside it (alone where it explains nothing), and its form's evidence."""
    fits, form = list(alone), 0.0
    if known.effects:
        fits = fit_unknown(beside(reduced, bank, known.fit, _slopes(known.fit)), bank)
        form, fits = split(known.fit, reduced, fits)
    if not fits:
        return form, []
    best = max(fits, key=lambda u: u.log_evidence)
    gained = float(logsumexp([u.log_evidence for u in fits]) - np.log(len(fits)))
    share = np.log(P_BESIDE / (1.0 - P_NONE)) + known.log_prior if known.effects else np.log(P_UNKNOWN)
    return form, [Hypothesis(known.fit, best, float(share), known.log_evidence + gained)]


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
