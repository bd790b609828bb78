"""Evidence of sets of effects from inner products alone: every pair on grids of sizes, triples from the best pairs.

With the residual r(x) = v + sum over members m of sum_k x_m^k E_mk (nuisances integrated out beforehand) a set's
likelihood is exp(-r'r/2), a polynomial of a few inner products, whatever the length of the records.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.library.candidates import Family
from sim2real.library.sizes import Powers, flown_weights

COARSE = 31  # sizes of each effect on the grid that all pairs are tried on
DESCENTS = 8
INTEGRATED = 40  # sets of one size whose evidence is integrated on a grid; the rest is Laplace's approximation
POINTS = {1: 201, 2: 41, 3: 13}  # of that grid along each axis
SPAN = 5.0  # standard deviations that it reaches
SEEDS = 6  # pairs that triples are grown from
ROUNDED = 1e-12  # of the information of each, that rounding may take
Members = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class SetFit:
    """A set of effects with its evidence.

    Attributes:
        families: one of each effect.
        log_evidence: log of the marginal likelihood over that of no gap.
        estimate, low95, high95: of each family's parameter.
        covariance: of the estimates [k, k].
        weights: of the flown rows at the estimates.
        misfit: whitened square that is left over at best.
    """

    families: tuple[Family, ...] = ()
    log_evidence: float = 0.0
    estimate: tuple[float, ...] = ()
    low95: tuple[float, ...] = ()
    high95: tuple[float, ...] = ()
    covariance: FloatArray | None = None
    weights: dict[int, float] | None = None
    misfit: float = 0.0

    @property
    def values(self) -> dict[str, dict[str, float]]:
        """Estimates, by effect and parameter."""
        return {f.effect.name: {f.parameter.name: size} for f, size in zip(self.families, self.estimate, strict=True)}

    @property
    def effects(self) -> tuple[str, ...]:
        """Names, in the order of the families."""
        return tuple(f.effect.name for f in self.families)


@dataclass(frozen=True)
class Modes:
    """Best sizes of P sets of k members each.

    members, x: [P, k]; cost: [P], half the whitened square left over; information: [P, k, k] per unit of x; log: [P],
    Laplace's approximation of the evidence over no gap.
    """

    members: Members
    x: FloatArray
    cost: FloatArray
    information: FloatArray
    log: FloatArray


Grid = tuple[FloatArray, FloatArray, FloatArray]


def pairs(problem: Powers, testable: Sequence[int], grid: Grid) -> Modes:
    """Every pair of families of different effects at its best sizes; `grid` of `sizes_tried`."""
    names = [f.effect.name for f in problem.families]
    chosen = np.array([(i, j) for i in testable for j in testable if i < j and names[i] != names[j]], np.intp)
    x, energy, cross = grid
    start = np.empty((len(chosen), 2))
    for i in {int(i) for i, _ in chosen}:
        at = np.flatnonzero(chosen[:, 0] == i)
        others = chosen[at, 1]
        together = energy[i][:, None, None] + energy[others] + cross[i][:, others]  # [own size, other, its size]
        best = np.argmin(np.swapaxes(together, 0, 1).reshape(len(at), -1), axis=1)
        start[at, 0], start[at, 1] = x[i, best // COARSE], x[others, best % COARSE]
    return descend(problem, chosen.reshape(-1, 2), start)


def grow(problem: Powers, found: Modes, testable: Sequence[int], grid: Grid) -> Modes:
    """Sets with one member more than the SEEDS best of `found`; `grid` of `sizes_tried`."""
    names = [f.effect.name for f in problem.families]
    members: list[tuple[int, ...]] = []
    known: set[frozenset[int]] = set()
    start: list[tuple[float, ...]] = []
    x, _, cross = grid
    for n in np.argsort(-found.log)[:SEEDS]:
        base = found.members[n]
        inside = {names[m] for m in base}
        w = np.concatenate([[1.0], np.zeros(len(problem.gram) - 1)])
        for m, at in zip(base, found.x[n], strict=True):
            w[_columns(problem, int(m))] = at ** np.arange(1, problem.degree + 1)
        slope = problem.gram @ w
        for j in testable:
            together = frozenset((*map(int, base), j))
            if names[j] in inside or together in known:
                continue
            known.add(together)
            powers = x[j][:, None] ** np.arange(1, problem.degree + 1)
            change = powers @ slope[_columns(problem, j)] + 0.5 * np.diagonal(cross[j, :, j, :])
            members.append((*map(int, base), j))
            start.append((*found.x[n], x[j, int(np.argmin(change))]))
    k = found.members.shape[1] + 1
    return descend(problem, np.array(members, np.intp).reshape(-1, k), np.array(start).reshape(-1, k))


def _columns(problem: Powers, member: int) -> slice:
    return slice(1 + member * problem.degree, 1 + (member + 1) * problem.degree)


def sizes_tried(problem: Powers) -> Grid:
    """Sizes x [F, COARSE], half the square each leaves over less its residual's, and inner products between them."""
    x = np.linspace(problem.low, problem.high, COARSE, axis=1)
    powers = x[:, :, None] ** np.arange(1, problem.degree + 1)
    count, d = len(problem.families), problem.degree
    inner = problem.gram[1:, 1:].reshape(count, d, count * d)
    onto = (powers @ inner).reshape(count, COARSE, count, d).transpose(2, 3, 0, 1).reshape(count, d, -1)
    cross = (powers @ onto).reshape(count, COARSE, count, COARSE)  # the same both ways round
    linear = (powers @ problem.gram[1:, 0].reshape(count, d, 1))[..., 0]
    own = np.array([np.diagonal(cross[m, :, m, :]) for m in range(count)])
    return x, linear + 0.5 * own, cross


