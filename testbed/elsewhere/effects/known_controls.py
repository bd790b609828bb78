"""Library effects in the control paths (numbers 30, 31, 32, 34 of the list in docs/elsewhere.md)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.effects.registry import known
from testbed.elsewhere.hooks import Flow, Hooks


@known("Lag", 30, ("elevator_path",), "actuator", (0.12, 0.30), "s", other_form=True)
def lag(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The elevator follows through an extra second-order system whose delay at low frequency is `size` s."""
    zeta = rng.uniform(0.6, 0.9)
    omega = 2.0 * zeta / size
    memory: dict[str, tuple[NDArray, NDArray]] = {}

    def command(demand: NDArray, on: NDArray, dt: float) -> NDArray:
        y, rate = memory.get("state", (demand[0], np.zeros_like(on)))
        rate = rate + dt * (omega**2 * (demand[0] - y) - 2.0 * zeta * omega * rate)
        y = y + dt * rate
        memory["state"] = (y, rate)
        out = demand.copy()
        out[0] = np.where(on > 0, y, demand[0])
        return out

    return Hooks({"equivalent_lag": size, "omega": omega, "zeta": zeta}, command=command, by_command=True)


@known("Transport delay", 31, ("rudder_path",), "actuator", (0.12, 0.35), "s")
def delay(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The rudder does what was asked `size` s ago."""
    queue: list[NDArray] = []

    def command(demand: NDArray, on: NDArray, dt: float) -> NDArray:
        queue.append(demand[2].copy())
        old = queue.pop(0) if len(queue) > round(size / dt) else queue[0]
        out = demand.copy()
        out[2] = np.where(on > 0, old, demand[2])
        return out

    return Hooks({"delay": size}, command=command, by_command=True)


@known("Deadband/backlash", 32, ("aileron_path",), "actuator", (0.020, 0.045), "rad", other_form=True)
def backlash(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """True play with memory, `size` rad wide in all, between wheel and aileron (no dead zone about zero)."""
    memory: dict[str, NDArray] = {}

    def command(demand: NDArray, on: NDArray, dt: float) -> NDArray:
        held = memory.get("held", demand[1])
        held = np.clip(held, demand[1] - size / 2, demand[1] + size / 2)
        memory["held"] = held
        out = demand.copy()
        out[1] = np.where(on > 0, held, demand[1])
        return out

    return Hooks({"width": size}, command=command, by_command=True)


@known("Gearing", 34, ("elevator_path",), "actuator", (0.12, 0.28), "1", either_sign=True)
def gearing(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The elevator moves 1 + `size` times what its position pick-up says."""

    def surface(f: Flow) -> None:
        f.surfaces[0] *= 1.0 + f.on * size

    return Hooks({"factor": 1.0 + size}, surface=surface)
