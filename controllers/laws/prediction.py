"""Condensed prediction of one axis for model-predictive control, and the quadratic programme of one step.

About the present measurement z = 0, z_dot = A z + B v + c with c the present rates: what the model does not know
(trim, ice, gusts) is in c and is held over the horizon, so that the prediction has no offset. v is the surface command
less the surface's present position, constant over blocks of samples. The states are eliminated (Maciejowski, Predictive
Control with Constraints, section 3.2; moves in blocks, section 2.5), which leaves a programme in the moves and one
slack of the state limit, solved by DAQP (Arnstrom, Bemporad & Axehill, "A dual active-set solver for embedded quadratic
programming", IEEE Trans. Automatic Control 67(8), 2022).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import daqp
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]
SAMPLE, BLOCKS = 0.1, (1, 1, 2, 3, 5, 8)  # s; samples that each move lasts: 2 s ahead
LOOKS = tuple(range(1, sum(BLOCKS), 2))  # samples at which the limited state is held to its limits
TOLERANCE = 1e-9
# where bounds stand: of the moves and the slack, of the changes, of the limited state upwards, downwards
MOVES = len(BLOCKS)
CHANGES = slice(MOVES + 1, 2*MOVES + 1)
UP = slice(CHANGES.stop, CHANGES.stop + len(LOOKS))
DOWN = slice(UP.stop, UP.stop + len(LOOKS))


@dataclass(frozen=True)
class Plan:
    """Programme of one axis: min 1/2 x'Hx + (F q)'x, low <= x <= high, low <= R x + D q <= high.

    x: the moves, then the slack. q: the rates c, attitude error, rate error, last command less position.
    `free` gives the x of the programme without constraints, free q.
    """

    hessian: Array
    linear: Array
    free: Array
    rows: Array
    carried: Array


def predicted(a: Array, b: Array) -> tuple[Array, Array]:
    """States after each sample per rates c, [samples, states, states], and per move, [samples, states, moves]."""
    n, count = len(a), sum(BLOCKS)
    block = np.zeros((2*n + 1, 2*n + 1))
    block[:n, :n], block[:n, n], block[:n, n + 1:] = a, b, np.eye(n)
    step = expm(block*SAMPLE)
    ad, bd, cd = step[:n, :n], step[:n, n], step[:n, n + 1:]
    per_rate, per_move = np.zeros((count, n, n)), np.zeros((count, n, len(BLOCKS)))
    rate, move, move_of = np.zeros((n, n)), np.zeros((n, len(BLOCKS))), np.repeat(np.arange(len(BLOCKS)), BLOCKS)
    for k in range(count):
        rate, move = ad @ rate + cd, ad @ move
        move[:, move_of[k]] += bd
        per_rate[k], per_move[k] = rate, move
    return per_rate, per_move


@lru_cache(maxsize=4096)
def plan(model: tuple[float, ...], weights: tuple[float, ...], states: tuple[int, int, int]) -> Plan:
    """Plan of one axis.

    Args:
        model: A [states, states] row by row, then B.
        weights: of the squares of attitude error, rate error, change of the command and slack.
        states: which state is the attitude, which the rate, which one is limited.
    """
    n = round(((1 + 4*len(model))**0.5 - 1)/2)
    per_rate, per_move = predicted(np.reshape(model[:n*n], (n, n)), np.array(model[n*n:]))
    moves, (attitude, rate, limited) = len(BLOCKS), states
    change = np.eye(moves) - np.eye(moves, k=-1)
    hessian, linear = np.zeros((moves + 1, moves + 1)), np.zeros((moves + 1, n + 3))
    for weight, state, error in ((weights[0], attitude, n), (weights[1], rate, n + 1)):
        by_move = per_move[:, state]
        hessian[:moves, :moves] += weight*by_move.T @ by_move
        linear[:moves, :n] += weight*by_move.T @ per_rate[:, state]
        linear[:moves, error] += weight*by_move.sum(axis=0)
    hessian[:moves, :moves] += weights[2]*change.T @ change
    linear[0, n + 2] -= weights[2]
    hessian[moves, moves] = weights[3]
    free = np.zeros_like(linear)
    free[:moves] = -np.linalg.solve(hessian[:moves, :moves], linear[:moves])
    looks = list(LOOKS)
    rows, carried = np.zeros((moves + 2*len(looks), moves + 1)), np.zeros((moves + 2*len(looks), n + 3))
    rows[:moves, :moves], carried[0, n + 2] = change, -1.0
    for first, slack in ((moves, -1.0), (moves + len(looks), 1.0)):
        part = slice(first, first + len(looks))
        rows[part, :moves], rows[part, moves] = per_move[looks, limited], slack
        carried[part, :n] = per_rate[looks, limited]
    return Plan(hessian, linear, free, rows, carried)


def solve(p: Plan, q: Array, low: float, high: float, first: float, later: float, below: float, above: float,
          slack: float) -> float:
    """First move of one step, or NaN where there is none.

    Args:
        p: of `plan`.
        q: what the programme depends on.
        low, high: bounds of every move [rad].
        first, later: largest change at the first move and at each later one [rad].
        below, above: how far the limited state may go down and up; infinite where it is not limited.
        slack: linear weight of the slack.

    The programme without constraints is tried first: where its answer keeps them all, it is the answer.
    """
    if not np.isfinite(q).all():
        return float("nan")
    moves, at = len(BLOCKS), p.carried @ q
    lower, upper = np.full((2, 1 + moves + len(at)), np.inf)
    lower *= -1.0
    lower[:moves], upper[:moves], lower[moves] = low, high, 0.0
    lower[CHANGES], upper[CHANGES], upper[UP], lower[DOWN] = -later, later, above, -below
    lower[moves + 1], upper[moves + 1] = -first, first
    upper[moves + 1:] -= at
    lower[moves + 1:] -= at
    x = p.free @ q
    reached = np.concatenate((x, p.rows @ x))
    if not ((reached <= upper + TOLERANCE).all() and (reached >= lower - TOLERANCE).all()):
        f = p.linear @ q
        f[moves] = slack
        if not np.isfinite(f).all():
            return float("nan")
        x, _, flag, _ = daqp.solve(p.hessian, f, p.rows, np.minimum(upper, 1e30), np.maximum(lower, -1e30),
                                   np.zeros(len(upper), np.int32))
        if flag <= 0:
            return float("nan")
    return float(x[0]) if np.isfinite(x).all() else float("nan")
