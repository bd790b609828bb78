"""When recorded commands act: each recorder's own affair, found from what all surfaces say together.

A command may act in the step that ends at its sample, in the one that begins there, or in between where the recorder's
step is not the controller's; taken wrongly, every actuator lags (or leads). One surface alone may have an effect, so
that its vote is limited; how sharply commands are known in time is what all surfaces tell, or all but one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.actuators.paths import counted, follow, moves, position_noise
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import Reconstruction

LAGS = np.array([0.0, -0.03, -0.015, 0.015, 0.03, 0.06, 0.1, 0.15, 0.22, 0.3, 0.5])  # s, beside the published one
SHIFTS = np.arange(-16, 17) / 8.0  # of a sample, by which commands are late
LATER = 6.0  # whitened square by which another lag, and another moment than a sample, have to be better (assumed)
VOTE = 25.0  # whitened square that one surface can hold against a moment (assumed)
FOLLOWED = 1.15  # mean square, of samples that count, up to which a surface is where its command puts it (assumed)
BETWEEN = 0.25  # of a sample, what is left of a delay that is none of whole samples (assumed)
ROUNDS = 2  # of finding when commands act, and how sharply that is known
SHARPNESS = np.array([0.1, 0.2, 0.4, 0.7, 1.0])  # of a sample's interval over the root of 12: how commands are timed


def in_step(flights: Sequence[Reconstruction]) -> list[Reconstruction]:
    """Records with their commands when positions say that they act, and how sharply that is known (`timing`)."""
    moved = [s for s in SURFACES if any(moves(flight, s) for flight in flights)]
    if not moved:
        return list(flights)
    timing = [max(f.timing, f.dt / np.sqrt(12.0)) for f in flights]
    for _ in range(ROUNDS):
        shift = _shift([replace(f, timing=t) for f, t in zip(flights, timing, strict=True)], moved)
        late = [_late(flight, shift) for flight in flights]
        timing = _sharpest(late, moved)
    unsure = 0.0 if shift in (0.0, 1.0) else BETWEEN
    return [replace(f, timing=max(t, unsure * f.dt)) for f, t in zip(late, timing, strict=True)]


def _shift(flights: Sequence[Reconstruction], moved: Sequence[str]) -> float:
    """Samples by which commands are to be taken later."""
    lag = LATER if len(moved) == 1 else np.inf  # of one surface, a lag of its own is as good as a delay
    squares = np.array([[square(flights, s, shift, lag) for shift in SHIFTS] for s in moved])
    against = np.minimum(squares - squares.min(axis=1, keepdims=True), VOTE).sum(axis=0)
    whole = np.isin(SHIFTS, (0.0, 1.0))
    against[~whole] += LATER if len(moved) > 1 else np.inf
    against[SHIFTS == 1.0] += LATER
    return float(SHIFTS[np.argmin(against)])


def _late(flight: Reconstruction, shift: float) -> Reconstruction:
    """The record with its surface commands `shift` samples later."""
    if shift == 0.0:
        return flight
    later = {n: _later(c, shift) if n.endswith("_command") else c for n, c in flight.commands.items()}
    return replace(flight, commands=later, notes=(
        *flight.notes, f"commands taken {shift:g} samples later: positions follow them better so"))


def _later(command: FloatArray, shift: float) -> FloatArray:
    at = np.arange(len(command), dtype=np.float64)
    return command if shift == 0.0 else np.interp(at - shift, at, command)


def _sharpest(flights: Sequence[Reconstruction], moved: Sequence[str]) -> list[float]:
    """The sharpest timing of every record with which all surfaces, or all but one, follow the published actuator."""
    for share in SHARPNESS:
        timing = [float(max(f.timing, share * f.dt / np.sqrt(12.0))) for f in flights]
        known = [replace(f, timing=t) for f, t in zip(flights, timing, strict=True)]
        followed = [square(known, s, 0.0, np.inf) < FOLLOWED * _counted(known, s) for s in moved]
        if sum(followed) >= max(len(moved) - 1, 1):
            break
    return timing


def _counted(flights: Sequence[Reconstruction], surface: str) -> int:
    return sum(counted(f, f"{surface}_path") for f in flights if moves(f, surface))


def square(flights: Sequence[Reconstruction], surface: str, shift: float, other: float) -> float:
    """Whitened square of a surface's positions behind its command, `shift` samples later; another lag costs `other`."""
    lags = LAGS if np.isfinite(other) else LAGS[:1]
    total = np.sum([_left(flight, surface, shift, lags) for flight in flights if moves(flight, surface)], axis=0)
    return float(min(total[0], total.min() + other))


def _left(flight: Reconstruction, surface: str, shift: float, lags: FloatArray) -> FloatArray:
    """Whitened square at every lag beside the published one, geared and offset as suits best."""
    rows = flight.once(("lags", surface, len(lags)), lambda: _with_lags(flight, surface, lags))
    recorded = flight.positions[surface]
    good, (_, noise) = np.isfinite(recorded), position_noise(flight, surface)
    command = _later(flight.commands[f"{surface}_command"], shift)
    where = follow(command, recorded[good][0], rows, surface, flight.dt)[good]
    wanted, weight = recorded[good, None], noise[good, None] ** -2.0
    away, left = (x - np.sum(weight * x, axis=0) / np.sum(weight) for x in (where, wanted))
    gear = np.sum(weight * away * left, axis=0) / np.maximum(np.sum(weight * away**2, axis=0), 1e-300)
    return np.asarray(np.sum(weight * (left - gear * away) ** 2, axis=0))


def _with_lags(flight: Reconstruction, surface: str, lags: FloatArray) -> NDArray:
    """PARAMETERS of one row for each lag beside the published one."""
    rows = np.repeat(flight.parameters, len(lags))
    rows[f"{surface}_lag"] = np.maximum(rows[f"{surface}_lag"] + lags, 0.0)
    return rows
