"""Flight-test inputs, each added to a `Plan` at a start time; a pilot's own timing and size errors come with them.

Deflections are additions to trim in rad (signs of aircraft.py), `throttle` an addition to trim throttle; `phi` and
`theta` are attitude references in rad about the trim attitude; `grip` is how firmly the pilot also holds attitude.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

DEGREE = np.pi / 180.0
AXES = {"elevator": 0, "aileron": 1, "rudder": 2}


class Plan:
    """Time histories of what the pilot intends."""

    def __init__(self, time: NDArray, rng: np.random.Generator) -> None:
        """`time` in s, 0 at the start of the record."""
        self.time, self.rng = time, rng
        self.surface = np.zeros((3, time.size))
        self.throttle = np.zeros((2, time.size))
        self.phi, self.theta = np.zeros(time.size), np.zeros(time.size)
        self.grip = np.ones(time.size)

    def loosen(self, start: float, end: float, grip: float = 0.15) -> None:
        """Hands nearly off attitude between `start` and `end`."""
        self.grip[(self.time >= start) & (self.time < end)] = grip


def steps(plan: Plan, axis: str, start: float, unit: float, size: float, pattern: Sequence[int],
          grip: float = 0.15) -> float:
    """Alternating steps of `size` deg lasting `pattern` times `unit` s, e.g. (3, -2, 1, -1); sizes err by 8 %."""
    at = start
    for part in pattern:
        lasts = abs(part) * unit * plan.rng.uniform(0.92, 1.08)
        inside = (plan.time >= at) & (plan.time < at + lasts)
        plan.surface[AXES[axis], inside] += np.sign(part) * size * DEGREE * (1 + 0.08 * plan.rng.standard_normal())
        at += lasts
    plan.loosen(start - 0.2, at + 2.5, grip)
    return at + 2.5


def three_two_one_one(plan: Plan, axis: str, start: float, size: float, unit: float) -> float:
    """The DLR 3-2-1-1."""
    return steps(plan, axis, start, unit, size, (3, -2, 1, -1))


def doublet(plan: Plan, axis: str, start: float, size: float, unit: float) -> float:
    """One step each way."""
    return steps(plan, axis, start, unit, size, (1, -1))


def sweep(plan: Plan, axis: str, start: float, size: float, lasts: float = 16.0, low: float = 0.15,
          high: float = 1.6) -> float:
    """Pilot-flown sine sweep from `low` to `high` Hz with exponentially rising frequency, `size` deg."""
    t = plan.time - start
    inside = (t >= 0) & (t < lasts)
    rate = np.log(high / low)
    phase = 2 * np.pi * low * lasts / rate * (np.exp(rate * np.clip(t, 0, lasts) / lasts) - 1)
    unsteady = 1 + 0.15 * np.sin(2 * np.pi * 0.11 * t + plan.rng.uniform(0, 6))
    plan.surface[AXES[axis]] += inside * size * DEGREE * unsteady * np.sin(phase)
    plan.loosen(start, start + lasts + 2.0, 0.3)
    return start + lasts + 2.0


def pull(plan: Plan, start: float, size: float, lasts: float = 3.0) -> float:
    """Steady pull: elevator up by `size` deg, eased in and out, then the same push."""
    for sign, at in ((-1, start), (1, start + lasts + 1.0)):
        t = (plan.time - at) / lasts
        plan.surface[0] += sign * size * DEGREE * np.where((t > 0) & (t < 1), np.sin(np.pi * np.clip(t, 0, 1)) ** 2, 0)
    plan.loosen(start, start + 2 * lasts + 2.0, 0.2)
    return start + 2 * lasts + 3.0


def turn(plan: Plan, start: float, bank: float, lasts: float = 10.0) -> float:
    """Bank of `bank` deg held for `lasts` s, nose lifted a little to hold height."""
    shape = 0.5 * (np.tanh((plan.time - start - 1.5) / 0.8) - np.tanh((plan.time - start - lasts) / 0.8))
    plan.phi += bank * DEGREE * shape
    plan.theta += abs(bank) / 25.0 * 1.2 * DEGREE * shape
    return start + lasts + 3.0


def rudder_aileron(plan: Plan, start: float, rudder: float, aileron: float) -> float:
    """Rudder doublet, then aileron doublet (deg), the lateral standard of the NASA records."""
    at = doublet(plan, "rudder", start, rudder, 1.0)
    return doublet(plan, "aileron", at, aileron, 0.8)


def throttle_steps(plan: Plan, start: float, size: float, lasts: float = 4.0) -> float:
    """Both throttles up by `size`, then down by it, with a little split between the levers."""
    split = 1 + 0.03 * plan.rng.standard_normal((2, 1))
    for sign, at in ((1, start), (-1, start + lasts)):
        inside = (plan.time >= at) & (plan.time < at + lasts)
        plan.throttle += sign * size * split * inside
    plan.loosen(start, start + 2 * lasts, 0.4)
    return start + 2 * lasts + 1.0


def deceleration(plan: Plan, start: float, lasts: float, drop: float) -> float:
    """Power back by `drop` and held, the nose rising slowly: a slow deceleration."""
    inside = (plan.time >= start) & (plan.time < start + lasts)
    plan.throttle -= drop * inside
    plan.theta += 3.0 * DEGREE * np.clip((plan.time - start) / lasts, 0, 1) * (plan.time < start + lasts + 2)
    return start + lasts + 1.0