def descend(problem: Powers, members: Members, start: FloatArray) -> Modes:
    """Gauss-Newton from `start` to each set's best sizes inside their ranges, all sets side by side."""
    if not len(members):
        none = np.zeros((0, members.shape[1]))
        return Modes(members, none, np.zeros(0), np.zeros((0, members.shape[1], members.shape[1])), np.zeros(0))
    d = problem.degree
    index = np.concatenate([np.zeros((len(members), 1), np.intp), (1 + members[:, :, None] * d + np.arange(d)).reshape(
        len(members), -1)], axis=1)  # fmt: skip
    block = problem.gram[index[:, :, None], index[:, None, :]]
    low, high = problem.low[members], problem.high[members]
    ridge = np.eye(members.shape[1]) / (high - low)[:, :, None] ** 2
    x, damping = np.clip(start, low, high), np.ones(len(members))
    cost = _cost(block, x, d)
    for _ in range(DESCENTS):
        slope, information = _derivatives(block, x, d)
        free = ~(((x <= low) & (slope > 0.0)) | ((x >= high) & (slope < 0.0)))
        inner = np.where(free[:, :, None] & free[:, None, :], information, 0.0) + ridge
        step = -np.linalg.solve(inner, np.where(free, slope, 0.0)[..., None])[..., 0]
        tried = np.clip(x + damping[:, None] * step, low, high)
        new = _cost(block, tried, d)
        better = new < cost
        x, cost = np.where(better[:, None], tried, x), np.where(better, new, cost)
        damping = np.where(better, np.minimum(2.0 * damping, 1.0), 0.3 * damping)
    information = firm(_derivatives(block, x, d)[1] + ridge)
    return Modes(members, x, cost, information, _laplace(problem, members, x, cost, information))


def firm(information: FloatArray) -> FloatArray:
    """Information [..., k, k] with what rounding may take of each: flights that depart alike are one and the same."""
    return np.asarray(information + ROUNDED * information * np.eye(information.shape[-1]))


