"""From inner products to probabilities: no gap, each effect, or something the library lacks.

All is linear in the nuisances and in the generic terms (Gaussian priors, integrated out in closed form) and one number
s per effect is integrated on a grid; signatures between the sizes flown are interpolated. With the residual
r(s) = v + sum a_i(s) D_i and nuisance signatures G ~ N(0, I):

    log L(s) = -r' (I + G G')^-1 r / 2,    (I + G G')^-1 = I - G (I + G'G)^-1 G'
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BarycentricInterpolator
from scipy.special import logsumexp

from icing_env.effects import Parameter
from icing_env.record import FloatArray
from sim2real.candidates import NUISANCE_STEP, Bank, Family

P_NONE, P_UNKNOWN = 0.5, 0.05  # prior; the rest is shared by the effects (assumed)
OTHER_SIGN = 0.25  # prior share of sizes of the sign opposite to the typical one (assumed)
WIDTH = 0.9  # standard deviation of log|s / typical| (assumed)
SCALES = (0.5, 1.0, 2.0)  # sizes of generic terms, in their own unit (assumed)
INDISTINGUISHABLE = 3.5  # whitened distance below which two explanations are told as one
DETECTABLE = 3.5  # whitened distance from no gap at which an effect counts as shown
GRID, FINE = 601, 161


@dataclass(frozen=True)
class EffectFit:
    """One effect's evidence.

    Attributes:
        log_evidence: log of its marginal likelihood over that of no gap.
        estimate, low95, high95: of `parameter`.
        distance: whitened distance of the fitted signature from none, nuisances taken out.
        smallest: size at which that distance would be DETECTABLE; None where the range does not reach it.
        weights: of the rows at the estimate.
        misfit: whitened square that is left over.
    """

    family: Family
    log_evidence: float
    estimate: float
    low95: float
    high95: float
    distance: float
    smallest: float | None
    weights: dict[int, float]
    misfit: float


@dataclass(frozen=True)
class UnknownFit:
    """A generic discrepancy of one component: its evidence, terms (name, coefficient, standard error) and misfit."""

    component: str
    log_evidence: float
    terms: tuple[tuple[str, float, float], ...]
    misfit: float
    weights: dict[int, float]


@dataclass(frozen=True)
class Posterior:
    """Probabilities that sum to one, with the fits behind them."""

    none: float
    effects: dict[str, float]
    unknown: float
    fits: dict[str, EffectFit]
    unknown_fits: tuple[UnknownFit, ...]
    classes: dict[str, tuple[str, ...]]
    reduced: FloatArray
    tempering: float = 1.0  # what the evidence was divided by

    @property
    def best_weights(self) -> dict[int, float]:
        """Rows of the most probable explanation beside the model, with their weights."""
        name = max(self.effects, key=lambda n: self.effects[n], default="")
        likeliest = max(self.none, self.unknown, self.effects.get(name, 0.0))
        if likeliest == self.none:
            return {}
        if likeliest == self.unknown:
            return max(self.unknown_fits, key=lambda u: u.log_evidence).weights
        return self.fits[name].weights

    @property
    def least_misfit(self) -> float:
        """Whitened square that the best of all explanations leaves over."""
        found = [fit.misfit for fit in self.fits.values()] + [fit.misfit for fit in self.unknown_fits]
        return min(found, default=float(self.reduced[0, 0]))


def reduce(gram: FloatArray, bank: Bank, precision: FloatArray | None = None) -> FloatArray:
    """Inner products after the nuisances are integrated out.

    Args:
        precision: prior precision of the nuisances in their own units; identity if omitted.
    """
    g = np.arange(1, 1 + len(bank.nuisances))
    inner = gram[np.ix_(g, g)] / NUISANCE_STEP**2 + (np.eye(len(g)) if precision is None else precision)
    cross = gram[:, g] / NUISANCE_STEP
    return np.asarray(gram - cross @ np.linalg.solve(inner, cross.T))


def nuisance_mean(gram: FloatArray, bank: Bank, posterior: Posterior, precision: FloatArray) -> FloatArray:
    """Nuisances [n], in standard deviations, under the most probable explanation."""
    weights = {0: 1.0} | posterior.best_weights
    rows, w = list(weights), np.array(list(weights.values()))
    g = np.arange(1, 1 + len(bank.nuisances))
    inner = gram[1 : 1 + len(g), 1 : 1 + len(g)] / NUISANCE_STEP**2 + precision
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
    """Posterior over no gap, every effect and the unknown."""
    reduced = reduce(gram, bank, precision)
    families: dict[str, list[EffectFit]] = {}
    for family in bank.families:
        if family.effect.name not in untestable:
            families.setdefault(family.effect.name, []).append(fit_family(reduced, family))
    fits, logs = {}, {}
    for name, found in families.items():
        fits[name] = max(found, key=lambda f: f.log_evidence)
        logs[name] = float(logsumexp([f.log_evidence for f in found]) - np.log(len(found)))
    unknown_fits = tuple(fit_unknown(reduced, bank))
    unknown = float(logsumexp([u.log_evidence for u in unknown_fits]) - np.log(len(unknown_fits)))
    share = np.log((1.0 - P_NONE - P_UNKNOWN) / max(len(fits), 1))
    all_logs = np.array([np.log(P_NONE), *(share + v for v in logs.values()), np.log(P_UNKNOWN) + unknown])
    probability = np.exp(all_logs - logsumexp(all_logs))
    probability /= probability.sum()
    by_effect = dict(zip(logs, (float(p) for p in probability[1:-1]), strict=True))
    return Posterior(float(probability[0]), by_effect, float(probability[-1]), fits, unknown_fits,
                     ambiguity(reduced, fits, by_effect), reduced)


def fit_family(reduced: FloatArray, family: Family) -> EffectFit:
    """Integrate one effect's size out."""
    parameter, rows = family.parameter, [0, *family.rows]
    block = reduced[np.ix_(rows, rows)]
    coarse = np.linspace(parameter.low, parameter.high, GRID)
    best = coarse[int(np.argmax(_log_likelihood(block, family, coarse)))]
    for _ in range(2):  # the likelihood may be far narrower than the range
        curvature = _information(block, family, best)
        width = min(6.0 / np.sqrt(max(curvature, 1e-12)), parameter.high - parameter.low)
        fine = np.clip(np.linspace(best - width, best + width, FINE), parameter.low, parameter.high)
        best = fine[int(np.argmax(_log_likelihood(block, family, fine)))]
    grid = np.unique(np.concatenate([coarse, fine]))
    gain = _log_likelihood(block, family, grid) + 0.5 * reduced[0, 0]
    prior = size_prior(parameter, grid)
    step = np.gradient(grid)
    log_mass = gain + np.log(np.maximum(prior * step, 1e-300))
    total = float(logsumexp(log_mass))
    cumulative = np.cumsum(np.exp(log_mass - total))
    low, mid, high = (float(np.interp(q, cumulative, grid)) for q in (0.025, 0.5, 0.975))
    weights = dict(zip(family.rows, _weights(family, np.array([mid]))[0], strict=True))
    misfit = float(reduced[0, 0] - 2.0 * np.max(gain))
    return EffectFit(family, total, mid, low, high, _distance(reduced, weights), _smallest(reduced, family), weights,
                     misfit)


