"""Free courses of time: whatever a cause at one component could make of the records, in any form.

A hat about every knot in time, pushed where the component acts, passed through the same filter as the record. What they
take of a remainder may come from an effect there whose form nobody knows; what they leave has another cause. They are
flown once about the model: the filter follows the record, so that an explanation hardly changes its response.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from icing_env.record import FloatArray
from sim2real.actuators.lateness import Late
from sim2real.actuators.paths import PATHS
from sim2real.actuators.wandering import Wander
from sim2real.library.knots import knots
from sim2real.library.pushes import at_any_time, pushes
from sim2real.library.terms import WIND, Term
from sim2real.prediction.predictor import Push
from sim2real.records.side_by_side import each
from sim2real.signatures.evidence import Evidence
from sim2real.signatures.means import without_means

BENT = 0.0025  # of what a free course takes, that flights about the model leave because responses bend (assumed)


@dataclass(frozen=True)
class Remainder:
    """What a set leaves where it was flown.

    Attributes:
        gram: inner products of what is left (row 0), the set's sizes, nuisances, and (from `first` on) generic terms.
        first: the first of these.
        rows: those before it, of every record, in parts side by side [N x channels, first], but for the paths.
        excess: whitened square above noise that is left in paths, by component.
        late, wander: delays that would take most of what paths leave, and free courses there, by component.
        held: nuisances and sizes (by row) that are as far as they may be, and give way no more.
    """

    gram: FloatArray
    first: int
    rows: Sequence[Sequence[FloatArray]]
    excess: dict[str, float]
    late: dict[str, Late]
    wander: dict[str, Wander]
    held: tuple[int, ...] = ()

    def reduced(self) -> FloatArray:
        """Inner products of what is left (row 0) and of generic terms, everything else free to give way."""
        return projected(self.gram, self.first, self.held)

    def unbounded(self) -> float:
        """Whitened square that would be left if nothing were held: what the model's own numbers could not do."""
        return float(projected(self.gram[: self.first, : self.first], self.first)[0, 0])


@dataclass(frozen=True)
class Freed:
    """Free courses of time at some components along one record.

    inverse: of their inner products (tempered) and the prior's [knots, knots]; chance: whitened square that they take
    of noise.
    """

    inverse: FloatArray
    chance: float


