"""Mass effects that are in no list."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.aircraft import GRAVITY
from testbed.elsewhere.effects.registry import unknown
from testbed.elsewhere.hooks import Flow, Hooks


@unknown("people walk aft", ("mass",), "mass", (0.04, 0.12), "m")
def walking(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The c.g. moves aft by `size` m between two moments (250 kg over 2 to 5 m), and half of it back."""
    leaves, back = rng.uniform(8.0, 14.0), rng.uniform(24.0, 32.0)

    def mass(f: Flow) -> None:
        moved = 1 / (1 + np.exp(-(f.t - leaves) / 1.2)) - 0.5 / (1 + np.exp(-(f.t - back) / 1.2))
        f.cg_move[0] -= f.on * size * moved

    return Hooks({"aft": size, "leaves_s": leaves, "back_s": back}, mass=mass)


@unknown("a body trails on a cable under the tail", ("pitching_moment", "x_force"), "mass", (25.0, 60.0), "kg")
def towed(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """A towed probe of `size` kg swings under the tail: cable force aft and down there, its angle a pendulum."""
    length, drag_area = rng.uniform(8.0, 14.0), 0.06
    hooks = Hooks({"mass": size, "length": length, "drag_area": drag_area}, states=2)

    def loads(f: Flow) -> None:
        swing = f.x[hooks.slot][0]
        weight, drag = f.on * size * GRAVITY, f.on * f.qbar * drag_area
        aft, down = drag + weight * np.sin(swing), weight * np.cos(swing)
        f.force[0] -= aft
        f.force[2] += down
        f.moment[1] += 7.0 * down - 0.8 * aft
        f.drag_over_weight = f.qbar * drag_area / (size * GRAVITY)

    def memory(f: Flow, own: NDArray) -> NDArray:
        angle, rate = own
        pull = GRAVITY / length * (f.drag_over_weight * np.cos(angle) - np.sin(angle))
        return np.stack([rate, pull - 0.5 * rate - 2.0 * f.rates[1]])

    hooks.loads, hooks.memory = loads, memory
    return hooks
