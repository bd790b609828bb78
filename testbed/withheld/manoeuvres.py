"""Flight plans: five manoeuvres of 40 s, three to diagnose and two held out at other speeds.

Each plan is rich in itself (elevator and lateral inputs, levers, two or three speeds); amplitudes vary from case to
case. Inputs are added to the trimmed commands; multisine phases are Schroeder's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from testbed.withheld.plant import DT

DURATION = 40.0  # s
DEG = math.pi / 180.0
HOLD = np.array([0.25, 0.10, 0.12, 0.05])  # the pilot: elevator per theta, q; aileron per phi, p (assumed)


@dataclass(frozen=True)
class Manoeuvre:
    """`pieces`: (control 0..4 or 3 for both levers, kind, start s, size rad or 0..1, length s)."""

    speed: float
    pieces: tuple[tuple[int, str, float, float, float], ...]


def pulse(kind: str, since: NDArray, length: float) -> NDArray:
    """A unit input `since` seconds after its start."""
    inside = (since >= 0.0) & (since < length)
    x = since / length
    if kind == "doublet":
        shape = np.where(x < 0.5, 1.0, -1.0)
    elif kind == "3211":
        shape = np.where(x < 3 / 7, 1.0, np.where(x < 5 / 7, -1.0, np.where(x < 6 / 7, 1.0, -1.0)))
    elif kind == "step":
        shape = np.ones_like(x)
    elif kind == "multisine":
        k = np.arange(1, 11)
        phase = -math.pi * k * (k - 1) / len(k)
        harmonics = np.cos(2.0 * math.pi * np.outer(x, k * max(1.0, round(length * 0.12))) + phase)
        shape = harmonics.sum(axis=1) / 3.2 * np.clip(np.minimum(x, 1.0 - x) * 20.0, 0.0, 1.0)
    else:
        raise ValueError(kind)
    return np.where(inside, shape, 0.0)


def inputs(manoeuvre: Manoeuvre, gain: float = 1.0) -> NDArray:
    """What is added to the commands [samples, 5], surfaces scaled by `gain`."""
    t = np.arange(round(DURATION / DT) + 1) * DT
    out = np.zeros((len(t), 5))
    for control, kind, start, size, length in manoeuvre.pieces:
        shape = size * pulse(kind, t - start, length)
        if control == 3:
            out[:, 3] += shape
            out[:, 4] += shape
        else:
            out[:, control] += gain * shape
    return out


def _lateral(start: float, roll: float = 6.0, yaw: float = 4.0) -> tuple[tuple[int, str, float, float, float], ...]:
    return ((1, "doublet", start, roll * DEG, 1.6), (2, "doublet", start + 8.0, yaw * DEG, 2.4),
            (1, "3211", start + 16.0, roll * DEG, 3.5))  # fmt: skip


_SLOW = Manoeuvre(52.0, ((0, "doublet", 1.0, 4.0 * DEG, 2.0), (0, "step", 6.0, -3.0 * DEG, 3.0),
                         (3, "step", 10.0, -0.15, 6.0), *_lateral(17.0, 7.0, 5.0)))  # fmt: skip
_CRUISE = Manoeuvre(72.0, ((0, "3211", 1.0, 2.0 * DEG, 3.5), (0, "doublet", 7.0, 2.5 * DEG, 1.6), *_lateral(11.0),
                           (3, "step", 31.0, 0.15, 8.0)))  # fmt: skip
_MULTI = Manoeuvre(65.0, ((0, "multisine", 1.0, 1.3 * DEG, 18.0), (1, "multisine", 20.0, 2.5 * DEG, 10.0),
                          (2, "3211", 31.0, 3.0 * DEG, 4.2), (3, "step", 36.0, 0.12, 3.0)))  # fmt: skip
_POWER = Manoeuvre(60.0, ((3, "step", 1.0, 0.25, 8.0), (3, "step", 12.0, -0.2, 8.0),
                          (0, "doublet", 22.0, 3.0 * DEG, 1.6), (1, "doublet", 27.0, 7.0 * DEG, 1.6),
                          (2, "doublet", 33.0, 4.5 * DEG, 2.4)))  # fmt: skip
_FAST = Manoeuvre(78.0, ((0, "doublet", 1.0, 1.5 * DEG, 1.2), (0, "3211", 5.0, 1.5 * DEG, 3.5), *_lateral(12.0, 5., 3.),
                         (3, "step", 33.0, -0.15, 6.0)))  # fmt: skip
_PULLS = Manoeuvre(56.0, ((0, "step", 1.0, -4.0 * DEG, 2.0), (0, "step", 4.0, 4.0 * DEG, 2.0),
                          (0, "step", 9.0, -5.0 * DEG, 2.0), (2, "multisine", 14.0, 2.0 * DEG, 12.0),
                          (1, "3211", 28.0, 6.0 * DEG, 4.2), (3, "step", 34.0, 0.2, 5.0)))  # fmt: skip
_HELD_SLOW = Manoeuvre(58.0, ((0, "3211", 2.0, 3.0 * DEG, 4.2), (1, "doublet", 12.0, 8.0 * DEG, 2.0),
                              (2, "doublet", 18.0, 5.0 * DEG, 2.0), (0, "doublet", 27.0, 3.5 * DEG, 2.0),
                              (3, "step", 31.0, 0.15, 6.0)))  # fmt: skip
_HELD_FAST = Manoeuvre(75.0, ((2, "3211", 2.0, 3.0 * DEG, 4.2), (0, "multisine", 9.0, 1.2 * DEG, 12.0),
                              (1, "3211", 23.0, 5.0 * DEG, 3.5), (3, "step", 30.0, -0.15, 7.0)))  # fmt: skip
_HELD_CRUISE = Manoeuvre(68.0, ((1, "multisine", 2.0, 2.5 * DEG, 12.0), (0, "doublet", 16.0, 3.0 * DEG, 1.8),
                                (3, "step", 20.0, 0.2, 8.0), (2, "doublet", 31.0, 4.0 * DEG, 2.0)))  # fmt: skip
PLANS: tuple[tuple[Manoeuvre, ...], ...] = (  # the last two are held out
    (_SLOW, _CRUISE, _MULTI, _HELD_SLOW, _HELD_FAST),
    (_PULLS, _POWER, _FAST, _HELD_CRUISE, _HELD_SLOW),
    (_SLOW, _MULTI, _FAST, _HELD_CRUISE, _HELD_SLOW),
    (_PULLS, _CRUISE, _MULTI, _HELD_FAST, _HELD_SLOW),
)
DIAGNOSED = 3
