"""Every effect on its own: its size integrated on a grid, what it would take to be seen, and what it is taken for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from icing_env.record import FloatArray
from sim2real.library.candidates import Family
from sim2real.library.sizes import interpolated, piece_prior

INDISTINGUISHABLE = 3.5  # whitened distance below which two explanations are told as one
DETECTABLE = 3.5  # whitened distance from no gap at which an effect counts as shown
TAKES = 0.5  # of the whitened square of an effect's signature, that one it is told as one with takes (assumed)
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


def fit_family(reduced: FloatArray, family: Family) -> EffectFit:
    """Integrate one effect's size out."""
    rows = [0, *family.rows]
    block = reduced[np.ix_(rows, rows)]
    coarse = np.linspace(family.low, family.high, GRID)
    best = coarse[int(np.argmax(_log_likelihood(block, family, coarse)))]
    for _ in range(2):  # the likelihood may be far narrower than the range
        curvature = _information(block, family, best)
        width = min(6.0 / np.sqrt(max(curvature, 1e-12)), family.high - family.low)
        fine = np.clip(np.linspace(best - width, best + width, FINE), family.low, family.high)
        best = fine[int(np.argmax(_log_likelihood(block, family, fine)))]
    grid = np.unique(np.concatenate([coarse, fine]))
    gain = _log_likelihood(block, family, grid) + 0.5 * reduced[0, 0]
    prior = piece_prior(family, grid)
    step = np.gradient(grid)
    log_mass = gain + np.log(np.maximum(prior * step, 1e-300))
    total = float(np.logaddexp.reduce(log_mass))
    mass = np.exp(log_mass - total)
    cumulative = np.cumsum(mass) - 0.5 * mass
    low, mid, high = (float(np.interp(q, cumulative, grid)) for q in (0.025, 0.5, 0.975))
    weights = dict(zip(family.rows, interpolated(family, np.array([mid]))[0], strict=True))
    misfit = float(reduced[0, 0] - 2.0 * np.max(gain))
    return EffectFit(family, total, mid, low, high, _distance(reduced, weights), _smallest(reduced, family), weights,
                     misfit)


def _log_likelihood(block: FloatArray, family: Family, size: FloatArray) -> FloatArray:
    w = np.column_stack([np.ones(len(size)), interpolated(family, size)])
    return np.asarray(-0.5 * np.einsum("si,si->s", w @ block, w))


def _information(block: FloatArray, family: Family, size: float) -> float:
    """Square of the whitened signature per unit of size."""
    span = family.high - family.low
    ends = np.clip([size - 1e-3 * span, size + 1e-3 * span], family.low, family.high)
    a, b = interpolated(family, ends)
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
    sizes = sizes[(sizes >= family.low) & (sizes <= family.high)]  # of this piece of the range
    if not len(sizes):
        return None
    w = interpolated(family, sizes)
    rows = list(family.rows)
    distance = np.sqrt(np.maximum(np.einsum("si,si->s", w @ reduced[np.ix_(rows, rows)], w), 0.0))
    shown = np.flatnonzero(distance >= DETECTABLE)
    return float(sizes[shown[0]]) if len(shown) else None


def ambiguity(reduced: FloatArray, fits: dict[str, EffectFit],
              probability: dict[str, float]) -> dict[str, tuple[str, ...]]:
    """For every effect those whose signatures these records cannot tell from its own at its fitted size.

    Distance of i to j: the least over j's size (linear about its fit) of the whitened difference of their signatures.
    One that takes less than TAKES of what an effect says does no better than none, however little there is to say.
    """
    names = list(fits)
    weights = np.zeros((len(names), len(reduced)))
    for i, fit in enumerate(fits.values()):
        weights[i, list(fit.weights)] = list(fit.weights.values())
    inner = weights @ reduced @ weights.T
    own = np.diag(inner)
    apart = own[:, None] - np.where(own > 0.0, inner**2 / np.where(own > 0.0, own, 1.0), 0.0)
    near = (own[:, None] > 0.0) & (np.sqrt(np.maximum(apart, 0.0)) < INDISTINGUISHABLE)
    near &= apart <= (1.0 - TAKES) * own[:, None]
    near &= np.array([probability[name] >= 1e-4 * max(probability.values(), default=0.0) for name in names], bool)
    return {name: tuple(names[j] for j in np.flatnonzero(near[i]) if j != i) for i, name in enumerate(names)}
