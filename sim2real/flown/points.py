"""A set of effects flown along the records at its own sizes and nuisances, with its slopes, and brought to its best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.actuators.lateness import lateness
from sim2real.actuators.paths import PATHS, excess
from sim2real.actuators.wandering import wandering
from sim2real.baseline.references import Baseline
from sim2real.flown.steps import (
    DIFFERENCE,
    FARTHEST,
    SETTLED,
    SIZE_STEP,
    Place,
    Point,
    Slopes,
    descent,
    ends,
    paths_of,
    promised,
    ranges,
    size_steps,
    step_from,
)
from sim2real.flown.valleys import lowest
from sim2real.library.candidates import NUISANCE_STEP, Bank, at_few_sizes
from sim2real.posterior.sets import SetFit, firm
from sim2real.prediction.abreast import Abreast, end_to_end
from sim2real.prediction.predictor import Push
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.side_by_side import each
from sim2real.signatures.courses import Courses, Remainder
from sim2real.signatures.evidence import Evidence, to_fly, told
from sim2real.signatures.whitening import SETTLE

SIDE_BY_SIDE = 6  # steps with the same slopes where many sets take them together
HOPELESS = 100.0  # log likelihood from the best, and half of what that explains, beyond which nothing is tried further
TURNS = 3  # how often slopes by nuisances are flown anew
NEAR = 5.0  # such a gain, promised or made, of a point so near that its slopes will do
ROUGH = 1e-3  # share of half the square above noise, that a turn has to take of it
FAR = 1000.0  # whitened square above the linear fit's that makes another start worth a flight


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
        return self.settled(fit, self._descended(fit, best)).without_held()

    def settled(self, fit: SetFit, best: Point) -> Point:
        """The best that is reached from a point, slopes by nuisances flown anew on the way."""
        for _ in range(TURNS):
            best = self.lower(fit, best)
            best = self.point(fit, best.sizes, best.nuisances)
            before, gain = best.cost, promised(best, step_from(fit, best))
            best = self._descended(fit, best)
            if gain < NEAR or before - best.cost < max(NEAR, self.worth(best)):
                break
        return best

    def worth(self, point: Point) -> float:
        """Log likelihood that another turn has to gain: what is far from noise is not told from others by units.

        Where much is left that the set does not have, Gauss and Newton's steps lead past the best: most do not help.
        """
        noise = sum(e.samples for e in self.evidences) / self.tempering
        return max(SETTLED, ROUGH * (point.cost - 0.5 * noise))

    def lower(self, fit: SetFit, best: Point) -> Point:
        """The point, or one further along a valley where numbers of the aircraft are as they are here, if lower."""
        place = lowest(self.flights[0], self.candidates, self.baseline.precision, fit, (best.sizes, best.nuisances))
        if place is None:
            return best
        return min(best, self.point(fit, *place, best.slopes), key=lambda point: point.cost)

    @cached_property
    def _abreast(self) -> Abreast:
        return Abreast(self.flights, [e.gain for e in self.evidences])

    def _flown(self, rows: Sequence[NDArray], pushed: Sequence[tuple[Push, ...]] = (),
               keep: Sequence[int] = ()) -> list[FloatArray]:  # fmt: skip
        """The rows to keep of those flown along the records abreast, paths and inner products left out."""
        chosen = [to_fly(f, own, pushes)
                  for f, own, pushes in zip(self.flights, rows, pushed or [()] * len(rows), strict=True)]
        made = self._abreast.innovations([own[moved] for own, (moved, _) in zip(rows, chosen, strict=True)],
                                         [pushes for _, pushes in chosen])

        def of_record(flight: Reconstruction, left: FloatArray, moved: list[int], e: Evidence) -> FloatArray:
            return told(flight, left, moved, len(rows[0]), e.gain, e.factor, keep, gram=False).rows

        return each(of_record, self.flights, made, [moved for moved, _ in chosen], self.evidences)

    @cached_property
    def few(self) -> Bank:
        """The library at a few sizes."""
        return at_few_sizes(self.candidates)

    @cached_property
    def near(self) -> list[Slopes]:
        """Slopes by nuisances where the variants were flown."""
        return self._slopes([e.rows[:, : len(self.candidates.nuisances)] / NUISANCE_STEP for e in self.evidences])

    def _slopes(self, rows: Sequence[FloatArray]) -> list[Slopes]:
        return [Slopes(own, terms) for own, (terms, _) in zip(rows, self.courses.of_terms(), strict=True)]

    def _descended(self, fit: SetFit, best: Point) -> Point:
        """The best that is reached with the slopes by nuisances as they are: two to four rows a flight."""
        way = descent(fit, best, self.worth(best))
        try:
            place = next(way)
            while True:
                place = way.send(self.point(fit, *place, best.slopes))
        except StopIteration as arrived:
            return cast(Point, arrived.value)

    def descended(self, fits: Sequence[SetFit], starts: Sequence[FloatArray]) -> list[Point]:
        """The same of many sets side by side, each from its own sizes and nuisances [n], with the slopes of `near`."""
        best = self.points([(fit, np.array(fit.estimate), start) for fit, start in zip(fits, starts, strict=True)])
        best = self._lower(fits, best)
        ways = [descent(fit, point, self.worth(point)) for fit, point in zip(fits, best, strict=True)]
        told: dict[int, Point | None] = dict.fromkeys(range(len(fits)))
        for _ in range(SIDE_BY_SIDE):
            waiting: dict[int, Place] = {}
            for i, point in told.items():
                with suppress(StopIteration):  # which says that it has arrived
                    waiting[i] = ways[i].send(point) if point else next(ways[i])
            told = dict(zip(waiting, self.points([(fits[i], *place) for i, place in waiting.items()]), strict=True))
            best = [min(point, told.get(i) or point, key=lambda p: p.cost) for i, point in enumerate(best)]
            told = self._hopeful(fits, told, [point.cost for point in best])
        return best

    def _hopeful(self, fits: Sequence[SetFit], told: Mapping[int, Point | None], costs: Sequence[float]
                 ) -> dict[int, Point | None]:  # fmt: skip
        """Those that may still come near the best: most effects explain next to nothing of a large gap."""
        far = max(min(costs) + HOPELESS, 0.5 * (min(costs) + float(np.median(costs))))
        return {i: p for i, p in told.items()
                if p and (p.cost < far or p.cost - promised(p, step_from(fits[i], p)) < far)}

    def _lower(self, fits: Sequence[SetFit], best: Sequence[Point]) -> list[Point]:
        """`lower` of many sets side by side."""
        places = [lowest(self.flights[0], self.candidates, self.baseline.precision, fit, (p.sizes, p.nuisances))
                  for fit, p in zip(fits, best, strict=True)]
        moved = iter(self.points([(fit, *place) for fit, place in zip(fits, places, strict=True) if place]))
        return [min(p, next(moved), key=lambda point: point.cost) if place else p
                for p, place in zip(best, places, strict=True)]

    def point(self, fit: SetFit, sizes: FloatArray, nuisances: FloatArray, slopes: Sequence[Slopes] = ()) -> Point:
        """A set flown at given sizes [k] and nuisances [n].

        Args:
            slopes: by nuisances of every record, where others will do; flown if omitted.
        """
        k, n = len(sizes), len(nuisances)
        steps = size_steps(fit, sizes)
        count = 1 + k if slopes else 1 + k + n
        rows = [rows_of(f, self.candidates, fit, sizes, steps, nuisances) for f in self.flights]
        made = self._flown([own[:count] for own in rows], keep=range(count))
        slopes = slopes or self._slopes([own[:, 1 + k :] / NUISANCE_STEP for own in made])
        made = [own[:, : 1 + k].copy() for own in made]  # a view would keep what slopes were made of

        def of_record(flight: Reconstruction, own: NDArray, left: FloatArray, lent: Slopes) -> FloatArray:
            return lent.beside(left) + paths_of(flight, own, k)

        gram = np.sum(each(of_record, self.flights, rows, made, slopes), axis=0) / self.tempering
        return replace(self._weighed(fit, sizes, nuisances, gram), rows=made, slopes=slopes)

    def points(self, sets: Sequence[tuple[SetFit, FloatArray, FloatArray]]) -> list[Point]:
        """Several sets at given sizes [k] and nuisances [n], flown side by side with the slopes of `near`.

        What they leave of the records is not kept. Paths are judged with the recording's low pass as the model has it.
        """
        if not sets:
            return []
        counts = [1 + len(sizes) for _, sizes, _ in sets]
        count = 1 + sum(counts)
        at = np.cumsum([1, *counts])

        def of_record(flight: Reconstruction, rows: list[NDArray], made: FloatArray, lent: Slopes) -> list[FloatArray]:
            left = made[:, 1:].copy()  # differences of rows: those of inner products round, where flights depart
            for first, after in zip(at, at[1:], strict=False):
                left[:, first : after - 1] -= made[:, first : first + 1]
                left[:, first - 1] += made[:, 0]
            across, found = left.T @ lent.rows, []
            for own, first, after in zip(rows, at, at[1:], strict=False):
                of_set = slice(first - 1, after - 1)
                inner = left[:, of_set].T @ left[:, of_set]
                found.append(np.block([[inner, across[of_set]], [across[of_set].T, lent.inner]])
                             + paths_of(flight, own, after - first - 1))
            return found

        rows = [[rows_of(flight, self.candidates, fit, sizes, size_steps(fit, sizes), nuisances)
                 for fit, sizes, nuisances in sets] for flight in self.flights]
        made = self._flown([end_to_end([flight.parameters, *(one[:n] for one, n in zip(own, counts, strict=True))])
                            for flight, own in zip(self.flights, rows, strict=True)], keep=range(count))
        grams = each(of_record, self.flights, rows, made, self.near)
        return [replace(self._weighed(fit, sizes, nuisances, np.sum(parts, axis=0) / self.tempering), slopes=self.near)
                for (fit, sizes, nuisances), *parts in zip(sets, *grams, strict=True)]

    def _weighed(self, fit: SetFit, sizes: FloatArray, nuisances: FloatArray, gram: FloatArray) -> Point:
        """A point from the inner products of what it leaves, of a step of each size and of a nuisance's deviation."""
        k, n = len(sizes), len(nuisances)
        steps, span = size_steps(fit, sizes), ranges(fit)
        unit = np.concatenate([[1.0], span / steps if k else [], np.ones(n)])
        gram = gram * unit[:, None] * unit
        prior = self.baseline.precision
        slope, information = gram[1:, 0].copy(), gram[1:, 1:].copy()
        slope[k:] += prior @ nuisances
        information[k:, k:] += prior
        information[:k, :k] += np.eye(k)  # a size moves no farther than its range
        information = firm(information) + np.diag(DIFFERENCE * gram[0, 0] * unit[1:] ** 2)
        cost = 0.5 * (gram[0, 0] + nuisances @ prior @ nuisances)
        return Point(sizes, nuisances, float(cost), slope, information, steps)

    def left_over(self, fit: SetFit, point: Point) -> Remainder:
        """What a set leaves where it was flown, everything in it free to give way.

        What generic terms would make of the records is taken from flights about the model. With weights the point's
        rows are flown again, but for the slopes by nuisances.
        """
        terms, k, n = self.candidates.terms, len(point.sizes), len(point.nuisances)
        first = 1 + k + n
        moved = tuple(replace(term, row=first + j) for j, term in enumerate(terms))
        pushed = self.courses.pushed(point.weights, 1 + k)
        moved_to = [rows_of(flight, self.candidates, fit, point.sizes, point.steps, point.nuisances)
                    for flight in self.flights]
        made = self._flown([own[: 1 + k] for own in moved_to], pushed, range(1 + k)) if point.weights else point.rows

        def of_record(flight: Reconstruction, rows: NDArray, own: FloatArray, slopes: Slopes,
                      of_terms: tuple[FloatArray, FloatArray]) -> FloatArray:
            across = np.concatenate([own.T @ of_terms[0], slopes.onto])
            rows = np.take(rows, [*range(first), *[0] * len(terms)])
            return np.block([[slopes.beside(own), across], [across.T, of_terms[1]]]) + paths_of(flight, rows, k, moved)

        gram = np.sum(each(of_record, self.flights, moved_to, made, point.slopes, self.courses.of_terms()),
                      axis=0) / self.tempering
        over = [excess(flight, rows[:1]) for flight, rows in zip(self.flights, moved_to, strict=True)]
        left_in = {component: sum(own[component] for own in over) / self.tempering for component in PATHS}
        kept = [(own, slopes.rows) for own, slopes in zip(made, point.slopes, strict=True)]
        precision = self.baseline.precision
        gram[first - n : first, first - n : first] += precision
        gram[first - n : first, 0] += precision @ point.nuisances
        gram[0, first - n : first] = gram[first - n : first, 0]
        gram[0, 0] += point.nuisances @ precision @ point.nuisances
        gram[1 : 1 + k, 1 : 1 + k] += (0.1 * SIZE_STEP) ** 2 * np.eye(k)  # sizes move by ten uncertainties
        settled = [rows[:1] for rows in moved_to], round(SETTLE / self.flights[0].dt)
        late, wander = lateness(self.flights, *settled), wandering(self.flights, *settled)
        held = *ends(fit, point), *(int(j) for j in 1 + k + point.held)
        return Remainder(gram, first, kept, left_in, late, wander, held)


def rows_of(flight: Reconstruction, candidates: Bank, fit: SetFit, sizes: FloatArray, steps: FloatArray,
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
