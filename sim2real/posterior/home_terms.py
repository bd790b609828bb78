"""What generic terms at home add to a set of effects: its other form, linear in the terms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.posterior.form import SHARES, Form, Liberty


def without(gram: FloatArray, first: int) -> tuple[FloatArray, FloatArray]:
    """Inner products of terms (from row `first` on) with one another and with row 0, the sizes between integrated out.

    A size may move by its own uncertainty, which is the unit of its row.
    """
    own, terms = np.arange(1, first), np.arange(first, len(gram))
    inner, onto = gram[np.ix_(terms, terms)], gram[terms, 0]
    if len(own):
        moved = np.linalg.solve(gram[np.ix_(own, own)] + 1e-2 * np.eye(len(own)), gram[own])
        inner, onto = inner - gram[np.ix_(terms, own)] @ moved[:, terms], onto - gram[np.ix_(terms, own)] @ moved[:, 0]
    return inner, onto


def gain(inner: FloatArray, onto: FloatArray, square: FloatArray, misfit: float,
         rho: Sequence[float] = SHARES, at: Sequence[str] = (), flown: FloatArray | None = None,
         closer: float = 0.0, powers: NDArray[np.bool_] | None = None) -> Form:
    """What generic terms at home add to a set, averaged over the prior of another form.

    All of them may be needed or, as likely, powers of the set's own regressors alone: what saturates is of one term
    more, and to pay for all others would leave it to something unknown that needs few.

    Args:
        inner: inner products of the terms [m, m], nuisances and sizes integrated out.
        onto: of the terms with what the set leaves over [m].
        square: of `room` [m].
        misfit: whitened square that the set leaves over.
        rho: of `shares`.
        at: component of each term [m]; none takes more than its own terms may; one and the same if omitted.
        flown: coefficients of the terms where `inner` and `onto` are those of a set flown with them [m].
        closer: by which that flight leaves less than `misfit`.
        powers: of `own_powers` [m]; none if omitted.
    """
    flown = np.zeros(len(inner)) if flown is None else flown
    at = list(at) or [""] * len(inner)
    places = len(set(at))
    used = np.flatnonzero((np.diag(inner) > 1e-9) & (square > 0.0))
    if not len(used):
        return Form((0.0,), (misfit,), (Liberty(places=places),))
    own = used[:0] if powers is None else used[powers[used]]
    some = [used, own] if 0 < len(own) < len(used) else [used]
    ways = [[_way(inner, onto, share**2 * square, at, few, flown, closer) for few in some] for share in rho]
    logs = [0.0, *(float(np.logaddexp.reduce([log for log, _ in way]) - np.log(len(way))) for way in ways)]
    taken = [0.0, *(max(way)[1] for way in ways)]
    k = int(np.argmax(logs))
    return Form(tuple(log - float(np.log(len(logs))) for log in logs), tuple(misfit - t for t in taken),
                (Liberty(places=places),), few=k > 0 and len(some) > 1 and ways[k - 1][1] > ways[k - 1][0])


def _way(inner: FloatArray, onto: FloatArray, square: FloatArray, at: Sequence[str], used: NDArray[np.intp],
         flown: FloatArray, closer: float) -> tuple[float, float]:  # fmt: skip
    """Log evidence of some terms, the others at nothing, and the whitened square that they take beyond luck."""
    others = np.setdiff1d(np.flatnonzero(flown), used)
    back = -flown[others]
    closer = closer - float(2.0 * onto[others] @ back + back @ inner[np.ix_(others, others)] @ back)
    onto = onto + inner[:, others] @ back
    most = square[used]
    size = np.sqrt(most / np.diag(inner)[used])
    scaled = inner[np.ix_(used, used)] * size[:, None] * size
    whole, away = np.eye(len(used)) + scaled, flown[used] / size
    along = onto[used] * size
    step = -np.linalg.solve(whole, along + away)
    step = _within(away + step, scaled, most, [at[j] for j in used]) - away
    better = 0.5 * closer - float(step @ along) - 0.5 * float(step @ scaled @ step)
    log = better - 0.5 * float(np.sum((away + step) ** 2)) - 0.5 * float(np.linalg.slogdet(whole)[1])
    share_of = np.linalg.solve(whole, scaled)  # of noise, that so many terms take
    luck = float(2.0 * np.trace(share_of) - np.sum(share_of * share_of.T))
    # a Gaussian prior alone would not forbid a larger remainder
    return min(log, 0.5 * float(most.sum())), min(max(2.0 * better - luck, 0.0), float(most.sum()))


def given(left: FloatArray, rows: Sequence[int], square: FloatArray, share: float) -> FloatArray:
    """Inner products `left` after generic terms at `rows` have taken what `share` of the prior's allows them.

    Args:
        left: of what is left (row 0) and of generic terms.
        square: of `room` [rows].
    """
    used = [(row, share**2 * s / left[row, row]) for row, s in zip(rows, square, strict=True)
            if left[row, row] > 1e-9 and s > 0.0]  # fmt: skip
    at, variance = [row for row, _ in used], np.array([v for _, v in used])
    return np.asarray(left - left[:, at] @ np.linalg.solve(left[np.ix_(at, at)] + np.diag(1.0 / variance), left[at]))


def _within(weights: FloatArray, inner: FloatArray, most: FloatArray, at: Sequence[str]) -> FloatArray:
    """Weights of terms, those of a component scaled down where together they take more than they may [m]."""
    out = weights.copy()
    for component in set(at):
        own = np.flatnonzero([place == component for place in at])
        taken = float(weights[own] @ inner[np.ix_(own, own)] @ weights[own])
        out[own] *= np.sqrt(min(float(most[own].sum()) / max(taken, 1e-12), 1.0))
    return out
