"""A set flown somewhere: what it leaves there, its slopes, how far it may go, and the best step within that."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from icing_env.record import FloatArray
from sim2real.actuators.paths import path_gram
from sim2real.library.candidates import NUISANCE_STEP
from sim2real.library.terms import Term
from sim2real.posterior.hypotheses import Settled
from sim2real.posterior.sets import SetFit
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.whitening import SETTLE

ROUNDS, PATIENCE = 10, 2  # steps with the same slopes by nuisances, and those of them that need not help
SHORTEST = 0.25  # share of a step that is tried before slopes by nuisances are flown anew
SETTLED = 0.2  # gain of half the whitened square that is worth another step
FARTHEST = 5.0  # standard deviations of a nuisance: what is beyond is no nuisance but a gap
# Step of a size for its slope, in standard deviations, as nuisances' are. Where a size and a nuisance change the same
# number, slopes over longer steps bend apart and would tell the two from each other.
SIZE_STEP = NUISANCE_STEP
DIFFERENCE = 1e-14  # of the square that is left, that rounding takes where slopes are differences of inner products

Place = tuple[FloatArray, FloatArray]  # sizes [k] and nuisances [n]


@dataclass(frozen=True)
class Slopes:
    """What a deviation of each nuisance makes of one record [N x channels, n], and generic terms [N x channels, terms].

    Lent from point to point; their inner products are taken once.
    """

    rows: FloatArray
    terms: FloatArray

    @cached_property
    def inner(self) -> FloatArray:
        """Inner products [n, n]."""
        return np.asarray(self.rows.T @ self.rows)

    @cached_property
    def onto(self) -> FloatArray:
        """Inner products with the terms [n, terms]."""
        return np.asarray(self.rows.T @ self.terms)

    def beside(self, rows: FloatArray) -> FloatArray:
        """Inner products of other rows [N x channels, m], then these."""
        across = rows.T @ self.rows
        return np.block([[rows.T @ rows, across], [across.T, self.inner]])


@dataclass(frozen=True)
class Point:
    """A set at given sizes [k] and nuisances [n], flown.

    cost: half the whitened square it leaves, the nuisances' prior included, tempered; slope and information: of sizes
    (in ranges of their parameters), then nuisances; steps: of each size for its slope [k]; weights: of generic terms
    flown with it, by row of the bank; rows: what it leaves of every record, then what these steps make of that, but for
    the paths [N x channels, 1 + k]; slopes: the same of a deviation of each nuisance.
    """

    sizes: FloatArray
    nuisances: FloatArray
    cost: float
    slope: FloatArray
    information: FloatArray
    steps: FloatArray
    weights: Mapping[int, float] = field(default_factory=dict)
    rows: Sequence[FloatArray] = ()
    slopes: Sequence[Slopes] = ()

    @property
    def held(self) -> NDArray[np.intp]:
        """Nuisances that have gone as far as they may."""
        return np.flatnonzero(np.abs(self.nuisances) > FARTHEST - 1e-9)

    @property
    def settled(self) -> Settled:
        """Nuisances and their covariance, what the sizes leave open in it."""
        unit, k = 1.0 / np.sqrt(np.diag(self.information)), len(self.sizes)
        covariance = np.linalg.inv(self.information * unit[:, None] * unit) * unit[:, None] * unit
        return Settled(self.nuisances, np.asarray(covariance[k:, k:], np.float64))

    def without_held(self) -> Point:
        """The same with these as constants."""
        at, slope = len(self.sizes) + self.held, self.slope.copy()
        slope[at] = 0.0
        return replace(self, slope=slope, information=holding(at, self.information))


class Places:
    """Where sets settled, by their effects and parameters: what is flown again begins there."""

    def __init__(self) -> None:
        self.kept: dict[frozenset[tuple[str, str]], tuple[dict[tuple[str, str], float], FloatArray]] = {}

    def keep(self, fit: SetFit, point: Point) -> None:
        """Remember where a set settled."""
        self.kept[frozenset(_named(fit))] = dict(zip(_named(fit), point.sizes, strict=True)), point.nuisances

    def begin(self, fit: SetFit, nuisances: FloatArray) -> tuple[SetFit, FloatArray]:
        """A set with sizes, and nuisances [n], to begin from: those given where it has not settled yet."""
        if frozenset(_named(fit)) not in self.kept:
            return fit, nuisances
        sizes, settled = self.kept[frozenset(_named(fit))]
        return replace(fit, estimate=tuple(sizes[name] for name in _named(fit))), settled


def _named(fit: SetFit) -> tuple[tuple[str, str], ...]:
    return tuple((f.effect.name, f.parameter.name) for f in fit.families)


def holding(rows: NDArray[np.intp], gram: FloatArray) -> FloatArray:
    """Inner products where some rows are constants that give way no more."""
    out = gram.copy()
    out[rows], out[:, rows] = 0.0, 0.0
    out[rows, rows] = 1.0
    return out


def ranges(fit: SetFit) -> FloatArray:
    """Of each parameter [k]."""
    return np.array([f.parameter.high - f.parameter.low for f in fit.families])


def ends(fit: SetFit, point: Point) -> list[int]:
    """Sizes that are at an end of their ranges, by row of what a set leaves."""
    low, high = rooms(fit, point, ranges(fit))
    return [1 + m for m in range(len(point.sizes)) if low[m] > -1e-9 or high[m] < 1e-9]


def rooms(fit: SetFit, point: Point, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far sizes (in units of `unit` [k]) and nuisances may still go, down and up [k + n]."""
    low, high = (np.array([getattr(f.parameter, end) for f in fit.families]) for end in ("low", "high"))
    ends = np.sort([(low - point.sizes) / unit, (high - point.sizes) / unit], axis=0)
    nuisances = np.clip(point.nuisances, -FARTHEST, FARTHEST)
    return np.r_[np.minimum(ends[0], 0.0), -FARTHEST - nuisances], np.r_[np.maximum(ends[1], 0.0), FARTHEST - nuisances]


