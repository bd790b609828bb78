"""What gusts do within a step, which the one-step map along straight lines does not say."""

from __future__ import annotations

import numpy as np

from icing_env.record import FloatArray
from icing_env.turbulence import transverse
from sim2real.prediction.gusts import Kind
from sim2real.prediction.predictor import TANGENT

TRANSVERSE = (transverse(1.0, 0.0), transverse(0.0, 1.0))  # v and w of the two states of their filters
LAG_W, LAG_V = TANGENT.index("dryden_q"), TANGENT.index("dryden_r")
MET = ((LAG_W, "gust_w", ("dryden_w1", "dryden_w2")), (LAG_V, "gust_v", ("dryden_v1", "dryden_v2")))


def as_met(matrix: FloatArray, A: FloatArray, kind: Kind) -> FloatArray:
    """A or C of `linearise` [spans, rows, states] whose lags behind w and v begin a step at the gusts that were met.

    The plant takes where they begin from the states of the gusts' filters, which is the same along a record. But what
    drives these within a step would have been met from its beginning on: the turn that a gust leaves the air with would
    be 4 % off, and slow innovations of r have twice their variance in 1.5 m/s.
    """
    if not kind.rotation:
        return matrix
    out = matrix.copy()
    for behind, gust, states in MET:
        decay = A[:, behind, behind, None]
        by_start = matrix[:, :, behind] * ((1.0 - decay) / (-np.log(decay) * decay) - 1.0)  # `turbulence.lag`
        out[:, :, TANGENT.index(gust)] += by_start
        for state, share in zip(states, TRANSVERSE, strict=True):
            out[:, :, TANGENT.index(state)] -= share * by_start
    return out


def within_steps(A: FloatArray, Qw: FloatArray, kind: Kind, span: float) -> FloatArray:
    """Covariance of the states' noise from how gusts leave the straight lines between samples that the model has.

    White noise drives them: about its line such a gust is a Brownian bridge, whose mean over the step has a twelfth of
    the variance that the step adds. The tail's delay (a Pade form) passes what is quick with its sign turned, and twice
    that mean a little later. Air that turns does so by what is quick in v and w, and its lags give it back: what it
    leaves of the aircraft's own turning is nothing, in the end.

    Args:
        A: of the one-step map.
        Qw: covariance of what drives the gusts over a step.
        kind: of the gusts.
        span: along which the air turns, m; 0 if it does not.
    """
    felt = [TANGENT.index(n) for n in ("u", "v", "w", "p", "q", "r")]
    u, v, w, tail, p, q, r = (TANGENT.index(f"gust_{n}") for n in ("u", "v", "w", "w_tail", "p", "q", "r"))
    moved = [*felt, tail, LAG_W, LAG_V, q, r]
    shape = np.zeros((4, 8))
    shape[0, 0] = shape[3, 5] = 1.0
    shape[1, 1:3] = shape[2, 3:5] = TRANSVERSE
    of_tail = 2.0 * A[felt, tail] / (1.0 + A[tail, tail])  # of a gust there that lasts the step
    of_q, of_r = 2.0 * A[felt, q], 2.0 * A[felt, r]
    of_side, of_wing = 2.0 * A[felt, v] - A[r, v] * of_r, 2.0 * A[felt, w] - A[tail, w] * of_tail - A[q, w] * of_q
    later = kind.tail_delay
    mean = np.zeros((len(moved), 4))
    of_felt, of_tail_later, of_lags = mean[:6], mean[6], mean[7:]
    of_felt[:] = np.column_stack([2.0 * A[felt, u], of_side, of_wing + (-of_tail if later else of_tail),
                                  2.0 * A[felt, p]])  # fmt: skip
    of_tail_later[2] = 2.0 * (1.0 - A[tail, tail]) if later else 0.0
    if span > 0.0:
        pitching, yawing = -np.pi / (4.0 * span) * (not later), np.pi / (3.0 * span)
        of_felt[:, 2] += of_q * pitching
        of_felt[:, 1] += of_r * yawing
        taken_w, taken_v = 1.0 - A[LAG_W, LAG_W], 1.0 - A[LAG_V, LAG_V]
        of_lags[[0, 2], 2] = taken_w, -pitching * taken_w
        of_lags[[1, 3], 1] = taken_v, -yawing * taken_v
    out = np.zeros_like(A)
    out[np.ix_(moved, moved)] = mean * np.diag(shape @ Qw @ shape.T) @ mean.T / 12.0
    return out
