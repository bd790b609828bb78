"""What small pushes make of one-step predictions: the filter's linear response to them, quicker than a flight.

An acceleration or an error of a channel that is small moves the predictor as its linearised plant does, corrected by
the same gain. The plant is linearised along the model's own flight; between the middles of spans its matrices are
interpolated. What is too large for that (see `sim2real.flown.other_form`) is flown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.jit import entry
from icing_env.record import FloatArray
from sim2real.prediction.correction import ROTATION, STATES
from sim2real.prediction.kalman import Gain, linearise
from sim2real.prediction.predictor import TANGENT, Push, seen
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction

SPAN = 0.25  # s between linearisations: another tenth of that changes responses in turbulence by 0.1 %
AT_ONCE = 200  # spans linearised together


@dataclass(frozen=True)
class Responses:
    """Whitened departures from the model's flight [N x channels, rows], of these rows."""

    rows: tuple[int, ...] = ()
    values: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True)
class Filter:
    """The predictor linearised along the model's flight.

    flight: the record, `measured` as the model predicts it; factor: whitens innovations [N-1, channels, channels];
    first: samples left out at the start of what comes out.
    """

    flight: Reconstruction
    gain: Gain
    factor: FloatArray
    first: int

    def respond(self, pushes: Sequence[Push]) -> Responses:
        """What the rows of some pushes make of the record."""
        flight, rows = self.flight, sorted({q.row for q in pushes})
        out = np.zeros(((len(flight.time) - 1 - self.first) * len(MEASURED), len(rows)))
        if not rows:
            return Responses((), out)
        forces = [(rows.index(q.row), at, series) for q in pushes if not q.sensor
                  for at, series in _in_a_step(flight, q.target, q.series * flight.dt)]  # fmt: skip
        felt = [(rows.index(q.row), MEASURED.index("a" + "xyz"["uvw".index(q.target)]), q.series) for q in pushes
                if not q.sensor and q.target in "uvw"]  # fmt: skip
        errors = felt + [(rows.index(q.row), MEASURED.index(q.target), q.series) for q in pushes if q.sensor]
        order, onset = _in_turn(pushes, rows)
        place = np.argsort(order)
        forces, errors = ([(int(place[row]), at, series) for row, at, series in items] for items in (forces, errors))
        A, C, K, each, place_of = self._along
        forces = [(row, place_of[at], series) for row, at, series in forces]
        _respond(A, C, each, K, seen(flight), *_by_sample(forces, flight), *_by_sample(errors, flight),
                 self.factor, order, onset, out, self.first)
        return Responses(tuple(rows), out)

    @cached_property
    def _along(self) -> tuple[FloatArray, FloatArray, FloatArray, int, NDArray[np.intp]]:
        """A, C in the middle of each span, the gain, and the steps of a span; where each state stands in them.

        States of air that turns are left out where it does not.
        """
        dt, steps = self.flight.dt, len(self.flight.time) - 1
        each = max(round(SPAN / dt), 1)
        spans = [slice(k, min(k + each, steps + 1)) for k in range(0, steps, each)]
        kind = self.gain.gusts.kind
        found = [linearise(self.flight, spans[k : k + AT_ONCE], kind)[:2] for k in range(0, len(spans), AT_ONCE)]
        A, C = (np.concatenate(matrices) for matrices in zip(*found, strict=True))
        moves = np.array([kind.rotation or name not in ROTATION for name in TANGENT])
        K = np.ascontiguousarray(self.gain.K[:, moves])
        return A[:, moves][:, :, moves], C[:, :, moves], K, each, np.cumsum(moves) - 1


def _in_a_step(flight: Reconstruction, target: str, size: FloatArray) -> list[tuple[int, FloatArray]]:
    """What acts on a state through every step, put at its start [N]: of a turn, half is taken back (`along.push`)."""
    if target not in "pqr":
        return [(STATES.index(target), size)]
    back = -0.5 * flight.dt * size
    turns = flight.once("turns", lambda: _turns(flight))
    return [(STATES.index(target), size), *((at, back * by) for at, by in turns[target])]


