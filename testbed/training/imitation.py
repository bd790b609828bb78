"""A start for the learner: imitate the autopilot before learning from reward.

Behavioural cloning (Pomerleau, Neural Computation 3, 1991): the mean action is fitted to what the autopilot does in the
same flights. Reward then improves on it; a learner that starts from noise spends most of its steps on not falling over.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.laws.autopilot import default_gains
from icing_env.actions import AILERON, AIRSPEED, BANK, CLIMB_RATE, ELEVATOR, RUDDER, THROTTLE, Mode
from icing_env.atmosphere import G0
from icing_env.world import World

DISTURBED, DISTURBED_TIME = 0.15, 1.0  # surfaces: largest disturbance as a share of full action, and its time [s]
BATCH, RATE, VALUE_WEIGHT = 32, 2e-3, 0.05  # flights in a batch, Adam's rate, share of the value in the loss
STRETCH = 25  # decisions in a row: what a memory is trained through


@dataclass
class Demonstration:
    """Flights of the autopilot.

    Attributes:
        seen: observations [decisions, n, channels].
        action: what a policy would have done [decisions, n, actions].
        reward: mean over the steps of each decision [decisions, n].
    """

    seen: NDArray[np.float32]
    action: NDArray[np.float32]
    reward: NDArray[np.float32]


def demonstrate(world: World, mode: Mode, hold: int, duration: float, seed: int) -> Demonstration:
    """Let the autopilot fly every aircraft's task for `duration` [s]; write down what a policy would have done.

    Args:
        world: flown by the autopilot; for the mode "surfaces" it takes surfaces, and the autopilot's are disturbed on
            their way (Laskey et al., DART, CoRL 2017): a copy must know the way back from where the model never goes.
        mode: what an action means.
        hold: steps for which an action stands.
        duration: of each flight [s].
        seed: of the first aircraft.
    """
    world.reset(seeds=[seed + i for i in range(world.n)])
    seen, action, reward = [], [], []
    noise = Noise(world, hold, seed)
    for _ in range(round(duration/(world.dt*hold))):
        seen.append(world.observation.copy())
        total = np.zeros(world.n)
        disturbance = noise.next()
        for step in range(hold):
            if mode == "surfaces":
                world.loop.steer()
                label = _done(world)
                world.step(np.clip(label + disturbance, -1.0, 1.0))
            else:
                world.step()
                label = _asked(world) if mode == "targets" else np.zeros((world.n, 3), np.float32)
            if step == 0:
                action.append(label)
            total += world.task["reward"]
        reward.append(total/hold)
    return Demonstration(np.array(seen), np.array(action), np.array(reward, np.float32))


class Noise:
    """Slow random disturbances of four controls, from none in the first aircraft to DISTURBED in the last."""

    def __init__(self, world: World, hold: int, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.keep = float(np.exp(-hold*world.dt/DISTURBED_TIME))
        self.size = np.linspace(0.0, DISTURBED, world.n)[:, None]*np.sqrt(1.0 - self.keep**2)
        self.value = np.zeros((world.n, 4), np.float32)

    def next(self) -> NDArray[np.float32]:
        """The disturbance of the next decision [n, 4]."""
        self.value = (self.keep*self.value + self.size*self.rng.standard_normal(self.value.shape)).astype(np.float32)
        return self.value


def _asked(world: World) -> NDArray[np.float32]:
    """What the autopilot's outer loops ask for, before slew limits, as targets [n, 3] (`controllers.laws.guidance`)."""
    law, target, advisory = world.loop.memory()["law"], world.loop.target, world.loop.advisory
    g, m, start = default_gains()[0], world.fleet.measurement, world.task["start_airspeed"]
    climb = np.where(target["pitch_mode"] == 1.0, g["K_altitude"]*(target["altitude"] - law["altitude"]),
                     target["climb_rate"])
    spare = g["K_speed_priority"]*(law["airspeed"] - advisory["airspeed_limit"] - g["airspeed_margin"])
    climb = np.clip(np.minimum(climb, spare), -g["climb_max"], g["climb_max"])
    turn = np.arctan(m["airspeed"]*g["K_heading"]*world.task["heading_error"]/G0)
    bank = np.clip(turn, -g["bank_max"], g["bank_max"])
    columns = [climb/CLIMB_RATE, (target["airspeed"] - start)/AIRSPEED, bank/BANK]
    return np.clip(np.stack(columns, axis=1), -1.0, 1.0).astype(np.float32)


