"""The Gymnasium environment of one aircraft: thin, it holds a `World` of one row."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from icing_env import scenario as scenarios
from icing_env.actions import Mode
from icing_env.errors import InputError
from icing_env.loop import LoopFactory, NoLoop
from icing_env.observation import Axes
from icing_env.tasks import REASONS, REWARD_TERMS
from icing_env.world import World

FPS = 50
N_TERMS = len(REWARD_TERMS)


class TwinOtterEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Fly a Twin Otter that may be icing up.

    Observation: flat Box, `observation_names` in order (docs/environments.md). Action: Box in [-1, 1],
    `action_names`. Reward: sum of the named terms in `info["reward_terms"]`. An episode is terminated by ground
    contact, structural failure or an upset beyond recovery (`info["reason"]`), truncated at the scenario's duration.

    Args:
        scenario: name of a scenario, path of a scenario file, or a `Scenario`.
        mode: "surfaces" or "targets" (autopilot targets).
        axes: "all", "longitudinal" or "lateral"; the autopilot flies the rest.
        loop: makes observer, ice management and protection; the registered ids bring theirs.
        render_mode: None, "rgb_array" or "human".
        changes: top-level keys of the scenario to replace, such as `task={"kind": "climb"}`.
        dt, substeps: environment step [s] and Runge-Kutta steps in it.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": FPS}

    def __init__(self, scenario: str | scenarios.Scenario = "clear_air", *, mode: Mode = "surfaces",
                 axes: Axes = "all", loop: LoopFactory = NoLoop, render_mode: str | None = None,
                 changes: dict[str, Any] | None = None, dt: float = 0.02, substeps: int = 2) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(f"render_mode must be None, 'rgb_array' or 'human', got '{render_mode}'")
        self.world = World(scenarios.load(scenario, **(changes or {})), 1, loop, mode=mode, axes=axes, dt=dt,
                           substeps=substeps)
        self.render_mode = render_mode
        # A Box is declared as a space of any float; ours are of float32.
        self.observation_space, self.action_space = box_spaces(self.world)  # type: ignore[assignment]
        self._window: Any = None
        names = self.world.task.dtype.names or ()
        first, last = names.index(f"reward_{REWARD_TERMS[0]}"), names.index("reason")
        self._numbers = self.world.task.view(np.float64)[first:last + 1]  # terms, their sum, ..., truncated, reason
        self._seen = self.world.view.out[0]
        self._seeded = False

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the observation's channels, in order."""
        return tuple(c.name for c in self.world.view.channels)

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of the actions, in order."""
        return self.world.action_names

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None
              ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode; `options={"initial": {...}}` replaces fields of the scenario's start (`eta` too)."""
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            seed = seed if seed is not None else int(self.np_random.integers(2**63))
            self.world.reset(seeds=[seed], initial=(options or {}).get("initial"))
            self._seeded = True
        else:
            self.world.reset(initial=(options or {}).get("initial"))
        self._show()
        return self.world.observation[0].copy(), _info(self._numbers.tolist())

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Fly one step. Raises InputError for an action that is not finite or of the wrong shape."""
        self.world.step(np.asarray(action)[None])
        if self.render_mode == "human":
            self._show()
        numbers = self._numbers.tolist()
        return self._seen.copy(), numbers[N_TERMS], numbers[-1] > 0.0, numbers[-2] > 0.0, _info(numbers)

    def render(self) -> NDArray[np.uint8] | None:
        """Primary flight display: a frame for "rgb_array"; "human" shows it in a window."""
        if self.render_mode == "rgb_array":
            return self.world.frame(0)
        self._show()
        return None

    def _show(self) -> None:
        if self.render_mode == "human":
            if self._window is None:
                from icing_env.display.window import Window

                self._window = Window("Twin Otter")
            self._window.show(self.world.frame(0))

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def save(self) -> dict[str, NDArray[Any]]:
        """Everything that decides how the flight goes on (arrays)."""
        return self.world.save()

    def restore(self, saved: dict[str, NDArray[Any]]) -> None:
        """Go on from a `save`; raises InputError if it does not fit."""
        self.world.restore(saved)
        self._seeded = True


def _info(numbers: list[float]) -> dict[str, Any]:
    # `strict` as an argument would cost a twentieth of a step; what follows the terms is not wanted here
    return {"reward_terms": dict(zip(REWARD_TERMS, numbers)), "reason": REASONS[int(numbers[-1])]}  # noqa: B905


def box_spaces(world: World) -> tuple[spaces.Box, spaces.Box]:
    """Observation and action space of one aircraft of a world."""
    view = world.view
    return (spaces.Box(view.low, view.high, dtype=np.float32),
            spaces.Box(-1.0, 1.0, (len(world.action_names),), np.float32))