def _weights(x: FloatArray, degree: int) -> FloatArray:
    """[..., 1 + k degree] of sizes [..., k]."""
    powers = np.cumprod(np.broadcast_to(x[..., None], (*x.shape, degree)), axis=-1)
    return np.concatenate([np.ones((*x.shape[:-1], 1)), powers.reshape(*x.shape[:-1], -1)], axis=-1)


def _cost(block: FloatArray, x: FloatArray, degree: int) -> FloatArray:
    w = _weights(x, degree)
    return np.asarray(0.5 * np.einsum("pi,pi->p", (block @ w[..., None])[..., 0], w))


def _derivatives(block: FloatArray, x: FloatArray, degree: int) -> tuple[FloatArray, FloatArray]:
    """Slope [P, k] of the cost and Gauss-Newton's second derivative [P, k, k]."""
    count, k = x.shape
    change = np.zeros((count, k, 1 + k * degree))
    powers = np.arange(1, degree + 1)
    for m in range(k):
        change[:, m, 1 + m * degree : 1 + (m + 1) * degree] = powers * x[:, m, None] ** (powers - 1)
    onto = change @ block
    return (onto @ _weights(x, degree)[..., None])[..., 0], onto @ np.swapaxes(change, 1, 2)


def _laplace(problem: Powers, members: Members, x: FloatArray, cost: FloatArray, information: FloatArray) -> FloatArray:
    """Log evidence over no gap; no member's share of prior under its likelihood may exceed one."""
    log = 0.5 * problem.gram[0, 0] - cost
    left = information
    for m in range(members.shape[1]):
        density = problem.density(members[:, m], x[:, m])
        width = np.sqrt(2.0 * np.pi / left[:, m, m])  # given the members before: determinants by elimination
        log = log + np.log(np.clip(density * width, 1e-12, 1.0))
        left = left - left[:, :, m, None] * left[:, m, None, :] / left[:, m, m, None, None]
    return np.asarray(log)


def integrate(problem: Powers, modes: Modes, n: int) -> SetFit:
    """One set's evidence, estimates and intervals on a grid along the axes of its likelihood."""
    members, k = modes.members[n], modes.members.shape[1]
    root = np.linalg.cholesky(np.linalg.inv(modes.information[n]))
    z = np.array(list(product(np.linspace(-SPAN, SPAN, POINTS[k]), repeat=k)))
    x = modes.x[n] + z @ root.T
    inside = np.all((x >= problem.low[members]) & (x <= problem.high[members]), axis=1)
    x = np.concatenate([x[inside], modes.x[n][None]]) if not inside.any() else x[inside]
    index = np.concatenate([[0], *(np.arange(1 + m * problem.degree, 1 + (m + 1) * problem.degree) for m in members)])
    w = _weights(x, problem.degree)
    cost = 0.5 * np.einsum("ni,ni->n", w @ problem.gram[np.ix_(index, index)], w)
    prior = np.prod(problem.density(members, x), axis=1)
    cell = float(np.prod(np.diag(root))) * (2.0 * SPAN / (POINTS[k] - 1)) ** k
    mass = np.exp(np.min(cost) - cost) * np.maximum(prior, 1e-300) * cell
    total = float(mass.sum())
    log = 0.5 * problem.gram[0, 0] - float(np.min(cost)) + np.log(total)
    sizes, share = problem.size(members, x), mass / total
    mean = share @ sizes
    low, middle, high = (tuple(_quantile(sizes[:, i], share, q) for i in range(k)) for q in (0.025, 0.5, 0.975))
    families = tuple(problem.families[m] for m in members)
    weights: dict[int, float] = {}
    for family, size in zip(families, middle, strict=True):
        weights |= flown_weights(family, size)
    return SetFit(families, float(log), middle, low, high, np.einsum("n,ni,nj->ij", share, sizes - mean, sizes - mean),
                  weights, float(2.0 * np.min(cost)))


def _quantile(values: FloatArray, share: FloatArray, q: float) -> float:
    order = np.argsort(values)
    return float(np.interp(q, np.cumsum(share[order]) - 0.5 * share[order], values[order]))