def _done(world: World) -> NDArray[np.float32]:
    """The autopilot's command as surfaces around the trim [n, 4]."""
    command, trim = world.fleet.command, world.trimmed
    columns = [(command["elevator"] - trim["elevator"])/ELEVATOR, (command["aileron"] - trim["aileron"])/AILERON,
               (command["rudder"] - trim["rudder"])/RUDDER, (command["throttle_left"] - trim["throttle_left"])/THROTTLE]
    return np.clip(np.stack(columns, axis=1), -1.0, 1.0).astype(np.float32)


def imitate(model: Any, flights: list[Demonstration], updates: int) -> float:
    """Fit the learner's mean action to the autopilot's and its value to the returns that those flights had.

    A critic that starts from noise would spoil the actor before it has learned what the flights are worth.

    Args:
        model: PPO or recurrent PPO.
        flights: of `demonstrate`.
        updates: steps of gradient descent.

    Returns:
        Root mean square difference from the autopilot's actions that is left.
    """
    import torch

    env = model.env
    seen = torch.from_numpy(np.concatenate([env.features(f.seen.reshape(-1, f.seen.shape[-1])).reshape(
        f.seen.shape) for f in flights], axis=1))
    action = torch.from_numpy(np.concatenate([f.action for f in flights], axis=1))
    worth = torch.from_numpy(np.concatenate([returns(env.shaped(f.reward), model.gamma) for f in flights], axis=1))
    actor, critic = _paths(model.policy)
    optimiser = torch.optim.Adam([p for part in (*actor, *critic) for p in part.parameters()], RATE)
    losses = []
    for _ in range(updates):
        start = int(torch.randint(max(len(seen) - STRETCH, 0) + 1, ()))
        now, rows = slice(start, start + STRETCH), torch.randperm(seen.shape[1])[:BATCH]
        missed = torch.mean((_output(actor, seen[now, rows]) - action[now, rows])**2)
        misjudged = torch.mean((_output(critic, seen[now, rows])[..., 0] - worth[now, rows])**2)
        optimiser.zero_grad()
        (missed + VALUE_WEIGHT*misjudged).backward()
        optimiser.step()
        losses.append(float(missed.detach()))
    return float(np.sqrt(np.mean(losses[-100:])))


def returns(reward: NDArray[np.float32], gamma: float) -> NDArray[np.float32]:
    """Discounted sums of what follows each decision; after the end the mean reward goes on."""
    out = np.empty_like(reward)
    ahead = np.mean(reward, axis=0)/(1.0 - gamma)
    for t in range(len(reward) - 1, -1, -1):
        ahead = reward[t] + gamma*ahead
        out[t] = ahead
    return out


def _paths(policy: Any) -> tuple[list[Any], list[Any]]:
    """Parts of the network between features and mean action, and between features and value."""
    layers = policy.mlp_extractor
    actor, critic = [layers.policy_net, policy.action_net], [layers.value_net, policy.value_net]
    if hasattr(policy, "lstm_actor"):
        return [policy.lstm_actor, *actor], [policy.lstm_critic, *critic]
    return actor, critic


def _output(parts: list[Any], x: Any) -> Any:
    """What the parts make of features [decisions, rows, channels]."""
    for part in parts:
        x = part(x)
        if isinstance(x, tuple):
            x = x[0]
    return x