def bounded_step(information: FloatArray, slope: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The step between `low` and `high` that lowers half the whitened square most, taken as a quadratic.

    In units in which the information of each is one: where a flight departs, a size may tell 1e9 times as much as the
    prior of a nuisance.
    """
    unit = 1.0 / np.sqrt(np.diag(information))
    scaled, along = information * unit[:, None] * unit, slope * unit
    step = -np.linalg.solve(scaled, along) * unit
    if np.all((low <= step) & (step <= high)):
        return np.asarray(step)
    root, ends = np.linalg.cholesky(scaled), (low / unit - 1e-12, high / unit + 1e-12)
    return np.asarray(lsq_linear(root.T, -np.linalg.solve(root, along), ends, method="bvls").x * unit)


def step_from(fit: SetFit, point: Point) -> FloatArray:
    """Gauss and Newton's step of sizes (in ranges of their parameters) and nuisances, within their bounds."""
    return bounded_step(point.information, point.slope, *rooms(fit, point, ranges(fit)))


def descent(fit: SetFit, best: Point, worth: float = SETTLED) -> Generator[Place, Point, Point]:
    """Yields sizes and nuisances to fly next and is sent what comes of it; returns the best.

    Steps that promise less than `worth` (half the whitened square) are not taken.

    A size and the nuisance of the number that it changes make a narrow curved valley: a step along it climbs its
    side first, and the next leads down again. So a few steps need not help (the watchdog of Chamberlain, Powell,
    Lemarechal and Pedersen, Mathematical Programming Study 16, 1982). When they do not help, half as far, and then
    every one has to.
    """
    at, share, waited, span = best, 1.0, 0, ranges(fit)
    k = len(span)
    for _ in range(ROUNDS):
        step = share * step_from(fit, at)
        if at is best and (share < SHORTEST or promised(at, step) < worth):
            break
        at = yield at.sizes + step[:k] * span, at.nuisances + step[k:]
        if at.cost < best.cost:
            best, share, waited = at, 1.0, 0
        elif waited < PATIENCE:
            waited += 1
        else:
            at, share = best, 0.5 * share
    return best


def promised(point: Point, step: FloatArray) -> float:
    """By how much a step would lower half the whitened square."""
    return -float(step @ point.slope) - 0.5 * float(step @ point.information @ step)


def size_steps(fit: SetFit, sizes: FloatArray) -> FloatArray:
    """Step of each size for its slope: a part of its uncertainty, inwards."""
    out = np.zeros(len(sizes))
    for m, (family, size) in enumerate(zip(fit.families, sizes, strict=True)):
        low, high = family.parameter.low, family.parameter.high
        spread = 0.0 if fit.covariance is None else float(np.sqrt(fit.covariance[m, m]))
        step = min(max(SIZE_STEP * spread, 1e-4 * (high - low)), 0.1 * (high - low))
        out[m] = step if size + step <= high else -step
    return out


def paths_of(flight: Reconstruction, rows: NDArray, k: int, terms: Sequence[Term] = ()) -> FloatArray:
    """Inner products of what the paths of a record leave, of a step of each size and of a nuisance's deviation.

    Args:
        rows: of `rows_of`, and one for each of the terms.
        k: how many sizes there are.
        terms: as `path_gram` has them.
    """
    unit = np.ones(len(rows))
    unit[1 + k : len(rows) - len(terms)] = 1.0 / NUISANCE_STEP
    return path_gram(flight, rows, terms, round(SETTLE / flight.dt)) * unit[:, None] * unit
