"""Instrument effects that are in no list."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter

from testbed.elsewhere.aircraft import GRAVITY
from testbed.elsewhere.effects.registry import unknown
from testbed.elsewhere.hooks import Channels, Hooks


@unknown("fuselage bends under the rate gyro", ("sensor:q",), "sensor", (0.0025, 0.007), "rad s2/m")
def bending(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """A first bending mode, driven by normal acceleration, turns the pitch gyro: rate = slope of `size` times az."""
    omega, zeta = 2 * np.pi * rng.uniform(2.8, 4.5), rng.uniform(0.03, 0.06)

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        pole = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * omega * dt)
        bottom = [1.0, -2 * pole.real, abs(pole) ** 2]
        push = s["az"] - s["az"][..., :1]
        bent = lfilter([sum(bottom)], bottom, push, axis=-1)
        s["q"] += on * size * np.gradient(bent, dt, axis=-1)

    return Hooks({"slope": size, "omega": omega, "zeta": zeta}, sense=sense)


@unknown("propeller vibration aliases into an accelerometer", ("sensor:az",), "sensor", (0.5, 1.3), "m/s2")
def aliasing(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The shaft tone beats with the sampling and shows as a tone of `size` m/s2 that wanders with rpm and power."""
    slow, drift = rng.uniform(0.5, 1.5), rng.uniform(0.1, 0.4)

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        steps = np.arange(s["az"].shape[-1]) * dt
        power = log["power"].sum(0) / 4.0e5
        phase = 2 * np.pi * np.cumsum(slow + drift * np.sin(0.35 * steps) + 0.3 * (power - 1.0), axis=-1) * dt
        tone = size * np.sqrt(np.maximum(power, 0.1)) * np.sin(phase)
        s["az"] += on * tone
        s["ax"] += on * 0.15 * tone

    return Hooks({"amplitude": size, "centre_hz": slow, "drift_hz": drift}, sense=sense)


@unknown("gyro feels acceleration", ("sensor:q",), "sensor", (0.003, 0.008), "rad s/m", either_sign=True)
def g_sensitivity(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The pitch gyro's mass unbalance: it reads `size` times normal acceleration beyond 1 g, and of lateral."""

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        s["q"] += on * size * (s["az"] + GRAVITY + 0.5 * s["ay"])

    return Hooks({"per_m_s2": size}, sense=sense)


@unknown("alpha vane sticks and slips", ("sensor:alpha",), "sensor", (0.010, 0.024), "rad")
def stiction(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Dry friction in the vane's bearing: it stays until the flow is `size` away, then jumps most of the way."""

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        true, held = s["alpha"], s["alpha"][:, 0].copy()
        stuck = np.empty_like(true)
        for k in range(true.shape[1]):
            off = true[:, k] - held
            held = np.where(np.abs(off) > size, true[:, k] - 0.15 * off, held)
            stuck[:, k] = held
        s["alpha"] = np.where(on > 0, stuck, true)

    return Hooks({"break_out": size}, sense=sense)


@unknown("beta vane stands in propeller swirl", ("sensor:beta",), "sensor", (0.25, 0.7), "rad", either_sign=True)
def swirl(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Sideslip reads `size` times the thrust coefficient too much, more at high alpha."""

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        s["beta"] += on * size * log["CT"] * (1.0 + 4.0 * log["alpha"])

    return Hooks({"per_CT": size}, sense=sense)


@unknown("vertical gyro erects to the apparent vertical", ("sensor:phi", "sensor:theta"), "sensor", (0.015, 0.05),
         "1/s")
def erection(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """The attitude platform creeps at `size` 1/s towards the direction of specific force: wrong in turns and surges."""

    def sense(s: Channels, log: Channels, on: NDArray, dt: float) -> None:
        side = np.arctan2(-s["ay"], -s["az"])
        nose = np.arctan2(s["ax"], -s["az"])
        top, bottom = butter(1, 1.0, fs=1 / dt)
        pole = np.exp(-size * dt)
        for name, apparent in (("phi", side), ("theta", nose)):
            pull = lfilter(top, bottom, apparent - s[name], axis=-1)
            s[name] = s[name] + on * lfilter([1 - pole], [1, -pole], pull, axis=-1)

    return Hooks({"erection_rate": size}, sense=sense)
