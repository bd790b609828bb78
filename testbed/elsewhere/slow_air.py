"""Slow air: a weak thermal or a change of the mean wind, much slower than the short period and the Dutch roll."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def slow_wind(time: NDArray, kind: str, strength: float, heading: float, rng: np.random.Generator) -> NDArray:
    """Wind (3, n) in north, east, down m/s at `time` in s: `kind` is none, thermal or mean_wind."""
    wind = np.zeros((3, time.size))
    if kind == "thermal":
        centre, width = rng.uniform(10.0, 30.0), rng.uniform(7.0, 12.0)
        wind[2] = -strength * np.exp(-(((time - centre) / width) ** 2))
    elif kind == "mean_wind":
        start, angle = rng.uniform(5.0, 20.0), heading + rng.uniform(-1.0, 1.0)
        ramp = 0.5 * (1.0 + np.tanh((time - start) / 8.0))
        wind[0], wind[1] = strength * ramp * np.cos(angle), strength * ramp * np.sin(angle)
    return wind
