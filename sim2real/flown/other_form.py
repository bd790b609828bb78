"""A set of effects flown together with generic terms at home: in its other form.

Terms are linear only nearby. Where they take much of a large gap, the few per cent that a linear fit misses of them
would be blamed on something else: such terms are flown, and brought to their best with sizes and nuisances together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.flown.points import Flying
from sim2real.flown.steps import Point, bounded_step, rooms, size_steps
from sim2real.posterior.form import WORTH, Form, own_powers
from sim2real.posterior.generic import UnknownFit, fit_unknown_left, moved
from sim2real.posterior.home_terms import gain
from sim2real.posterior.sets import SetFit
from sim2real.signatures.courses import Remainder

ROUNDS, SETTLED = 6, 0.5  # steps towards the best, and the gain of log evidence below which one is the last


@dataclass(frozen=True)
class Bent:
    """A set flown with generic terms: where, and what it leaves."""

    point: Point
    left: Remainder


def other_form(flying: Flying, fit: SetFit, flown: Bent, rows: Sequence[int], square: FloatArray,
               rho: Sequence[float]) -> tuple[Form, Bent | None]:
    """Another form of a set that was flown, and where the set was flown in it, if that is worth a flight.

    Args:
        flown: without terms.
        rows: of the terms at home in what it leaves, as `Remainder.reduced` has them.
        square: of `form.room` [rows].
        rho: of `form.shares`.
    """
    left, terms = flown.left.reduced(), [flying.candidates.terms[row - 1] for row in rows]
    misfit, inner, onto = float(left[0, 0]), left[np.ix_(rows, rows)], left[rows, 0]
    places, powers = [term.component for term in terms], own_powers(fit, terms)
    form = gain(inner, onto, square, misfit, rho, places, powers=powers)
    k = int(np.argmax(form.gained))
    chosen = [j for j, term in enumerate(terms) if square[j] > 0.0 and inner[j, j] > 1e-9
              and not term.component.endswith("_path") and (powers[j] or not form.few)]  # fmt: skip
    if not chosen or form.gained[k] < WORTH:
        return form, None
    variance = rho[k - 1] ** 2 * square[chosen] / inner[chosen, chosen]
    bent = bring(flying, fit, flown, [rows[j] for j in chosen], variance)
    weights, after = bent.point.weights, bent.left.reduced()
    at = np.array([weights.get(term.row, 0.0) for term in terms])
    form = gain(after[np.ix_(rows, rows)], after[rows, 0], square, misfit, rho, places, at,
                misfit - float(after[0, 0]), powers)
    return replace(form, weights=dict(weights)), bent


def flown_unknown(flying: Flying, fit: SetFit, flown: Bent, unknown: UnknownFit) -> tuple[UnknownFit, Point]:
    """Something unknown beside a set, its terms (and nuisances with them) brought to their best where they are flown.

    Its terms are chosen anew there: where the model's own numbers went as far as they may, they need not any more.

    Returns:
        It, its evidence over what the set leaves alone, and where it was flown: the set's own place if its terms are
        not flown.
    """
    terms = flying.candidates.terms
    rows = [1 + j for j, term in enumerate(terms) if term.component == unknown.component]
    before = flown.left.reduced()
    rows = [row for row in rows if before[row, row] > 1e-9]
    if not rows or unknown.component.endswith("_path"):
        return unknown, flown.point
    bent = bring(flying, fit, flown, rows, np.ones(len(rows)))
    # slopes anew: where numbers went as far as they may for want of the terms, these lead but half the way back
    point = replace(flying.point(fit, bent.point.sizes, bent.point.nuisances), weights=bent.point.weights)
    bent = bring(flying, fit, Bent(point, flying.left_over(fit, point)), rows, np.ones(len(rows)))
    weights = np.array([bent.point.weights.get(terms[row - 1].row, 0.0) for row in rows])
    left = moved(bent.left.reduced(), rows, -weights)
    linear, there = (next(u for u in fit_unknown_left(inner, flying.candidates) if u.component == unknown.component)
                     for inner in (before, left))  # fmt: skip
    better = there.log_evidence - linear.log_evidence + 0.5 * float(before[0, 0] - left[0, 0])
    return replace(there, log_evidence=unknown.log_evidence + better), bent.point


def flown_squares(fit: SetFit, flown: Bent) -> tuple[list[float], list[float]]:
    """`form.squares` of a set by its slopes where it was flown: nuisances integrated out, and where they are."""
    k, gram = len(fit.families), flown.left.gram
    away = flown.point.sizes - np.array([f.parameter.neutral for f in fit.families])
    times = (away / flown.point.steps) ** 2
    gone = [j for j in range(1 + k, flown.left.first) if j not in flown.left.held]
    across = gram[np.ix_(gone, range(1, 1 + k))]
    taken = np.sum(across * np.linalg.solve(gram[np.ix_(gone, gone)], across), axis=0)
    whole = np.diag(gram)[1 : 1 + k]
    return list(times * np.maximum(whole - taken, 0.0)), list(times * whole)


def bring(flying: Flying, fit: SetFit, bent: Bent, rows: Sequence[int], variance: FloatArray) -> Bent:
    """A set and generic terms at their best, by Gauss-Newton; a step that does not help is halved.

    Args:
        bent: where to begin; without weights, the set as it was flown alone.
        rows: of the terms in what it leaves, as `Remainder.reduced` has them.
        variance: of their prior [rows].
    """
    terms, first, share = flying.candidates.terms, bent.left.first, 1.0
    names, at = [terms[row - 1].row for row in rows], np.r_[1:first, [first + row - 1 for row in rows]]
    for _ in range(ROUNDS):
        weights = np.array([bent.point.weights.get(name, 0.0) for name in names])
        slope = bent.left.gram[at, 0] + np.r_[np.zeros(first - 1), weights / variance]
        inner = bent.left.gram[np.ix_(at, at)] + np.diag(np.r_[np.zeros(first - 1), 1.0 / variance])
        unit, free = bent.point.steps, np.full(len(names), np.inf)
        low, high = rooms(fit, bent.point, unit)
        step = share * bounded_step(inner, slope, np.r_[low, -free], np.r_[high, free])
        if -float(step @ slope) - 0.5 * float(step @ inner @ step) < SETTLED:
            break
        k = len(unit)
        sizes = bent.point.sizes + step[:k] * unit
        point = replace(bent.point, sizes=sizes, steps=size_steps(fit, sizes),
                        nuisances=bent.point.nuisances + step[k : first - 1],
                        weights=dict(zip(names, weights + step[first - 1 :], strict=True)))  # fmt: skip
        tried = Bent(point, flying.left_over(fit, point))
        if _cost(tried, names, variance) < _cost(bent, names, variance):
            bent, share = tried, 1.0
        else:
            share *= 0.5
    return bent


def _cost(bent: Bent, names: Sequence[int], variance: FloatArray) -> float:
    """Half the whitened square that is left, priors included."""
    weights = np.array([bent.point.weights.get(name, 0.0) for name in names])
    return 0.5 * float(bent.left.gram[0, 0]) + 0.5 * float(np.sum(weights**2 / variance))
