"""Aerodynamic effects that are in no list: flow that separates, steps or sticks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.aircraft import SPAN
from testbed.elsewhere.effects.registry import unknown
from testbed.elsewhere.hooks import Flow, Hooks


@unknown("roller door opens in flight", ("yawing_moment", "x_force"), "aerodynamics", (0.0012, 0.0040), "1")
def door(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """From `opens` s on, within 2 s: Cn by `size` towards the door side (left), drag 1.5 `size`, some side force."""
    opens = rng.uniform(10.0, 24.0)

    def coefficients(f: Flow) -> None:
        part = f.on * size / (1.0 + np.exp(-(f.t - opens) / 0.4))
        f.C[5] -= part
        f.C[0] -= 1.5 * part
        f.C[1] += 2.0 * part

    return Hooks({"dCn": -size, "opens_s": opens}, coefficients=coefficients)


@unknown("afterbody separation with hysteresis in sideslip", ("yawing_moment",), "aerodynamics", (0.0010, 0.0030), "1")
def afterbody(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """A bistable wake: Cn is pushed by `size` to the side last sideslipped to beyond `edge`, and stays (slow state)."""
    edge, quick = np.radians(rng.uniform(1.0, 2.0)), 0.25
    hooks = Hooks({"dCn": size, "edge": edge}, states=1)

    def memory(f: Flow, own: NDArray) -> NDArray:
        return (own - own**3 + 1.2 * f.beta / edge) / quick

    def coefficients(f: Flow) -> None:
        f.C[5] -= f.on * size * np.tanh(f.x[hooks.slot][0])

    hooks.memory, hooks.coefficients = memory, coefficients
    return hooks


@unknown("ice sheds from one wing half-way", ("rolling_moment", "x_force"), "aerodynamics", (0.0012, 0.0035), "1",
         either_sign=True)
def shedding(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Both wings lightly iced (drag, some lift lost); at `sheds` s one side clears within half a second."""
    sheds = rng.uniform(14.0, 24.0)

    def coefficients(f: Flow) -> None:
        gone = 1.0 / (1.0 + np.exp(-(f.t - sheds) / 0.15))
        left = f.on * abs(size) * (1.0 - 0.5 * gone)
        f.C[0] -= 4.0 * left
        f.C[2] += 6.0 * left * f.alpha / 0.05
        f.C[3] += f.on * size * gone * (0.6 + f.alpha / 0.08)
        f.C[5] += f.on * size * gone * 0.3

    return Hooks({"dCl": size, "sheds_s": sheds}, coefficients=coefficients)


@unknown("roll due to yaw and sideslip grows with lift", ("rolling_moment",), "aerodynamics", (1.2, 3.0), "1")
def lift_roll(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Cl_r gains 0.25 `size` and Cl_beta -0.06 `size` times the lift coefficient above 0.5."""

    def coefficients(f: Flow) -> None:
        extra = f.on * size * (-f.C[2] - 0.5)
        f.C[3] += extra * (0.25 * f.relative[2] * SPAN / (2.0 * f.speed) - 0.06 * f.beta)

    return Hooks({"strength": size}, coefficients=coefficients)


@unknown("vortex touches the tailplane in a band of alpha", ("pitching_moment",), "aerodynamics", (0.012, 0.03), "1",
         either_sign=True)
def band(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """A hump of Cm of height `size` about one angle of attack, a degree wide."""
    middle, width = np.radians(rng.uniform(2.0, 3.5)), np.radians(rng.uniform(0.7, 1.2))

    def coefficients(f: Flow) -> None:
        f.C[4] += f.on * size * np.exp(-(((f.alpha - middle) / width) ** 2))

    return Hooks({"dCm": size, "middle": middle, "width": width}, coefficients=coefficients)


@unknown("panel flutter bursts add drag above a dynamic pressure", ("x_force",), "aerodynamics", (0.006, 0.018), "1")
def panel(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Above an onset in dynamic pressure a fairing stands up, worse in sideslip: drag `size` and side force."""
    onset = rng.uniform(1750.0, 2150.0)

    def coefficients(f: Flow) -> None:
        up = f.on * size / (1.0 + np.exp(-(f.qbar - onset) / 60.0))
        f.C[0] -= up * (1.0 + np.minimum(np.abs(f.beta) / 0.05, 2.0))
        f.C[1] -= up * f.beta / 0.05

    return Hooks({"dCD": size, "onset_Pa": onset}, coefficients=coefficients)
