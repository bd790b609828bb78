"""A set of effects flown along the records at its own sizes and nuisances, with its slopes, and brought to its best."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.attribution import reduce, with_prior
from sim2real.candidates import NUISANCE_STEP, Bank, parameter_rows
from sim2real.courses import Course, Courses, Remainder, in_time
from sim2real.evidence import SETTLE, Evidence, compare, flown
from sim2real.paths import PATHS, excess, of_paths, path_gram
from sim2real.reconstruct import Reconstruction
from sim2real.references import Baseline
from sim2real.sets import SetFit
from sim2real.side_by_side import each

ROUNDS, TURNS = 10, 3  # steps with the same slopes by nuisances, and how often these are flown anew
PATIENCE = 2  # steps that need not help
SETTLED = 0.2  # gain of half the whitened square that is worth another round
NEAR = 5.0  # such a gain, of a point so near that its slopes will do
FAR = 1000.0  # whitened square above the linear fit's that makes another start worth a flight
FARTHEST = 5.0  # standard deviations of a nuisance: what is beyond is no nuisance but a gap


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

    def without_held(self) -> Point:
        """The same with these as constants."""
        at, slope = len(self.sizes) + self.held, self.slope.copy()
        slope[at] = 0.0
        return replace(self, slope=slope, information=_holding(at, self.information))


@dataclass(frozen=True)
class Flying:
    """What flying a set along the records takes: the records about the baseline, gains, whitening and tempering."""

    flights: Sequence[Reconstruction]
    candidates: Bank
    evidences: Sequence[Evidence]
    baseline: Baseline
    tempering: float
    courses: Courses

    def settle(self, fit: SetFit, start: FloatArray) -> Point:
        """Gauss-Newton on sizes and nuisances, from nuisances `start` [n]; when steps do not help, half as far.

        Where that is far worse than the linear fit had it, from the published model if that is nearer.
        """
        at, near = np.array(fit.estimate), self.near
        best = self.point(fit, at, np.clip(start, -FARTHEST, FARTHEST), near)
        if 2.0 * best.cost > fit.misfit + FAR:
            best = min(best, self.point(fit, at, np.zeros_like(start), near), key=lambda point: point.cost)
        best = self._descended(fit, best)
        for _ in range(TURNS):
            best = self.point(fit, best.sizes, best.nuisances)
            promised = _promised(best, self._step(fit, best))
            best = self._descended(fit, best)
            if promised < NEAR:
                break
        return best.without_held()

    @cached_property
    def near(self) -> list[Slopes]:
        """Slopes by nuisances where the variants were flown."""
        return self._slopes([e.rows[:, : len(self.candidates.nuisances)] / NUISANCE_STEP for e in self.evidences])

    def _slopes(self, rows: Sequence[FloatArray]) -> list[Slopes]:
        made = self.courses.of_terms(self.candidates.terms)
        return [Slopes(own, terms) for own, (terms, _) in zip(rows, made, strict=True)]

    def _step(self, fit: SetFit, point: Point) -> FloatArray:
        return bounded_step(point.information, point.slope, *rooms(fit, point, ranges(fit)))

    def _descended(self, fit: SetFit, best: Point) -> Point:
        """The best that is reached with the slopes by nuisances as they are: two to four rows a flight.

        A size and the nuisance of the number that it changes make a narrow curved valley: a step along it climbs its
        side first, and the next leads down again. So a few steps need not help (the watchdog of Chamberlain, Powell,
        Lemarechal and Pedersen, Mathematical Programming Study 16, 1982).
        """
        at, share, waited, span = best, 1.0, 0, ranges(fit)
        k = len(span)
        for _ in range(ROUNDS):
            step = share * self._step(fit, at)
            if at is best and _promised(at, step) < SETTLED:
                break
            at = self.point(fit, at.sizes + step[:k] * span, at.nuisances + step[k:], best.slopes)
            if at.cost < best.cost:
                best, share, waited = at, 1.0, 0
            elif waited < PATIENCE:
                waited += 1
            else:
                at, share, waited = best, 0.5 * share, 0
        return best

    def point(self, fit: SetFit, sizes: FloatArray, nuisances: FloatArray, slopes: Sequence[Slopes] = ()) -> Point:
        """A set flown at given sizes [k] and nuisances [n].

        Args:
            slopes: by nuisances of every record, where others will do; flown if omitted.
        """
        k, n = len(sizes), len(nuisances)
        steps = size_steps(fit, sizes)
        gram, count = np.zeros((1 + k + n, 1 + k + n)), 1 + k if slopes else 1 + k + n
        rows = [_rows(f, self.candidates, fit, sizes, steps, nuisances)[:count] for f in self.flights]
        made = each(lambda flight, own, e: flown(flight, own, (), e.gain, e.factor, keep=range(count)).rows,
                    self.flights, rows, self.evidences)
        slopes = slopes or self._slopes([own[:, 1 + k :] / NUISANCE_STEP for own in made])
        made = [own[:, : 1 + k] for own in made]
        for flight, own, left, lent in zip(self.flights, rows, made, slopes, strict=True):
            gram += lent.beside(left) / self.tempering
            gram[: 1 + k, : 1 + k] += path_gram(flight, own[: 1 + k], (), round(SETTLE / flight.dt)) / self.tempering
        span = ranges(fit)
        unit = np.concatenate([[1.0], span / steps if k else [], np.ones(n)])
        gram = gram * unit[:, None] * unit
        prior = self.baseline.precision
        slope, information = gram[1:, 0].copy(), gram[1:, 1:].copy()
        slope[k:] += prior @ nuisances
        information[k:, k:] += prior
        information[:k, :k] += np.eye(k)  # a size moves no farther than its range
        cost = 0.5 * (gram[0, 0] + nuisances @ prior @ nuisances)
        return Point(sizes, nuisances, float(cost), slope, information, steps, rows=made, slopes=slopes)

    def left_over(self, fit: SetFit, point: Point) -> Remainder:
        """What a set leaves where it was flown, everything in it free to give way.

        What generic terms would make of the records is taken from flights about the model. With weights the point's
        rows are flown again, but for the slopes by nuisances.
        """
        terms, k, n = self.candidates.terms, len(point.sizes), len(point.nuisances)
        first = 1 + k + n
        moved = tuple(replace(term, row=first + j) for j, term in enumerate(terms))
        gram, kept, left_in = np.zeros((first + len(terms),) * 2), [], dict.fromkeys(PATHS, 0.0)
        pushed = self.courses.pushed(terms, point.weights, 1 + k)
        for i, (flight, evidence, (generic, inner), pushes) in enumerate(zip(
                self.flights, self.evidences, self.courses.of_terms(terms), pushed, strict=True)):
            rows = _rows(flight, self.candidates, fit, point.sizes, point.steps, point.nuisances)[: 1 + k]
            for component, over in excess(flight, rows[:1]).items():
                left_in[component] += over / self.tempering
            own, slopes = point.rows[i], point.slopes[i]
            if point.weights:
                own = flown(flight, rows, pushes, evidence.gain, evidence.factor, keep=range(1 + k)).rows
            across = np.concatenate([own.T @ generic, slopes.onto])
            gram += np.block([[slopes.beside(own), across], [across.T, inner]]) / self.tempering
            rows = np.take(rows, [*range(1 + k), *[0] * (n + len(terms))])
            gram += path_gram(flight, rows, moved, round(SETTLE / flight.dt)) / self.tempering
            kept.append((own, slopes.rows))
        precision = self.baseline.precision
        gram[first - n : first, first - n : first] += precision
        gram[first - n : first, 0] += precision @ point.nuisances
        gram[0, first - n : first] = gram[first - n : first, 0]
        gram[0, 0] += point.nuisances @ precision @ point.nuisances
        gram[1 : 1 + k, 1 : 1 + k] += 1e-2 * np.eye(k)
        return Remainder(gram, first, kept, left_in, (*ends(fit, point), *(int(j) for j in 1 + k + point.held)))

    def beside(self, fit: SetFit, point: Point, home: Collection[str]) -> list[FloatArray]:
        """Inner products of every effect of the library (rows of the bank) about a set where it was flown.

        Then the same without what free courses of time at `home`, or a path there, would explain.
        """
        only, names = replace(self.candidates, terms=()), in_time(home)

        def of_record(flight: Reconstruction, evidence: Evidence, course: Course) -> tuple[FloatArray, FloatArray]:
            at = _rows(flight, self.candidates, fit, point.sizes, np.zeros(len(point.sizes)), point.nuisances)[:1]
            rows = parameter_rows(replace(flight, parameters=at), only)
            found = compare(flight, rows, evidence.gain, evidence.factor, keep=range(len(rows)))
            own = path_gram(of_paths(flight, home), rows, (), round(SETTLE / flight.dt)) / self.tempering
            courses = course.taken(names, [found.rows], self.tempering, again=False) if names else 0.0
            return found.gram / self.tempering, own + courses

        total, taken = np.sum(each(of_record, self.flights, self.evidences, self.courses.along), axis=0)
        prior, nothing = self.baseline.precision, np.zeros_like(self.baseline.precision)
        return [reduce(_holding(1 + point.held, with_prior(gram, self.candidates, prior, point.nuisances)),
                       self.candidates, nothing) for gram in (total, total - taken)]


def _holding(rows: NDArray[np.intp], gram: FloatArray) -> FloatArray:
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
    """The step between `low` and `high` that lowers half the whitened square most, taken as a quadratic."""
    step = -np.linalg.solve(information, slope)
    if np.all((low <= step) & (step <= high)):
        return np.asarray(step)
    root = np.linalg.cholesky(information)
    return np.asarray(lsq_linear(root.T, -np.linalg.solve(root, slope), (low - 1e-12, high + 1e-12), method="bvls").x)


def _promised(point: Point, step: FloatArray) -> float:
    """By how much a step would lower half the whitened square."""
    return -float(step @ point.slope) - 0.5 * float(step @ point.information @ step)


def size_steps(fit: SetFit, sizes: FloatArray) -> FloatArray:
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
