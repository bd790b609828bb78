"""Library effects in the instruments (numbers 36, 39, 41, 43 of the list in docs/elsewhere.md)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.effects.registry import known
from testbed.elsewhere.hooks import Channels, Hooks
from testbed.elsewhere.sensors import late


@known("α-vane bias, scale/upwash, lag", 36, ("sensor:alpha",), "sensor", (0.10, 0.25), "1", either_sign=True)
def vane(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Alpha reads (1 + `size`) alpha + a bias of up to 1 deg."""
    bias = np.radians(rng.uniform(-1.0, 1.0))

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        s["alpha"] += on * (size * s["alpha"] + bias)

    return Hooks({"scale": 1.0 + size, "bias": bias}, sense=sense)


@known("Gyro bias/scale/misalign", 39, ("sensor:p",), "sensor", (0.06, 0.15), "1", either_sign=True)
def gyro(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The roll gyro reads (1 + `size`) p and, being askew, `size` / 2 of r."""

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        s["p"] += on * size * (s["p"] + 0.5 * s["r"])

    return Hooks({"scale": 1.0 + size, "into_yaw": 0.5 * size}, sense=sense)


@known("Pitot position error / blockage", 41, ("sensor:airspeed",), "sensor", (0.08, 0.20), "1", either_sign=True,
       other_form=True)
def pitot(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The pressure difference errs by `size` (0.5 + alpha / 6 deg) of itself, so airspeed by its square root."""

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        error = size * (0.5 + log["alpha"] / np.radians(6.0))
        s["airspeed"] *= 1.0 + on * (np.sqrt(np.maximum(1.0 + error, 0.2)) - 1.0)

    return Hooks({"pressure_error": size}, sense=sense)


@known("Time skew between channels", 43, ("sensor:alpha", "sensor:beta", "sensor:airspeed"), "sensor",
       (0.12, 0.30), "s")
def skew(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Airspeed, alpha and beta are stamped `size` s late."""

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        for name in ("airspeed", "alpha", "beta"):
            s[name] += on * (late(s[name], size, dt) - s[name])

    return Hooks({"skew": size}, sense=sense)
