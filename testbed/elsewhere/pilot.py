"""A pilot: flies the plan, holds attitude with a delay, adds remnant, and trims before the record starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from testbed.elsewhere.hooks import Flow
from testbed.elsewhere.manoeuvres import Plan
from testbed.elsewhere.rigid_body import euler

DELAY = 0.22  # s, from attitude seen to hand moving
NEUROMUSCULAR = 0.10  # s, first-order
HOLD = {"theta": 0.45, "q": 0.12, "phi": 0.35, "p": 0.10}  # rad per rad and rad per rad/s
TRIM_RATE = {"elevator": 0.10, "aileron": 0.12, "rudder": 0.010, "throttle": 0.012}
REMNANT = np.radians([0.06, 0.12, 0.06])[:, None, None]  # rms of elevator, aileron, rudder


def remnant(flights: int, steps: int, dt: float, skill: float, rng: np.random.Generator) -> NDArray:
    """The pilot's own noise (3, flights, steps) in rad, first-order with a break at 0.7 Hz."""
    pole = np.exp(-2 * np.pi * 0.7 * dt)
    white = rng.standard_normal((3, flights, steps)) * np.sqrt(1 - pole**2)
    return skill * REMNANT * lfilter([1.0], [1.0, -pole], white)


class Pilot:
    """One pilot a flight (column); commands are surface demands in rad and throttle 0..1."""

    def __init__(self, plans: Sequence[Plan], surfaces: NDArray, throttle: NDArray, state: NDArray, dt: float,
                 skill: float, rng: np.random.Generator) -> None:
        """`surfaces` (3, n), `throttle` (n,) and `state` are the trim; `skill` scales the imperfections."""
        self.surface = np.stack([p.surface for p in plans], axis=1)
        self.power = np.stack([p.throttle for p in plans], axis=1)
        self.phi, self.theta, self.grip = (np.stack([getattr(p, k) for p in plans]) for k in ("phi", "theta", "grip"))
        self.time, self.dt = plans[0].time, dt
        self.noise = remnant(len(plans), self.time.size, dt, skill, rng)
        self.trim, self.lever = surfaces.copy(), np.stack([throttle, throttle])
        self.hand = np.zeros_like(surfaces)
        phi, theta, _ = euler(state[6:10])
        self.reference, self.speed = theta, np.sqrt((state[:3] ** 2).sum(0))
        self.seen = [np.stack([phi, theta, *state[3:5]])] * round(DELAY / dt)

    def _retrim(self, theta: NDArray, phi: NDArray, flow: Flow, climb: NDArray) -> None:
        """Before time zero: wheel, rudder trim and throttle take out what is steady."""
        dt = self.dt
        self.reference = self.reference - 0.004 * dt * climb
        self.trim[0] += TRIM_RATE["elevator"] * dt * (theta - self.reference)
        self.trim[1] += TRIM_RATE["aileron"] * dt * phi
        self.trim[2] += TRIM_RATE["rudder"] * dt * flow.specific[1, : phi.size]
        self.lever = np.clip(self.lever + TRIM_RATE["throttle"] * dt * (self.speed - flow.speed[: phi.size]), 0.05, 1.0)

    def act(self, k: int, x: NDArray, flow: Flow | None) -> tuple[NDArray, NDArray]:
        """Command (3, n) and throttle (2, n) at step `k` from the state and the flow (None at the first step)."""
        phi, theta, _ = euler(x[6:10])
        if flow is not None and self.time[k] < 0.0:
            self._retrim(theta, phi, flow, -flow.climb[: phi.size])
        self.seen.append(np.stack([phi, theta, x[3], x[4]]))
        seen = self.seen.pop(0)
        grip = self.grip[:, k]
        hold = np.stack([
            grip * (HOLD["theta"] * (seen[1] - self.reference - self.theta[:, k]) + HOLD["q"] * seen[3]),
            grip * (HOLD["phi"] * (seen[0] - self.phi[:, k]) + HOLD["p"] * seen[2]),
            np.zeros_like(phi),
        ])
        wanted = hold + self.surface[:, :, k] + self.noise[:, :, k]
        self.hand = self.hand + (wanted - self.hand) * (1 - np.exp(-self.dt / NEUROMUSCULAR))
        return self.trim + self.hand, np.clip(self.lever + self.power[:, :, k], 0.02, 1.0)
