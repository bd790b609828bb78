"""What a case is before anything happens to it: aircraft, loading, air, instruments, recorder, programme, pilot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere import sensors
from testbed.elsewhere.aircraft import Loading, derivatives
from testbed.elsewhere.programme import Flight, cards


@dataclass
class Setting:
    """Everything about a case but its effects and their sizes. `seed` reproduces all of its noise."""

    seed: int
    centre: str
    aircraft: dict[str, float]
    thrust_factor: float
    offset: float
    programme: list[Flight]
    altitudes: NDArray
    headings: NDArray
    loadings: list[Loading]
    mass: NDArray
    inertia: NDArray
    sigma: float
    rotational: bool
    slow: tuple[str, float]
    faults: dict[str, Any]
    skill: float
    outfit: dict[str, Any]


def draw_setting(rng: np.random.Generator, references: bool, centre: str) -> Setting:
    """One aircraft, its air and its recorder."""
    programme = cards(rng, references)
    n = len(programme)
    loadings = [Loading.with_fuel(f) for f in rng.uniform(0.0, 1.0, 3)]
    told = [loadings[card[3]] for card in programme]
    error = 1.0 + np.clip(rng.standard_normal(5), -2, 2) * [0.004, 0.02, 0.02, 0.02, 0.0]
    sigma = float(rng.choice([0.0, 0.5, 1.5]))
    kind = str(rng.choice(["thermal", "mean_wind"])) if sigma > 0 and rng.random() < 0.25 else "none"
    rate = int(rng.choice([50, 50, 50, 50, 25, 100]))
    outfit = {"rate": rate, "filter_hz": round(min(0.2 * rate, 10.0), 1), "boom": sensors.BOOM,
              "commands": bool(rng.random() < 0.85), "engine": bool(rng.random() < 0.5),
              "satellite": bool(rng.random() < 0.6), "slow_every": int(rng.choice([1, 1, rate // 5]))}
    return Setting(
        seed=int(rng.integers(2**31)), centre=centre, aircraft=derivatives(rng, centre),
        thrust_factor=float(1 + 0.015 * np.clip(rng.standard_normal(), -2, 2)), offset=float(rng.uniform(-8.0, 8.0)),
        programme=programme, altitudes=rng.uniform(1500.0, 2400.0, n), headings=rng.uniform(-2.0, 2.0, n),
        loadings=told, mass=np.array([load.mass for load in told]) * error[0],
        inertia=np.stack([load.inertia for load in told], 1) * error[1:, None], sigma=sigma,
        rotational=bool(rng.random() < 0.5), slow=(kind, float(rng.uniform(0.4, 0.9))),
        faults=sensors.imperfections(rng), skill=float(rng.uniform(0.5, 1.5)), outfit=outfit)
