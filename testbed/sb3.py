"""The batch as a Stable-Baselines3 `VecEnv`: no process and no copy per aircraft.

Stable-Baselines3 wants a row reset in the step that ends it (SAME_STEP), with the last observation in its info.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

from icing_env.tasks import REASONS
from testbed.environments import make_vector


class TwinOtterVecEnv(VecEnv):
    """`num_envs` aircraft for Stable-Baselines3. Options: those of `testbed.environments.make_vector`."""

    def __init__(self, num_envs: int, **options: Any) -> None:
        self.batch = make_vector(num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        self.render_mode = self.batch.render_mode
        self._actions: NDArray[np.float32] = np.zeros((num_envs, *(self.batch.single_action_space.shape or ())),
                                                      np.float32)
        super().__init__(num_envs, self.batch.single_observation_space, self.batch.single_action_space)

    def reset(self) -> NDArray[np.float32]:
        """Begin new episodes everywhere; the seeds of `seed()` are used once."""
        seeds: list[int | None] = [s for s in self._seeds if s is not None]
        observation, _ = self.batch.reset(seed=seeds if len(seeds) == self.num_envs else None)
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Observation, reward, done and one info per aircraft, as Stable-Baselines3 lays them out."""
        observation, reward, terminated, truncated, info = self.batch.step(self._actions)
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(done):
            infos[i] = {
                "terminal_observation": info["final_obs"][i],
                "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
                "reason": REASONS[int(info["reason"][i])],
                "reward_terms": {k: float(v[i]) for k, v in info["reward_terms"].items() if k[0] != "_"},
            }
        return observation, reward.astype(np.float32), done, infos

    def close(self) -> None:
        """Nothing is open."""
        self.batch.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of the batch, once per aircraft."""
        return [getattr(self.batch, attr_name)]*len(self._rows(indices))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the batch; it is one for all, so `indices` must not pick some."""
        if len(self._rows(indices)) != self.num_envs:
            raise ValueError("attributes belong to the whole batch: leave indices out")
        setattr(self.batch, attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices: VecEnvIndices = None,
                   **method_kwargs: Any) -> list[Any]:
        """Call a method of the batch once; its answer stands for every aircraft asked for."""
        return [getattr(self.batch, method_name)(*method_args, **method_kwargs)]*len(self._rows(indices))

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """No aircraft is wrapped."""
        return [False]*len(self._rows(indices))

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Primary flight displays, if render_mode is "rgb_array"."""
        return self.batch.render() or [None]*self.num_envs

    def _rows(self, indices: VecEnvIndices) -> list[int]:
        if indices is None:
            return list(range(self.num_envs))
        return list(indices) if isinstance(indices, Iterable) else [indices]
