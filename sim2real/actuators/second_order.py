"""Surfaces whose actuators are of second order: what a lag is as often as not, and what no first-order lag says.

x'' = w^2 (command - x) - 2 zeta w x', its rate limited: the usual model of a servo. Two numbers say all of its answer,
and none of its overshoot is anything unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from icing_env.jit import entry
from icing_env.record import FloatArray
from sim2real.actuators.paths import answered, moving
from sim2real.actuators.rigged import squares_left
from sim2real.records.reconstruct import Reconstruction

FREQUENCIES, DAMPINGS = (2.0, 60.0), (0.35, 1.5)  # rad/s and 1: what is looked for (assumed)
TRIED = (16, 5)  # of these at first
PARTS = 16  # steps of the actuator in one of the record
FINE = 1e-3  # of each, to which the best is found
DAMPING, FREQUENCY = "damping ratio", "natural frequency"  # how these are named among terms, after their surface


@dataclass(frozen=True)
class SecondOrder:
    """The actuator of second order that leaves least.

    Attributes:
        frequency, damping: rad/s and 1.
        errors: standard errors of these two, each with the other as it is.
        gain: whitened square that it takes of what the path leaves as it is.
    """

    frequency: float
    damping: float
    errors: tuple[float, ...]
    gain: float


def second_order(flights: Sequence[Reconstruction], rows: Sequence[NDArray], surface: str, first: int = 0
                 ) -> SecondOrder | None:  # fmt: skip
    """The likeliest actuator of second order in the place of a surface's own; none where it takes nothing.

    Args:
        rows: one PARAMETERS row for each record.
        first: sample from which they count.
    """
    there = moving(flights, rows, surface)
    if not there:
        return None

    def left(tried: FloatArray) -> FloatArray:
        return squares_left([(f, follow(f, surface, row, within(tried))) for f, row in there], surface, first)

    frequency, damping = (np.geomspace(*FREQUENCIES, TRIED[0]), np.linspace(*DAMPINGS, TRIED[1]))
    tried = np.array([(w, z) for w in frequency for z in damping])
    near = tried[int(np.argmin(left(tried)))]
    scale = np.array([near[0], 1.0])
    best = within(scale * minimize(lambda x: float(left(x[None] * scale)[0]), near / scale, method="Nelder-Mead",
                                   options={"xatol": FINE, "fatol": 0.01}).x)  # fmt: skip
    steps = np.array([0.05 * best[0], 0.05])
    here, *around = left(best + np.vstack([np.zeros(2), np.diag(steps), -np.diag(steps)]))
    gain = float(squares_left([(f, answered(f, surface, row)) for f, row in there], surface, first)[0] - here)
    curvature = (np.array(around[:2]) + around[2:] - 2.0 * here) / steps**2
    errors = tuple(float(e) for e in np.sqrt(2.0 / np.maximum(curvature, 1e-9)))
    return SecondOrder(float(best[0]), float(best[1]), errors, gain) if gain > 0.0 else None


def within(tried: FloatArray) -> FloatArray:
    """Frequencies and dampings [..., 2] that are looked for."""
    return np.clip(tried, (FREQUENCIES[0], DAMPINGS[0]), (FREQUENCIES[1], DAMPINGS[1]))


def follow(flight: Reconstruction, surface: str, row: NDArray, tried: FloatArray) -> FloatArray:
    """Position [N, M] of a surface behind actuators tried [M, 2], and the recording's low pass.

    The command of sample k acts during the step that ends there.

    Args:
        tried: frequencies and dampings.
    """
    measured = flight.positions[surface]
    start = float(measured[np.isfinite(measured)][0])
    gear, offset, low, high, rate = (float(row[f"{surface}_{of}"][0]) for of in
                                     ("gearing", "offset", "min", "max", "rate"))  # fmt: skip
    cut = float(1.0 - np.exp(-2.0 * np.pi * row["filter_frequency"][0] * flight.dt))
    told = np.clip(gear * flight.commands[f"{surface}_command"] + offset, low, high)
    out = np.empty((len(told), len(tried)))
    _follow(told, start, np.ascontiguousarray(tried), rate, cut, flight.dt / PARTS, out)
    return out


@entry
def _follow(told: Any, start: float, tried: Any, limit: float, cut: float, step: float, out: Any) -> None:
    """Velocity Verlet steps of every actuator, its rate within the limit, then the low pass; `out`: [N, M]."""
    for i in range(out.shape[1]):
        stiff, drag = tried[i, 0]**2, 2.0*tried[i, 1]*tried[i, 0]
        position = filtered = start
        rate = 0.0
        out[0, i] = start
        for k in range(1, len(told)):
            for _ in range(PARTS):
                half = rate + 0.5*step*(stiff*(told[k] - position) - drag*rate)
                half = min(max(half, -limit), limit)
                position += step*half
                rate = half + 0.5*step*(stiff*(told[k] - position) - drag*half)
            filtered += cut*(position - filtered)
            out[k, i] = filtered
