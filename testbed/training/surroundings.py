"""The aircraft that a learner flies: batches of several scenarios side by side, seen through fixed features."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

from controllers.policies.network import features
from icing_env.observation import Channel
from testbed.sb3 import TwinOtterVecEnv

SEEDS = 10_000_000  # training episodes; comparisons draw from 0 on, evaluation from 5,000,000 on
FEATURE_MAX = 20.0


class Fleets(VecEnv):
    """Batches of aircraft as one vector environment.

    Args:
        parts: the batches; all with the same spaces.
        centre, per_scale: of the features [channels].
        reward_scale: factor of every reward.
        root: a reward 1 - P becomes 1 - sqrt(P): the penalties P are weighted squares of errors, and their root counts
            small errors beside large ones.
    """

    def __init__(self, parts: list[TwinOtterVecEnv], centre: NDArray[Any], per_scale: NDArray[Any],
                 reward_scale: float, root: bool = False) -> None:
        from gymnasium.spaces import Box

        self.render_mode = None
        self.parts, self.centre, self.per_scale = parts, centre, per_scale
        self.reward_scale, self.root = reward_scale, root
        self.bounds = np.cumsum([0, *(part.num_envs for part in parts)])
        shape = parts[0].observation_space.shape
        super().__init__(int(self.bounds[-1]), Box(-FEATURE_MAX, FEATURE_MAX, shape, np.float32), parts[0].action_space)

    def features(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        """What the network gets of observations [n, channels]."""
        out = np.empty_like(seen)
        features(seen, self.centre, self.per_scale, out)
        return out

    def begin(self, seed: int) -> NDArray[np.float32]:
        """First episodes of a training seed."""
        for k, part in enumerate(self.parts):
            part.seed(SEEDS + 10_000*seed + int(self.bounds[k]))
        return self.reset()

    def reset(self) -> NDArray[np.float32]:
        """Begin new episodes everywhere."""
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return self.features(np.concatenate([part.reset() for part in self.parts]))

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep the actions for `step_wait`."""
        for part, own in zip(self.parts, np.split(actions, self.bounds[1:-1]), strict=True):
            part.step_async(own)

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Features, scaled reward, done and info of every aircraft."""
        steps = [part.step_wait() for part in self.parts]
        infos = [info for step in steps for info in step[3]]
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = self.features(info["terminal_observation"][None])[0]
        return (self.features(np.concatenate([step[0] for step in steps])),
                self.shaped(np.concatenate([step[1] for step in steps])),
                np.concatenate([step[2] for step in steps]), infos)

    def shaped(self, reward: NDArray[Any]) -> NDArray[np.float32]:
        """Rewards as the learner gets them."""
        if self.root:
            reward = 1.0 - np.sqrt(np.maximum(1.0 - reward, 0.0))
        return (self.reward_scale*reward).astype(np.float32)

    def save(self) -> dict[str, NDArray[Any]]:
        """Everything that decides how the flights go on (arrays)."""
        return {f"{k}.{name}": array for k, part in enumerate(self.parts) for name, array in part.save().items()}

    def restore(self, saved: dict[str, NDArray[Any]]) -> None:
        """Go on from a `save`; raises InputError if it does not fit."""
        for k, part in enumerate(self.parts):
            start = f"{k}."
            part.restore({name[len(start):]: array for name, array in saved.items() if name.startswith(start)})

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of this environment, once per aircraft."""
        return [getattr(self, attr_name)]*self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of this environment."""
        setattr(self, attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices: VecEnvIndices = None,
                   **method_kwargs: Any) -> list[Any]:
        """Call a method once; its answer stands for every aircraft."""
        return [getattr(self, method_name)(*method_args, **method_kwargs)]*self.num_envs

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """No aircraft is wrapped."""
        return [False]*self.num_envs


def divided(total: int, shares: list[float]) -> list[int]:
    """`total` aircraft in whole numbers as near to the shares as can be, one at least."""
    exact = np.array(shares)*total/sum(shares)
    counts = np.maximum(np.floor(exact).astype(int), 1)
    while counts.sum() < total:
        counts[np.argmax(exact - counts)] += 1
    while counts.sum() > total:
        counts[np.argmax(counts)] -= 1
    return counts.tolist()


def scales(seen: NDArray[np.float32], channels: tuple[Channel, ...]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Centre and 1/scale of the features, from observations [samples, channels] of the autopilot's flights.

    A channel that hardly moves there gets a tenth of its range, so that it does not shout when it moves elsewhere.
    """
    span = np.array([c.high - c.low for c in channels])
    spread = np.std(seen.astype(float), axis=0)
    scale = np.where(spread > 2e-4*span, np.maximum(spread, 1e-3*span), 0.1*span)
    return np.mean(seen.astype(float), axis=0).astype(np.float32), (1.0/scale).astype(np.float32)
