"""A set of effects flown along the records at its own sizes and nuisances, with its slopes, and brought to its best."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.attribution import reduce, with_prior
from sim2real.candidates import NUISANCE_STEP, Bank, parameter_rows
from sim2real.courses import Courses, Remainder
from sim2real.evidence import SETTLE, Evidence, compare
from sim2real.paths import PATHS, excess, of_paths, path_gram
from sim2real.reconstruct import Reconstruction
from sim2real.references import Baseline
from sim2real.sets import SetFit

ROUNDS = 4
SETTLED = 0.2  # gain of half the whitened square that is worth another round
FAR = 1000.0  # whitened square above the linear fit's that makes another start worth a flight
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
        """Gauss-Newton on sizes and nuisances, from nuisances `start` [n]; a step that does not help is halved.

        Where that is far worse than the linear fit had it, from the published model if that is nearer.
        """
        low, high = (np.array([getattr(f.parameter, end) for f in fit.families]) for end in ("low", "high"))
        at = np.array(fit.estimate)
        best, share = self.point(fit, at, np.clip(start, -FARTHEST, FARTHEST)), 1.0
        if 2.0 * best.cost > fit.misfit + FAR:
            best = min(best, self.point(fit, at, np.zeros_like(start)), key=lambda point: point.cost)
        for _ in range(ROUNDS):
            step = -share * np.linalg.solve(best.information, best.slope)
            if -0.5 * float(step @ best.slope) < SETTLED:
                break
            k = len(low)
            sizes = np.clip(best.sizes + step[:k] * (high - low), low, high)
            tried = self.point(fit, sizes, np.clip(best.nuisances + step[k:], -FARTHEST, FARTHEST))
            best, share = (tried, 1.0) if tried.cost < best.cost else (best, 0.5 * share)
        return best

    def point(self, fit: SetFit, sizes: FloatArray, nuisances: FloatArray) -> Point:
        """A set flown at given sizes [k] and nuisances [n]."""
        k, n = len(sizes), len(nuisances)
        steps = _steps(fit, sizes)
        gram = np.zeros((1 + k + n, 1 + k + n))
        for flight, evidence in zip(self.flights, self.evidences, strict=True):
            rows = _rows(flight, self.candidates, fit, sizes, steps, nuisances)
            gram += compare(flight, rows, (), evidence.gain, evidence.factor).gram / self.tempering
        span = np.array([f.parameter.high - f.parameter.low for f in fit.families])
        unit = np.concatenate([[1.0], span / steps if k else [], np.full(n, 1.0 / NUISANCE_STEP)])
        gram = gram * unit[:, None] * unit
        prior = self.baseline.precision
        slope, information = gram[1:, 0].copy(), gram[1:, 1:].copy()
        slope[k:] += prior @ nuisances
        information[k:, k:] += prior
        information[:k, :k] += np.eye(k)  # a size moves no farther than its range
        cost = 0.5 * (gram[0, 0] + nuisances @ prior @ nuisances)
        return Point(sizes, nuisances, float(cost), slope, information)

    def left_over(self, fit: SetFit, point: Point) -> Remainder:
        """What a set leaves where it was flown, everything in it free to give way.

        What generic terms would make of the records is taken from flights about the model.
        """
        terms, k, n = self.candidates.terms, len(point.sizes), len(point.nuisances)
        first, steps = 1 + k + n, _steps(fit, point.sizes)
        moved = tuple(replace(term, row=first + j) for j, term in enumerate(terms))
        gram, kept, left_in = np.zeros((first + len(terms),) * 2), [], dict.fromkeys(PATHS, 0.0)
        for flight, evidence, (generic, inner) in zip(self.flights, self.evidences, self.courses.of_terms(terms),
                                                      strict=True):
            rows = _rows(flight, self.candidates, fit, point.sizes, steps, point.nuisances)
            for component in PATHS:
                left_in[component] += excess(flight, rows[:1], component) / self.tempering
            own = compare(flight, rows, (), evidence.gain, evidence.factor, keep=range(first)).rows
            across = own.T @ generic
            rows = np.concatenate([rows, np.repeat(rows[:1], len(terms))])
            gram += (np.block([[own.T @ own, across], [across.T, inner]])
                     + path_gram(flight, rows, moved, round(SETTLE / flight.dt))) / self.tempering
            kept.append(own)
        precision = self.baseline.precision
        gram[first - n : first, first - n : first] += precision
        gram[first - n : first, 0] += precision @ point.nuisances
        gram[0, first - n : first] = gram[first - n : first, 0]
        gram[0, 0] += point.nuisances @ precision @ point.nuisances
        gram[1 : 1 + k, 1 : 1 + k] += 1e-2 * np.eye(k)
        return Remainder(gram, first, kept, left_in)

    def beside(self, fit: SetFit, point: Point, home: Collection[str]) -> list[FloatArray]:
        """Inner products of every effect of the library (rows of the bank) about a set where it was flown.

        Then the same without what free courses of time at `home`, or a path there, would explain.
        """
        only = replace(self.candidates, terms=())
        total = np.zeros((self.candidates.size, self.candidates.size))
        taken, freed = total.copy(), self.courses.at(home)
        for i, (flight, evidence) in enumerate(zip(self.flights, self.evidences, strict=True)):
            at = _rows(flight, self.candidates, fit, point.sizes, np.zeros(len(point.sizes)), point.nuisances)[:1]
            rows = parameter_rows(replace(flight, parameters=at), only)
            found = compare(flight, rows, (), evidence.gain, evidence.factor, keep=range(len(rows)))
            total += found.gram / self.tempering
            taken += path_gram(of_paths(flight, home), rows, (), round(SETTLE / flight.dt)) / self.tempering
            if freed:
                taken += freed[i].taken(found.rows, self.tempering)
        prior, nothing = self.baseline.precision, np.zeros_like(self.baseline.precision)
        return [reduce(with_prior(gram, self.candidates, prior, point.nuisances), self.candidates, nothing)
                for gram in (total, total - taken)]


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
