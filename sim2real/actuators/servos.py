"""The lag of the servos, which no source tells of this aircraft: what all surfaces say together.

The aircraft file's is assumed. Where at least two surfaces, and all that move but one, follow their commands with
another lag, whatever the delay of the recorder, that is the aircraft's own and no gap. One surface that differs from
the others has an effect: its vote is limited, as it is where the time of commands is found (`timing.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from icing_env.record import FloatArray
from sim2real.actuators.paths import moves
from sim2real.actuators.timing import VOTE, square
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import Reconstruction

SERVOS = np.array([0.0, 0.015, 0.03, 0.05, 0.075, 0.1, 0.14, 0.2, 0.3])  # s, tried
SHIFTS = np.arange(-4, 5) / 2.0  # of a sample, by which commands may be late
ASKED = 20.0  # whitened square by which another lag than the file's has to be better (assumed)


def of_all_servos(flights: Sequence[Reconstruction]) -> list[Reconstruction]:
    """Records over the lag that their surfaces follow commands with, where that is not the aircraft file's."""
    moved = [s for s in SURFACES if any(moves(flight, s) for flight in flights)]
    if len(moved) < 2:
        return list(flights)
    timed = [replace(f, timing=max(f.timing, f.dt / np.sqrt(12.0))) for f in flights]
    squares = np.array([_squares(timed, moved, lag) for lag in SERVOS])  # [lags, surfaces]
    squares = np.vstack([_squares(timed, moved, None), squares])
    against = _against(squares, squares.min(axis=0))
    k = int(np.argmin(against[1:]))
    if not against[1 + k] + ASKED < against[0]:
        return list(flights)
    low, high = SERVOS[max(k - 1, 0)], SERVOS[min(k + 1, len(SERVOS) - 1)]
    best = minimize_scalar(lambda lag: _against(_squares(timed, moved, lag), squares.min(axis=0)), method="bounded",
                           bounds=(low, high), options={"xatol": 1e-3, "maxiter": 12})  # fmt: skip
    return [_with(f, float(best.x), f"surfaces follow commands {1e3 * best.x:.0f} ms late: all of them, no gap")
            for f in flights]


def _against(squares: FloatArray, least: FloatArray) -> FloatArray:
    """What surfaces [..., surfaces] hold against a lag; one alone not more than its vote."""
    return np.asarray(np.minimum(squares - least, VOTE).sum(axis=-1))


def _squares(flights: Sequence[Reconstruction], moved: Sequence[str], lag: float | None) -> FloatArray:
    """Whitened square of every surface's positions at the delay that suits it and the others best [surfaces]."""
    own = flights if lag is None else [_with(f, lag) for f in flights]
    by_shift = np.array([[square(own, s, shift, np.inf) for s in moved] for shift in SHIFTS])
    return np.asarray(by_shift[np.argmin(_against(by_shift, by_shift.min(axis=0)))])


def _with(flight: Reconstruction, lag: float, note: str = "") -> Reconstruction:
    row = flight.parameters.copy()
    for surface in SURFACES:
        row[f"{surface}_lag"] = lag
    return replace(flight, parameters=row, notes=(*flight.notes, *([note] if note else ())))
