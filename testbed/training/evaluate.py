"""How well a policy flies: fixed cases, the same for every policy, every time and for the autopilot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.policies.policy import Policy
from icing_env.actions import Mode
from icing_env.scenario import Scenario
from icing_env.world import World
from testbed.environments import loop_factory

CASES = 5_000_000  # first seed of evaluation; comparisons draw from 0 on, training from 10,000,000 on
ERRORS = ("altitude", "airspeed", "heading")


def world_of(scenario: Scenario, n: int, policy: Policy | None, *, observer: bool, protection: bool,
             mode: Mode | None = None) -> World:
    """World for a policy, for actions of a mode, or for the autopilot."""
    boots = protection and scenario.ice_protection == "management"
    loop = loop_factory(observer=observer, management=protection, protection=protection, boots=boots)
    return World(scenario, n, loop, mode=policy.mode if policy else mode, axes=policy.axes if policy else "all")


def fly(world: World, policy: Policy | None, first_seed: int = CASES) -> dict[str, NDArray[np.float64]]:
    """Fly one episode per aircraft; mean reward per step, root mean square errors and losses [n]."""
    world.reset(seeds=[first_seed + i for i in range(world.n)])
    if policy is not None:
        policy.start(world.view.channels, world.n)
    alive = np.ones(world.n, bool)
    total, count = np.zeros(world.n), np.zeros(world.n)
    squares = {name: np.zeros(world.n) for name in ERRORS}
    lost = np.zeros(world.n)
    for _ in range(world.limit):
        if policy is not None:
            world.action[:] = policy.act(world.view.out)
        world.step()
        total += np.where(alive, world.task["reward"], 0.0)
        count += alive
        for name, sum_of in squares.items():
            sum_of += np.where(alive, world.task[f"{name}_error"]**2, 0.0)
        lost[alive & world.terminated] = 1.0
        alive &= ~world.terminated
        if not alive.any():
            break
    errors = {f"{name}_rms": np.sqrt(sum_of/count) for name, sum_of in squares.items()}
    return {"reward": total/world.limit, **errors, "losses": lost}


def evaluate(scenarios: list[Scenario], policy: Policy | None, cases: int, *, observer: bool = True,
             protection: bool = True) -> dict[str, float]:
    """Means over all cases of all scenarios (`cases` of each), and the reward of each scenario by name."""
    flown = []
    for k, scenario in enumerate(scenarios):
        world = world_of(scenario, cases, policy, observer=observer, protection=protection)
        flown.append(fly(world, policy, CASES + 1000*k))
    out = {name: float(np.mean([episode[name] for episode in flown])) for name in flown[0]}
    return out | {f"reward_{k}": float(np.mean(episode["reward"])) for k, episode in enumerate(flown)}
