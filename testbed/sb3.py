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

from icing_env.tasks import REASONS, REWARD_TERMS
from testbed.environments import make_vector

LENGTHS = 0x6C656E67  # sets the stream of random lengths apart from that of the episodes themselves


class TwinOtterVecEnv(VecEnv):
    """`num_envs` aircraft for Stable-Baselines3.

    Args:
        num_envs: number of aircraft.
        hold: simulator steps for which an action stands; the reward is their mean.
        shortest: episodes end after a time drawn between this [s] and the scenario's; all at that time if omitted.
        Others: those of `testbed.environments.make_vector`.
    """

    def __init__(self, num_envs: int, *, hold: int = 1, shortest: float | None = None, **options: Any) -> None:
        self.batch = make_vector(num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        self.world, self.hold, self.shortest = self.batch.world, hold, shortest
        self.render_mode = self.batch.render_mode
        self._actions: NDArray[np.float32] = np.zeros((num_envs, *(self.batch.single_action_space.shape or ())),
                                                      np.float32)
        super().__init__(num_envs, self.batch.single_observation_space, self.batch.single_action_space)

    def reset(self) -> NDArray[np.float32]:
        """Begin new episodes everywhere; the seeds of `seed()` are used once."""
        seeds: list[int | None] = [s for s in self._seeds if s is not None]
        self.batch.reset(seed=seeds if len(seeds) == self.num_envs else None)
        self._draw_lengths(np.arange(self.num_envs))
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return self.world.observation.copy()

    def _draw_lengths(self, rows: NDArray[np.int64]) -> None:
        """Length of each new episode, from its seed and number alone: there is no generator to keep."""
        if self.shortest is None:
            return
        world = self.world
        for i in rows:
            key = np.array([world.seed[i] ^ np.uint64(LENGTHS), world.episode[i]], np.uint64)
            span = np.random.Generator(np.random.Philox(key=key)).uniform(self.shortest, world.scenario.duration)
            world.task["limit"][i] = self.hold*round(span/(world.dt*self.hold))

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = np.asarray(actions, np.float32)

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Observation, reward, done and one info per aircraft, as Stable-Baselines3 lays them out.

        An aircraft whose episode ends while the action stands flies on until the others have flown theirs; what it does
        then does not count.
        """
        task, n = self.world.task, self.num_envs
        reward, reason, truncated = np.zeros(n), np.zeros(n, np.int64), np.zeros(n, bool)
        done = np.zeros(n, bool)
        for step in range(self.hold):
            self.world.step(self._actions if step == 0 else None)
            reward += np.where(done, 0.0, task["reward"])
            reason = np.where(done, reason, task["reason"].astype(np.int64))
            truncated |= self.world.truncated & ~done
            done = truncated | (reason > 0)
        observation = self.world.observation.copy()
        infos: list[dict[str, Any]] = [{} for _ in range(n)]
        ended = np.flatnonzero(done)
        for i in ended:
            infos[i] = {
                "terminal_observation": observation[i].copy(),
                "TimeLimit.truncated": bool(truncated[i] and reason[i] == 0),
                "reason": REASONS[int(reason[i])],
                "reward_terms": {name: float(task[f"reward_{name}"][i]) for name in REWARD_TERMS},
            }
        if len(ended):
            self.world.reset(ended)
            self._draw_lengths(ended)
            observation[ended] = self.world.observation[ended]
        return observation, (reward/self.hold).astype(np.float32), done, infos

    def save(self) -> dict[str, NDArray[Any]]:
        """Everything that decides how the flights go on (arrays)."""
        return self.batch.save()

    def restore(self, saved: dict[str, NDArray[Any]]) -> None:
        """Go on from a `save`; raises InputError if it does not fit."""
        self.batch.restore(saved)

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
