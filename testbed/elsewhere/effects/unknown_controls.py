"""Effects in the control runs that are in no list."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.effects.registry import unknown
from testbed.elsewhere.hooks import Flow, Hooks


@unknown("elevator cables stretch with hinge load", ("elevator_path",), "actuator", (0.10, 0.28), "1")
def stretch(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Between pick-up (at the quadrant) and surface the cables give way to the hinge moment of deflection and alpha.

    `size` is the fraction of deflection lost at 2500 Pa; alpha counts half as much, and the stretch stiffens.
    """

    def surface(f: Flow) -> None:
        load = f.qbar / 2500.0 * (f.surfaces[0] + 0.5 * (f.alpha - 0.4 * f.surfaces[0]) + 0.01)
        give = size * load / (1.0 + np.abs(load) / 0.12)
        f.surfaces[0] -= f.on * give

    return Hooks({"fraction_at_2500_Pa": size}, surface=surface)


@unknown("rudder and aileron are tied by a spring", ("rudder_path",), "actuator", (0.12, 0.30), "1", either_sign=True)
def interconnect(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The rudder surface moves by `size` times the aileron, beyond its pick-up, through a small preload."""
    preload = np.radians(rng.uniform(0.2, 0.6))

    def surface(f: Flow) -> None:
        pull = f.surfaces[1] - preload * np.tanh(f.surfaces[1] / preload)
        f.surfaces[2] += f.on * size * pull

    return Hooks({"ratio": size, "preload": preload}, surface=surface)


@unknown("elevator tab buzzes in a limit cycle", ("elevator_path",), "actuator", (0.012, 0.030), "rad")
def buzz(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Above 1500 Pa the elevator trembles `size` rad about its pick-up at 2.5 to 4 Hz (van der Pol)."""
    omega = 2 * np.pi * rng.uniform(2.5, 4.0)
    hooks = Hooks({"amplitude": size, "omega": omega}, states=2)

    def memory(f: Flow, own: NDArray) -> NDArray:
        y, rate = own
        drive = np.where(f.qbar > 1500.0, 0.6, -0.6)
        kick = 0.5 * omega * f.rates[1]
        return np.stack([rate, (drive - 2.4 * y**2) * omega * rate - omega**2 * y + kick + 0.02 * omega])

    def surface(f: Flow) -> None:
        f.surfaces[0] += f.on * size * f.x[hooks.slot][0]

    hooks.memory, hooks.surface = memory, surface
    return hooks


@unknown("one aileron hinge binds at large deflection", ("aileron_path",), "actuator", (0.25, 0.55), "1")
def binding(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Trailing edge down on one side the aileron stops following: beyond `knee` the fraction `size` is lost."""
    knee, side = np.radians(rng.uniform(0.8, 1.8)), rng.choice([-1.0, 1.0])

    def surface(f: Flow) -> None:
        beyond = np.maximum(side * f.surfaces[1] - knee, 0.0)
        f.surfaces[1] -= f.on * side * size * beyond

    return Hooks({"lost": size, "knee": knee, "side": side}, surface=surface)
