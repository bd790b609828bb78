"""Surfaces that answer whole and late: a pure delay between command and position, which no lag and no limit is.

A transport delay (a digital actuator loop, slack that is taken up first, a hydraulic line) leaves the shape of an
answer as it was. Lags and limits say much of one, by shapes that it has not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from icing_env.record import FloatArray
from sim2real.actuators.paths import answered, counted, moving
from sim2real.actuators.rigged import squares_left
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import Reconstruction

LONGEST, APART = 0.5, 0.02  # s: the latest answer looked for, and how far apart those tried first are (assumed)
FINE = 1e-4  # s, to which the best is found


@dataclass(frozen=True)
class Late:
    """The delay of a surface that leaves least.

    Attributes:
        delay, error: s; the error where noise is one.
        gain: whitened square that it takes of what the path leaves without.
        left: share of what it explains that it leaves above noise, of whole records, the recorder's low pass as stated:
            one that gives way makes a delay of a lag of second order.
    """

    delay: float
    error: float
    gain: float
    left: float


def lateness(flights: Sequence[Reconstruction], rows: Sequence[NDArray], first: int = 0) -> dict[str, Late]:
    """The delay of every surface whose path leaves more than noise, by component.

    Args:
        rows: one PARAMETERS row for each record.
        first: sample from which they count.
    """
    found = {}
    for surface in SURFACES:
        there = moving(flights, rows, surface)
        moved, stated = _square(surface, first, there), _square(surface, 0, [(f, f.parameters) for f, _ in there])
        noise, of_whole = (sum(counted(f, f"{surface}_path", since) for f, _ in there) for since in (first, 0))
        if there and (late := _best(moved, noise)) is not None:
            without, still = stated(np.array([0.0, late.delay]))
            left = max(still - of_whole, 0.0) / max(without - still, 1e-9)
            found[f"{surface}_path"] = replace(late, left=float(left))
    return found


Square = Callable[[FloatArray], FloatArray]  # whitened squares left with some delays


def _square(surface: str, first: int, there: Sequence[tuple[Reconstruction, NDArray]]) -> Square:
    return lambda delays: late_squares(there, surface, delays, first)


def late_squares(there: Sequence[tuple[Reconstruction, NDArray]], surface: str, delays: FloatArray, first: int = 0
                 ) -> FloatArray:  # fmt: skip
    """Whitened squares that a path leaves if it answers as its rows have it, but for delays [s], rigged as is likely.

    Args:
        there: of `moving`.
        first: sample from which they count.
    """
    answers = []
    for flight, row in there:
        answer = answered(flight, surface, row)[:, 0]
        time = flight.dt * np.arange(len(answer))
        answers.append((flight, np.column_stack([np.interp(time - delay, time, answer) for delay in delays])))
    return squares_left(answers, surface, first)


def _best(moved: Square, noise: float) -> Late | None:
    """The delay that leaves least; none where nothing is left without, or the best is none. `left` is not known yet."""
    tried = np.arange(0.0, LONGEST + 0.5 * APART, APART)
    if moved(tried[:1])[0] <= noise:
        return None
    squares = moved(tried)
    k = int(np.argmin(squares))
    if k == 0:
        return None
    near = (tried[k - 1], tried[min(k + 1, len(tried) - 1)])
    delay = float(minimize_scalar(lambda x: float(moved(np.array([x]))[0]), bounds=near, method="bounded",
                                  options={"xatol": FINE}).x)  # fmt: skip
    before, least, after = moved(np.array([delay - APART, delay, delay + APART]))
    error = np.sqrt(2.0 / max((before + after - 2.0 * least) / APART**2, 1e-9))
    return Late(delay, min(float(error), LONGEST), float(squares[0] - least), np.inf)