class Course:
    """Free courses of time along one record, made when they are first asked for."""

    def __init__(self, evidence: Evidence) -> None:
        if evidence.linear is None:
            raise ValueError("candidates were not flown along this record")
        self.evidence, self.about = evidence, evidence.linear
        self.forget()

    def forget(self) -> None:
        """Give back what was kept: hundreds of megabytes of some records, and made again when asked for."""
        self._rows: dict[str, FloatArray] = {}
        self._inner: dict[tuple[str, str], FloatArray] = {}
        self._freed: dict[tuple[tuple[str, ...], float], Freed] = {}
        self._onto: dict[tuple[str, int], tuple[FloatArray, FloatArray]] = {}

    @cached_property
    def model(self) -> FloatArray:
        """What the model leaves of the record [N x channels, 1]."""
        return self.evidence.whitened[self.about.first :].reshape(-1, 1)

    @property
    def bytes(self) -> float:
        """Of what hats at one component make of the record."""
        return 8.0 * len(self.model) * len(knots(self.about.flight))

    def pushes(self, terms: Sequence[Term]) -> tuple[Push, ...]:
        """Time courses of generic terms along the record as the model predicts it."""
        return pushes(self.about.flight, terms)

    def rows(self, component: str) -> FloatArray:
        """What hats at a component make of the record [N x channels, knots]; kept."""
        if component not in self._rows:
            self._rows |= self.made([component])
        return self._rows[component]

    def made(self, components: Sequence[str]) -> dict[str, FloatArray]:
        """The same of several together, which is quicker; not kept."""
        hats: list[Term] = []
        columns = {}
        for component in components:
            own = at_any_time(self.about.flight, component, len(hats))
            columns[component] = slice(len(hats), len(hats) + len(own))
            hats += own
        values = without_means(self.about.respond(self.pushes(hats)).values, self.evidence.flight, self.about.first)
        return {component: values[:, at] for component, at in columns.items()}

    def inner(self, one: str, other: str) -> FloatArray:
        """Inner products of the hats at two components."""
        if one > other:
            return self.inner(other, one).T
        if (one, other) not in self._inner:
            self._inner[one, other] = self.rows(one).T @ self.rows(other)
        return self._inner[one, other]

    def freed(self, names: tuple[str, ...], tempering: float) -> Freed:
        """Free courses at components that are no paths."""
        if (names, tempering) not in self._freed:
            inner = np.block([[self.inner(one, other) for other in names] for one in names]) / tempering
            inverse = np.asarray(np.linalg.inv(inner + np.eye(len(inner))), np.float64)
            self._freed[names, tempering] = Freed(inverse, float(np.sum(inverse * inner)))
        return self._freed[names, tempering]

    def taken(self, names: tuple[str, ...], parts: Sequence[FloatArray], tempering: float,
              again: bool = True) -> FloatArray:
        """What they explain of the inner products (tempered) of other rows, in parts side by side [rows, rows].

        Args:
            again: whether the same parts will be asked for again.
        """
        cross = np.concatenate([self.onto(name, parts, again) for name in names]) / tempering
        return np.asarray(cross.T @ self.freed(names, tempering).inverse @ cross)

    def onto(self, name: str, parts: Sequence[FloatArray], again: bool = True) -> FloatArray:
        """Inner products of the hats at a component with other rows [knots, rows]."""
        return np.concatenate([self._cross(name, part, again) for part in parts], axis=1)

    def _cross(self, name: str, part: FloatArray, again: bool) -> FloatArray:
        """Inner products of the hats at a component with other rows."""
        if not again:
            return np.asarray(self.rows(name).T @ part)
        if (name, id(part)) not in self._onto:  # the part is kept with them, so that its id stays its own
            self._onto[name, id(part)] = part, self.rows(name).T @ part
        return self._onto[name, id(part)][1]


class Courses:
    """Generic terms and free courses along some records."""

    def __init__(self, along: Sequence[Course], tempering: float, terms: Sequence[Term] = ()) -> None:
        self.along, self.tempering, self.terms = along, tempering, terms
        self._terms: list[tuple[FloatArray, FloatArray]] = []
        self._pushed: list[tuple[Push, ...]] = []

    def pushed(self, weights: Mapping[int, float], rows: int) -> list[tuple[Push, ...]]:
        """What generic terms of given weights together push in every record, for each of some rows."""
        if not weights:
            return [()] * len(self.along)
        if not self._pushed:
            self._pushed = [course.pushes(self.terms) for course in self.along]
        return [_together(pushed, weights, rows) for pushed in self._pushed]

    def of_terms(self) -> list[tuple[FloatArray, FloatArray]]:
        """What generic terms make of every record [N x channels, terms], and its inner products."""
        if not self._terms:
            made = [course.evidence.rows for course in self.along]
            own = [rows[:, rows.shape[1] - len(self.terms) :] for rows in made]
            self._terms = [(rows, rows.T @ rows) for rows in own]
        return self._terms

    def free(self, left: Remainder, components: Collection[str]) -> float:
        """Whitened square above chance that free courses at some components would take of what is left."""
        taken = sum(left.excess.get(component, 0.0) for component in components)
        gram = before = left.gram[: left.first, : left.first]
        if names := tuple(name for name in in_time(components) if name != WIND):  # what gusts do is no form
            less = each(lambda course, rows: course.taken(names, rows, self.tempering), self.along, left.rows)
            gram = gram - sum(less)
            taken -= sum(course.freed(names, self.tempering).chance for course in self.along)
        by_courses = float(projected(before, left.first, left.held)[0, 0]
                           - projected(gram, left.first, left.held)[0, 0])
        return max(taken + (1.0 + BENT) * by_courses, 0.0)


def in_time(components: Collection[str]) -> tuple[str, ...]:
    """Those components where courses of time may be free: no actuators, whose paths are judged by themselves."""
    return tuple(sorted(c for c in components if c not in PATHS[:-1]))


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