def size_prior(parameter: Parameter, size: FloatArray) -> FloatArray:
    """Density of an effect's size: log-normal about the typical one, a share with the other sign, inside its range."""
    reach = abs(parameter.typical) or 0.25 * max(parameter.high, -parameter.low)
    magnitude = np.maximum(np.abs(size - parameter.neutral), 1e-9 * reach)
    shape = np.exp(-0.5 * (np.log(magnitude / reach) / WIDTH) ** 2) / magnitude
    sign = np.sign(parameter.typical) or 1.0
    both = parameter.low < parameter.neutral < parameter.high
    other = OTHER_SIGN if both else 0.0
    if parameter.typical == parameter.neutral:
        other = 0.5
    density = shape * np.where(np.sign(size - parameter.neutral) == sign, 1.0 - other, other)
    total = float(np.sum(density * np.gradient(size)))
    return np.asarray(density / total) if total > 0.0 else density


def _weights(family: Family, size: FloatArray) -> FloatArray:
    """Interpolation weights [sizes, rows of the family]; the neutral row carries the rest."""
    points = np.array([family.parameter.neutral, *family.nodes])
    return np.asarray(BarycentricInterpolator(points, np.eye(len(points)))(size)[:, 1:])


def _log_likelihood(block: FloatArray, family: Family, size: FloatArray) -> FloatArray:
    w = np.column_stack([np.ones(len(size)), _weights(family, size)])
    return np.asarray(-0.5 * np.einsum("si,ij,sj->s", w, block, w))


