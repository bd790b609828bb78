"""Free courses of time: whatever a cause at one component could make of the records, in any form.

A hat about every knot in time, pushed where the component acts, passed through the same filter as the record. What they
take of a remainder may come from an effect there whose form nobody knows; what they leave has another cause. They are
flown once about the model: the filter follows the record, so that an explanation hardly changes its response.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.evidence import Evidence, flown, predicted
from sim2real.paths import PATHS
from sim2real.predictor import Push, innovations
from sim2real.side_by_side import each
from sim2real.terms import Term, at_any_time, pushes

BENT = 0.0025  # of what a free course takes, that flights about the model leave because responses bend (assumed)


@dataclass(frozen=True)
class Remainder:
    """What a set leaves where it was flown.

    Attributes:
        gram: inner products of what is left (row 0), the set's sizes, nuisances, and (from `first` on) generic terms.
        first: the first of these.
        rows: those before it, of every record, in parts side by side [N x channels, first], but for the paths.
        excess: whitened square above noise that is left in paths, by component.
        held: nuisances (by row) that are as far as they may be, and give way no more.
    """

    gram: FloatArray
    first: int
    rows: Sequence[Sequence[FloatArray]]
    excess: dict[str, float]
    held: tuple[int, ...] = ()

    def reduced(self) -> FloatArray:
        """Inner products of what is left (row 0) and of generic terms, everything else free to give way."""
        return projected(self.gram, self.first, self.held)


@dataclass(frozen=True)
class Freed:
    """Free courses of time in one record.

    Attributes:
        rows: what they make of it [N x channels, knots].
        inverse: of their inner products (tempered) and the prior's [knots, knots].
        chance: whitened square that they take of noise.
    """

    rows: FloatArray
    inverse: FloatArray
    chance: float

    def taken(self, parts: Sequence[FloatArray], tempering: float) -> FloatArray:
        """What they explain of the inner products (tempered) of other rows, in parts side by side [rows, rows]."""
        cross = np.concatenate([self.rows.T @ rows for rows in parts], axis=1) / tempering
        return np.asarray(cross.T @ self.inverse @ cross)


class Courses:
    """Generic terms and free courses along some records, flown when they are first asked for."""

    def __init__(self, evidences: Sequence[Evidence], tempering: float) -> None:
        self.evidences, self.tempering = evidences, tempering
        self._flown: dict[str, list[FloatArray]] = {}
        self._terms: list[tuple[FloatArray, FloatArray]] = []
        self._freed: dict[tuple[str, ...], list[Freed]] = {}
        self._pushed: list[tuple[Push, ...]] = []

    def pushed(self, terms: Sequence[Term], weights: Mapping[int, float], rows: int) -> list[tuple[Push, ...]]:
        """What generic terms of given weights together push in every record, for each of some rows."""
        if not weights:
            return [()] * len(self.evidences)
        if not self._pushed:
            self._pushed = [_pushes(e, terms) for e in self.evidences]
        return [_together(pushes, weights, rows) for pushes in self._pushed]

    def of_terms(self, terms: Sequence[Term]) -> list[tuple[FloatArray, FloatArray]]:
        """What generic terms make of every record [N x channels, terms], and its inner products; always the same."""
        if not self._terms:
            own = [e.rows[:, e.rows.shape[1] - len(terms) :] for e in self.evidences]
            self._terms = [(rows, rows.T @ rows) for rows in own]
        return self._terms

    def at(self, components: Collection[str]) -> list[Freed]:
        """Free courses at some components, for every record; none if they are paths only."""
        names = tuple(sorted(c for c in components if c not in PATHS[:-1]))
        if not names:
            return []
        for name in names:
            if name not in self._flown:
                self._flown[name] = each(lambda e, at=name: _flown(e, at_any_time(e.flight, at, 1)), self.evidences)
        if names not in self._freed:
            self._freed[names] = []
            for of_record in zip(*(self._flown[name] for name in names), strict=True):
                rows = np.concatenate(of_record, axis=1)
                inner = rows.T @ rows / self.tempering
                inverse = np.linalg.inv(inner + np.eye(len(inner)))
                self._freed[names].append(Freed(rows, inverse, float(np.sum(inverse * inner))))
        return self._freed[names]

    def free(self, left: Remainder, components: Collection[str]) -> float:
        """Whitened square above chance that free courses at some components would take of what is left."""
        taken = sum(left.excess.get(component, 0.0) for component in components)
        gram = before = left.gram[: left.first, : left.first]
        for rows, freed in zip(left.rows, self.at(components), strict=False):
            gram = gram - freed.taken(rows, self.tempering)
            taken -= freed.chance
        by_courses = float(projected(before, left.first, left.held)[0, 0]
                           - projected(gram, left.first, left.held)[0, 0])
        return max(taken + (1.0 + BENT) * by_courses, 0.0)


def _flown(evidence: Evidence, terms: Sequence[Term]) -> FloatArray:
    """What terms make of one record, flown about the model [N x channels, terms]."""
    rows = np.repeat(evidence.flight.parameters, 1 + len(terms))
    return flown(evidence.flight, rows, _pushes(evidence, terms), evidence.gain, evidence.factor,
                 keep=range(1, len(rows))).rows


def _pushes(evidence: Evidence, terms: Sequence[Term]) -> tuple[Push, ...]:
    flight = evidence.flight
    base = innovations(flight, flight.parameters, evidence.gain.K)[:, 0]
    return pushes(replace(flight, measured=predicted(flight, base)), terms)


def _together(pushed: Sequence[Push], weights: Mapping[int, float], rows: int) -> tuple[Push, ...]:
    """Weighted pushes, one for each target and row."""
    series: dict[tuple[str, bool], FloatArray] = {}
    for push in pushed:
        if weight := weights.get(push.row, 0.0):
            at = (push.target, push.sensor)
            series[at] = series.get(at, 0.0) + weight * push.series
    return tuple(Push(row, target, course, sensor)
                 for (target, sensor), course in series.items() for row in range(rows))  # fmt: skip


def projected(gram: FloatArray, first: int, held: Collection[int] = ()) -> FloatArray:
    """Inner products of row 0 and of the rows from `first` on, those between but for `held` free to give way."""
    gone, kept = np.array([j for j in range(1, first) if j not in held], np.intp), np.r_[0, first : len(gram)]
    across = gram[np.ix_(gone, kept)]
    return np.asarray(gram[np.ix_(kept, kept)] - across.T @ np.linalg.solve(gram[np.ix_(gone, gone)], across))