def _turns(flight: Reconstruction) -> dict[str, list[tuple[int, float | FloatArray]]]:
    """What turning about each body axis changes: (state, by how much for each rad) of every one, each sample [N]."""
    phi, theta, V, alpha, beta = (flight.channel(name) for name in ("phi", "theta", "airspeed", "alpha", "beta"))
    u, v, w, roll = V * np.cos(alpha), V * beta, V * np.sin(alpha), len(STATES)
    return {"p": [(1, w), (2, -v), (roll, 1.0)],
            "q": [(0, -w), (2, u), (roll, np.tan(theta) * np.sin(phi)), (roll + 1, np.cos(phi))],
            "r": [(0, v), (1, -u), (roll, np.tan(theta) * np.cos(phi)), (roll + 1, -np.sin(phi))]}


def _in_turn(pushes: Sequence[Push], rows: Sequence[int]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices of rows in the order in which they are first pushed, and the samples at which they are."""
    onset = {row: len(pushes[0].series) for row in rows}
    for push in pushes:
        if push.series.any():
            onset[push.row] = min(onset[push.row], int(np.argmax(push.series != 0.0)))
    first = np.array([onset[row] for row in rows], np.intp)
    order = np.argsort(first, kind="stable")
    return order, first[order]


def _by_sample(items: list[tuple[int, int, FloatArray]], flight: Reconstruction) -> tuple[Any, FloatArray]:
    """(row, state or channel) of each [items, 2], and their series [N, items]."""
    at = np.array([item[:2] for item in items], np.intp).reshape(-1, 2)
    return at, np.column_stack([item[2] for item in items]) if items else np.zeros((len(flight.time), 0))


@entry
def _respond(A: Any, C: Any, each: int, gain: Any, weight: Any, force_at: Any, force: Any, error_at: Any, error: Any,
             factor: Any, order: Any, onset: Any, out: Any, first: int) -> None:
    """Step the departures of all rows together, each from where it is first pushed.

    Args:
        A, C: of the one-step map in the middle of every span of `each` steps [spans, states or channels, states].
        gain: [steps, states, FED_BACK], the last step's goes on.
        weight: of every reading in the correction, zero where nothing was measured [N, channels].
        force_at, force: (row, state) of what is added to states [F, 2], and how much in a step, as it is at each
            sample [N, F]; rows as they stand in `order`.
        error_at, error: (row, channel) of what is added to readings [E, 2], and how much at each sample [N, E].
        factor: [N-1, channels, channels].
        order: where each row stands in `out` [rows].
        onset: sample before which nothing pushes it, ascending [rows].
        out: [(N-1-first) x channels, rows], zeros.
    """
    n, m, fed = A.shape[1], C.shape[1], gain.shape[2]
    both, fall, read = np.empty((n + m, n)), np.empty((n, fed)), np.empty((m, m))
    x = np.zeros((n, 0))
    after, white = np.zeros((n + m, 0)), np.zeros((m, 0))
    for k in range(len(factor)):
        rows = x.shape[1]
        while rows < len(onset) and onset[rows] <= k + 1:
            rows += 1
        if rows > x.shape[1]:
            grown = np.zeros((n, rows))
            grown[:, : x.shape[1]] = x
            x, after, white = grown, np.zeros((n + m, rows)), np.zeros((m, rows))
        if rows == 0:
            continue
        at = (k + 0.5)/each - 0.5
        i = min(max(int(np.floor(at)), 0), len(A) - 1)
        j, share = min(i + 1, len(A) - 1), min(max(at - i, 0.0), 1.0)
        both[n:] = (1.0 - share)*C[i] + share*C[j]
        own = gain[min(k, len(gain) - 1)]
        for s in range(n):
            for c in range(fed):
                fall[s, c] = own[s, c]*weight[k + 1, c]
        both[:n] = (1.0 - share)*A[i] + share*A[j]
        for f in range(len(force_at)):
            if force_at[f, 0] < rows:
                x[force_at[f, 1], force_at[f, 0]] += 0.5*(force[k, f] + force[k + 1, f])
        both[:n] -= np.dot(fall, both[n : n + fed])
        np.dot(both, x, after)
        x[:] = after[:n]
        for e in range(len(error_at)):
            row, channel, size = error_at[e, 0], error_at[e, 1], error[k + 1, e]
            if row < rows and size != 0.0:
                after[n + channel, row] += size
                if channel < fed:
                    for s in range(n):
                        x[s, row] -= fall[s, channel]*size
        if k >= first:
            for c in range(m):
                for d in range(m):
                    read[c, d] = -factor[k, c, d] if weight[k + 1, d] > 0.0 else 0.0
            np.dot(read, after[n:], white)
            for c in range(m):
                to = out[(k - first)*m + c]
                for r in range(rows):
                    to[order[r]] = white[c, r]