def _information(block: FloatArray, family: Family, size: float) -> float:
    """Square of the whitened signature per unit of size."""
    span = family.parameter.high - family.parameter.low
    ends = np.clip([size - 1e-3 * span, size + 1e-3 * span], family.parameter.low, family.parameter.high)
    a, b = _weights(family, ends)
    change = (b - a) / (ends[1] - ends[0])
    return float(change @ block[1:, 1:] @ change)


def _distance(reduced: FloatArray, weights: dict[int, float]) -> float:
    rows, w = list(weights), np.array(list(weights.values()))
    return float(np.sqrt(max(w @ reduced[np.ix_(rows, rows)] @ w, 0.0)))


def _smallest(reduced: FloatArray, family: Family) -> float | None:
    """Smallest size towards the typical sign at which the signature's distance from none reaches DETECTABLE."""
    parameter = family.parameter
    end = parameter.high if (parameter.typical or 1.0) > parameter.neutral else parameter.low
    sizes = parameter.neutral + (end - parameter.neutral) * np.geomspace(1e-3, 1.0, 60)
    w = _weights(family, sizes)
    rows = list(family.rows)
    distance = np.sqrt(np.maximum(np.einsum("si,ij,sj->s", w, reduced[np.ix_(rows, rows)], w), 0.0))
    shown = np.flatnonzero(distance >= DETECTABLE)
    return float(sizes[shown[0]]) if len(shown) else None


def fit_unknown(reduced: FloatArray, bank: Bank) -> list[UnknownFit]:
    """Evidence of generic terms, component by component."""
    out = []
    for component in dict.fromkeys(term.component for term in bank.terms):
        terms = [term for term in bank.terms if term.component == component]
        rows = [term.row for term in terms]
        T, t = reduced[np.ix_(rows, rows)], -reduced[rows, 0]
        if np.max(np.diag(T)) <= 0.0:
            continue
        logs, means, errors = [], [], []
        for scale in SCALES:
            inner = np.eye(len(rows)) + scale**2 * T
            solved = np.linalg.solve(inner, scale * t)
            logs.append(0.5 * float(scale * t @ solved) - 0.5 * float(np.linalg.slogdet(inner)[1]))
            means.append(scale * solved)
            errors.append(scale * np.sqrt(np.diag(np.linalg.inv(inner))))
        k = int(np.argmax(logs))
        found = tuple((term.name, float(m), float(e)) for term, m, e in zip(terms, means[k], errors[k], strict=True))
        left = float(reduced[0, 0] - means[k] @ t)
        out.append(UnknownFit(component, float(logsumexp(logs) - np.log(len(SCALES))), found, left,
                              dict(zip(rows, (float(m) for m in means[k]), strict=True))))
    return out


def ambiguity(reduced: FloatArray, fits: dict[str, EffectFit],
              probability: dict[str, float]) -> dict[str, tuple[str, ...]]:
    """For every effect those whose signatures these records cannot tell from its own at its fitted size.

    Distance of i to j: the least over j's size (linear about its fit) of the whitened difference of their signatures.
    """
    out = {}
    for name, fit in fits.items():
        rows, w = list(fit.weights), np.array(list(fit.weights.values()))
        near = []
        for other, rival in fits.items():
            if other == name or probability[other] < 1e-4 * max(probability.values()):
                continue
            rows2, w2 = list(rival.weights), np.array(list(rival.weights.values()))
            own = float(w @ reduced[np.ix_(rows, rows)] @ w)
            theirs = float(w2 @ reduced[np.ix_(rows2, rows2)] @ w2)
            cross = float(w @ reduced[np.ix_(rows, rows2)] @ w2)
            apart = own - cross**2 / theirs if theirs > 0.0 else own
            if own > 0.0 and np.sqrt(max(apart, 0.0)) < INDISTINGUISHABLE:
                near.append(other)
        out[name] = tuple(near)
    return out
