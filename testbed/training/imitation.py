"""A start for the learner: imitate the autopilot before learning from reward.

Behavioural cloning (Pomerleau, Neural Computation 3, 1991): the mean action is fitted to what the autopilot does in the
same flights. Reward then improves on it; a learner that starts from noise spends most of its steps on not falling over.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.actions import AILERON, AIRSPEED, BANK, CLIMB_RATE, ELEVATOR, RUDDER, THROTTLE, Mode
from icing_env.world import World

BATCH, RATE = 32, 2e-3  # flights in a batch, Adam's rate
STRETCH = 25  # decisions in a row: what a memory is trained through


@dataclass
class Demonstration:
    """Flights of the autopilot: observations [decisions, n, channels] and its actions [decisions, n, actions]."""

    seen: NDArray[np.float32]
    action: NDArray[np.float32]


def demonstrate(world: World, mode: Mode, hold: int, duration: float, seed: int) -> Demonstration:
    """Let the autopilot fly every aircraft's task for `duration` [s]; write down what a policy would have done."""
    world.reset(seeds=[seed + i for i in range(world.n)])
    seen, action = [], []
    for step in range(round(duration/world.dt)):
        before = world.observation.copy() if step % hold == 0 else None
        world.step()
        if before is not None:
            seen.append(before)
            action.append(_done(world, mode))
    return Demonstration(np.array(seen), np.array(action))


def _done(world: World, mode: Mode) -> NDArray[np.float32]:
    """The autopilot's last step as an action of a mode [n, actions]."""
    command, trim, law, target = world.fleet.command, world.trimmed, world.loop.memory()["law"], world.loop.target
    if mode == "surfaces":
        columns = [(command["elevator"] - trim["elevator"])/ELEVATOR, (command["aileron"] - trim["aileron"])/AILERON,
                   (command["rudder"] - trim["rudder"])/RUDDER,
                   (command["throttle_left"] - trim["throttle_left"])/THROTTLE]
    elif mode == "targets":
        columns = [law["climb_command"]/CLIMB_RATE, (target["airspeed"] - world.task["start_airspeed"])/AIRSPEED,
                   law["bank_command"]/BANK]
    else:
        columns = [np.zeros(world.n)]*3
    return np.clip(np.stack(columns, axis=1), -1.0, 1.0).astype(np.float32)


def imitate(model: Any, flights: list[Demonstration], epochs: int) -> float:
    """Fit the learner's mean action to the demonstrations; returns the root mean square difference that is left."""
    import torch

    seen = torch.from_numpy(np.concatenate([model.env.features(f.seen.reshape(-1, f.seen.shape[-1])).reshape(
        f.seen.shape) for f in flights], axis=1))
    action = torch.from_numpy(np.concatenate([f.action for f in flights], axis=1))
    parts = _path(model.policy)
    optimiser = torch.optim.Adam([p for part in parts for p in part.parameters()], RATE)
    starts = range(0, len(seen) - STRETCH + 1, STRETCH)
    loss = torch.zeros(())
    for _ in range(epochs):
        losses = []
        for start in np.random.permutation(starts):  # noqa: NPY002 (the one generator of the learner)
            rows = torch.randperm(seen.shape[1])[:BATCH]
            optimiser.zero_grad()
            loss = torch.mean((_mean(parts, seen[start:start + STRETCH, rows])
                               - action[start:start + STRETCH, rows])**2)
            loss.backward()
            optimiser.step()
            losses.append(float(loss))
    return float(np.sqrt(np.mean(losses)))


def _path(policy: Any) -> list[Any]:
    """Parts of the network between features and mean action."""
    memory = [policy.lstm_actor] if hasattr(policy, "lstm_actor") else []
    return [*memory, policy.mlp_extractor.policy_net, policy.action_net]


def _mean(parts: list[Any], x: Any) -> Any:
    """Mean actions of features [decisions, rows, channels]."""
    for part in parts:
        x = part(x)
        if isinstance(x, tuple):
            x = x[0]
    return x
