"""Many aircraft as one Gymnasium vector environment: the batch is stepped as a batch.

Autoreset (gymnasium.vector.AutoresetMode): NEXT_STEP resets finished rows at the next step, whose action for them is
ignored; SAME_STEP resets at once and hands the last observation over in `info["final_obs"]`; DISABLED leaves it to
`reset(options={"reset_mask": ...})`. Row `i` with seed `s` flies bit for bit as the single environment with seed s + i.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from icing_env import scenario as scenarios
from icing_env.actions import Mode
from icing_env.env import FPS, box_spaces
from icing_env.errors import InputError
from icing_env.loop import LoopFactory, NoLoop
from icing_env.observation import Axes
from icing_env.tasks import REWARD_TERMS
from icing_env.world import World

Arrays = tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]


class TwinOtterVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """`num_envs` Twin Otters.

    Args:
        num_envs: number of aircraft.
        autoreset_mode: member or value of gymnasium.vector.AutoresetMode.
        threads: slices of the batch that run side by side.
        Others: as in `TwinOtterEnv`.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": FPS,
                                "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(self, num_envs: int = 1, scenario: str | scenarios.Scenario = "clear_air", *,
                 mode: Mode = "surfaces", axes: Axes = "all", loop: LoopFactory = NoLoop,
                 autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP, render_mode: str | None = None,
                 changes: dict[str, Any] | None = None, dt: float = 0.02, substeps: int = 2, threads: int = 1) -> None:
        self.num_envs, self.render_mode = num_envs, render_mode
        self.world = World(scenarios.load(scenario, **(changes or {})), num_envs, loop, mode=mode, axes=axes, dt=dt,
                           substeps=substeps, threads=threads)
        self.autoreset_mode = _mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_observation_space, self.single_action_space = box_spaces(self.world)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._done = np.zeros(num_envs, bool)
        self._seeded = False

    def reset(self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
              ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin episodes: all, or with `options={"reset_mask": bool array}` those.

        Args:
            seed: one number (row i gets seed + i), a list, or None to go on with each row's stream.
            options: "reset_mask", and "initial" as in `TwinOtterEnv.reset`.
        """
        super().reset(seed=seed if isinstance(seed, int) else None)
        options = dict(options or {})
        rows = np.flatnonzero(self._mask(options.get("reset_mask")))
        self.world.reset(rows, self._seeds(seed, rows), options.get("initial"))
        self._done[rows] = False
        return self.world.observation.copy(), self._info()

    def _mask(self, mask: Any) -> NDArray[np.bool_]:
        if mask is None:
            return np.ones(self.num_envs, bool)
        mask = np.asarray(mask)
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise InputError(f"reset_mask must be a bool array of shape ({self.num_envs},) with a True in it")
        return mask

    def _seeds(self, seed: Any, rows: NDArray[np.int64]) -> list[int] | None:
        if seed is None and self._seeded:
            return None
        self._seeded = True
        if isinstance(seed, (list, tuple, np.ndarray)):
            if len(seed) != self.num_envs:
                raise InputError(f"seed must be one number or {self.num_envs} of them, got {len(seed)}")
            return [int(self.np_random.integers(2**62)) if seed[i] is None else int(seed[i]) for i in rows]
        base = int(seed) if seed is not None else int(self.np_random.integers(2**62))
        return [base + int(i) for i in rows]

    def step(self, actions: NDArray[np.float32]) -> Arrays:
        """Fly one step of every row. Raises InputError for actions that are not finite (the row is named)."""
        world, waiting = self.world, self._done.copy()
        if self.autoreset_mode == AutoresetMode.DISABLED and waiting.any():
            raise InputError(f"row {int(np.flatnonzero(waiting)[0])} has ended: reset it with options['reset_mask']")
        world.step(np.where(waiting[:, None], 0.0, actions) if waiting.any() else actions)
        terminated, truncated = world.terminated, world.truncated
        reward, info = world.task["reward"].copy(), self._info()
        if waiting.any():  # NEXT_STEP: these rows begin now; what they flew just now did not count
            world.reset(np.flatnonzero(waiting))
            terminated, truncated = terminated & ~waiting, truncated & ~waiting
            reward[waiting] = 0.0
        self._done = terminated | truncated
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._done.any():
            info = self._renewed(info)
        return world.observation.copy(), reward, terminated, truncated, info

    def _renewed(self, info: dict[str, Any]) -> dict[str, Any]:
        """Reset what has ended, keeping its last observation and info as Gymnasium lays them out."""
        done = self._done
        last = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(done):
            last[i] = self.world.observation[i].copy()
        info = {**info, "final_obs": last, "_final_obs": done.copy(), "final_info": info, "_final_info": done.copy()}
        self.world.reset(np.flatnonzero(done))
        self._done = np.zeros(self.num_envs, bool)
        return info

    def _info(self) -> dict[str, Any]:
        task, here = self.world.task, np.ones(self.num_envs, bool)
        terms: dict[str, Any] = {}
        for name in REWARD_TERMS:
            terms[name], terms[f"_{name}"] = task[f"reward_{name}"].copy(), here
        return {"reward_terms": terms, "_reward_terms": here, "reason": task["reason"].astype(np.int64),
                "_reason": here}

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Primary flight display of each row, for render_mode "rgb_array"."""
        if self.render_mode != "rgb_array":
            return None
        return tuple(self.world.frame(i) for i in range(self.num_envs))

    def save(self) -> dict[str, NDArray[Any]]:
        """Everything that decides how the flights go on (arrays)."""
        return {**self.world.save(), "done": self._done.copy()}

    def restore(self, saved: dict[str, NDArray[Any]]) -> None:
        """Go on from a `save`; raises InputError if it does not fit."""
        if "done" not in saved:
            raise InputError("saved state does not fit: 'done' is missing")
        self.world.restore(saved)
        self._done = saved["done"].copy()
        self._seeded = True


def _mode(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        valid = ", ".join(f"'{m.value}'" for m in AutoresetMode)
        raise InputError(f"autoreset_mode must be one of {valid}, got '{mode}'") from None
