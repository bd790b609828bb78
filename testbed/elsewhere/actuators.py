"""Surface servos: a first-order lag and a rate limit between the pilot's command and the surface (all in rad)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LAG = 0.05  # s
RATE = np.radians(60.0)  # rad/s
# Elevator, aileron, rudder: JSBSim aircraft/DHC6.
LIMIT = np.radians([[-26.0, -16.0, -16.0], [14.0, 18.0, 16.0]])


def advance(position: NDArray, demand: NDArray, dt: float) -> NDArray:
    """Position (3, n) of elevator, aileron, rudder after `dt` seconds of constant `demand`."""
    step = (demand - position) * (1.0 - np.exp(-dt / LAG))
    moved = position + np.clip(step, -RATE * dt, RATE * dt)
    return np.asarray(np.clip(moved, LIMIT[0][:, None], LIMIT[1][:, None]))
