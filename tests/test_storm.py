"""Everything at once: every scenario, every effect at the ends of its range, random actions, a big batch."""

from __future__ import annotations

import numpy as np
import pytest

from icing_env import scenario as scenarios
from icing_env.effects import LIBRARY
from icing_env.world import World
from testbed.environments import loop_factory

N = 1024


def storm(name: str, steps: int, seed: int) -> None:
    """Fly a batch at random and hold every step to bounds and finiteness."""
    spread = {"parameters": {"turbulence_sigma_w": {"low": 0.0, "high": 5.0}}}
    world = World(scenarios.load(name, randomise=spread), N, loop_factory(), mode="surfaces", threads=2)
    rng = np.random.default_rng(seed)
    effects = list(LIBRARY.values())

    def afflict(rows: np.ndarray) -> None:
        for i in rows:
            effect, end = effects[i % len(effects)], "low" if i//len(effects) % 2 else "high"
            effect.apply(world.fleet.parameters[i:i + 1], {p.name: getattr(p, end) for p in effect.parameters})

    world.reset(seeds=range(seed, seed + N))
    afflict(np.arange(N))
    low, high = world.view.low, world.view.high
    for _ in range(steps):
        world.step(rng.uniform(-1.0, 1.0, world.action.shape))
        assert (world.observation >= low).all() and (world.observation <= high).all()
        assert np.isfinite(world.task["reward"]).all()
        over = np.flatnonzero(world.terminated | world.truncated)
        flying = np.setdiff1d(np.arange(N), over)
        for field in world.fleet.measurement.dtype.names or ():
            assert np.isfinite(world.fleet.measurement[field][flying]).all(), field
        for field in world.loop.estimate.dtype.names or ():
            assert np.isfinite(world.loop.estimate[field][flying]).all(), field
        if len(over):
            world.reset(over)
            afflict(over)


@pytest.mark.parametrize("name", ["clear_air", "large_drops"])
def test_a_storm_of_random_actions_stays_within_bounds(name: str) -> None:
    storm(name, 100, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("name", scenarios.names())
def test_a_thousand_steps_of_every_scenario_stay_within_bounds(name: str) -> None:
    storm(name, 1000, seed=2)
