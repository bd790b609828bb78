"""Level, straight, unaccelerated flight of the aircraft without effects, in still air."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from testbed.elsewhere.atmosphere import atmosphere
from testbed.elsewhere.plant import BASE, Plant
from testbed.elsewhere.propulsion import power_demand
from testbed.elsewhere.rigid_body import quaternion


def level(plant: Plant, column: int, speed: float, altitude: float, heading: float
          ) -> tuple[NDArray, NDArray, float]:
    """State (15,), surface positions (3,) and throttle that hold `speed` m/s at `altitude` m on `heading` rad.

    Raises:
        ValueError: there is no such flight.
    """
    d = {name: np.atleast_1d(value)[column % np.size(value)] for name, value in plant.d.items()}
    factor = np.atleast_1d(plant.thrust_factor)[column % np.size(plant.thrust_factor)]
    bare = Plant(d, plant.mass[[column]], plant.inertia[:, [column]], np.zeros(1), thrust_factor=factor,
                 offset=plant.offset)
    pressure = atmosphere(altitude)[1]
    still = (np.zeros((6, 1)), np.zeros((3, 1)))

    def state(alpha: float, throttle: float) -> NDArray:
        x = np.zeros((BASE, 1))
        x[0], x[2], x[12] = speed * np.cos(alpha), speed * np.sin(alpha), -altitude
        x[6:10] = quaternion(np.zeros(1), np.full(1, alpha), np.full(1, heading))
        x[13:15] = power_demand(throttle, pressure)
        return x

    def unbalance(z: NDArray) -> NDArray:
        alpha, elevator, throttle = z
        position = np.array([[elevator], [0.0], [0.0]])
        rate, _ = bare.rates(0.0, state(alpha, throttle), position, np.full((2, 1), throttle), *still)
        return rate[[0, 2, 4], 0]

    found = root(unbalance, [0.03, 0.0, 0.5], tol=1e-10)
    if np.abs(unbalance(found.x)).max() > 1e-8:
        raise ValueError(f"no level trim at {speed:.1f} m/s: {found.message}")
    alpha, elevator, throttle = found.x
    return state(alpha, throttle)[:, 0], np.array([elevator, 0.0, 0.0]), float(throttle)
