"""Library effects of mass, balance and inertia (numbers 25, 26, 27, 28 of the list in docs/elsewhere.md)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.effects.registry import known
from testbed.elsewhere.hooks import Flow, Hooks


@known("CG shift", 25, ("mass",), "mass", (0.04, 0.14), "m", either_sign=True)
def cg(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The c.g. lies `size` m ahead of where it is thought; forces keep their line of action."""

    def mass(f: Flow) -> None:
        f.cg_move[0] += f.on * size

    return Hooks({"forward": size}, mass=mass)


@known("Mass error/ice mass", 26, ("mass",), "mass", (0.06, 0.14), "1", either_sign=True)
def heavy(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Mass is 1 + `size` times what is told, inertia 1 + half of it."""

    def mass(f: Flow) -> None:
        f.mass = f.mass * (1.0 + f.on * size)
        f.inertia = f.inertia * (1.0 + 0.5 * f.on * size)

    return Hooks({"factor": 1.0 + size}, mass=mass)


@known("Inertia errors", 27, ("mass",), "mass", (0.20, 0.40), "1", either_sign=True)
def inertia(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Iyy is 1 + `size` times what is told; Ixx and Izz err by other parts of it."""
    roll, yaw = rng.uniform(-0.8, 1.0, 2)
    factor = np.array([roll, 1.0, yaw, 0.0])[:, None]

    def mass(f: Flow) -> None:
        f.inertia = f.inertia * (1.0 + f.on * size * factor)

    return Hooks({"Iyy": 1 + size, "Ixx": 1 + size * roll, "Izz": 1 + size * yaw}, mass=mass)


@known("Fuel slosh", 28, ("mass", "rolling_moment", "y_force"), "mass", (350.0, 800.0), "kg", other_form=True)
def slosh(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """A mass of `size` kg on a lateral spring in the belly tanks, 0.9 m under the c.g. (no pendulum).

    The mass is already in the told mass, so only what differs from a rigid load acts: its spring force less its share
    of the specific force, and its weight at the displaced place. Travel is limited smoothly to the tank's half width.
    """
    omega, zeta, depth, half = rng.uniform(2.2, 4.2), rng.uniform(0.03, 0.08), 0.9, 0.6
    hooks = Hooks({"mass": size, "omega": omega, "zeta": zeta}, states=2)

    def loads(f: Flow) -> None:
        y, rate = f.x[hooks.slot]
        side, down = f.force[1] / f.mass, f.force[2] / f.mass
        push = f.on * size * (omega**2 * y + 2.0 * zeta * omega * rate + side)
        f.force[1] += push
        f.moment[0] -= depth * push + f.on * size * half * np.tanh(y / half) * down
        f.specific_side = side

    def memory(f: Flow, own: NDArray) -> NDArray:
        y, rate = own
        return np.stack([rate, -(omega**2) * y - 2.0 * zeta * omega * rate - f.specific_side])

    hooks.loads, hooks.memory = loads, memory
    return hooks
