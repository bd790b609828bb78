"""One training: a run directory with the policy, its configuration, its learning curve and the command that made it."""

from __future__ import annotations

import csv
import json
import platform
import shlex
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from icing_env.errors import InputError
from icing_env.scenario import Scenario
from testbed.training.configuration import Configuration, scenarios_of
from testbed.training.evaluate import evaluate, world_of
from testbed.training.imitation import Demonstration, demonstrate, imitate

EVALUATION_CASES = 8  # of each scenario
WARM_UP_SEED, WARM_UP_CASES, WARM_UP_TIME = 7_000_000, 32, 120.0  # first seed, aircraft of each scenario, s
Progress = Callable[[int, int, dict[str, Any]], None]  # steps done, steps in all, latest point of the curve


@dataclass(frozen=True)
class Order:
    """What is asked for: everything that decides the outcome."""

    algorithm: str
    name: str
    configuration: Configuration
    seed: int
    steps: int
    command: str


class Run:
    """A training in its directory: begun, or gone on with.

    Args:
        order: what to learn.
        folder: run directory.
        threads: of PyTorch; the curve of a resumed run is the same only with the same number.
        tensorboard: write TensorBoard's files too.
    """

    def __init__(self, order: Order, folder: Path, threads: int = 1, tensorboard: bool = False) -> None:
        import torch

        from testbed.training import learner

        torch.set_num_threads(threads)
        self.order, self.folder = order, folder
        around = order.configuration.env_kwargs
        shares = scenarios_of(around)
        self.scenarios = [scenario for scenario, _ in shares]
        env, flights = surroundings(order.configuration, shares)
        self.channels = tuple(c.name for c in env.parts[0].world.view.channels)
        learner.seed_everything(order.seed)
        self.model = learner.make(order.algorithm, order.configuration, env, order.seed, order.steps)
        self.flights: list[Demonstration] = flights
        self.curve: list[dict[str, float]] = []
        if tensorboard:
            self.model.set_logger(_tensorboard(folder))

    def resume(self) -> None:
        """Put everything where the latest checkpoint left it; InputError if there is none that fits."""
        from testbed.training.checkpoint import restore

        self.curve = restore(self.folder/"checkpoints", self.model)["curve"]

    def learn(self, minutes: float | None = None, progress: Progress | None = None) -> bool:
        """Learn to the end, or until a checkpoint before the minutes are over; True at the end.

        Raises:
            InputError: the learner diverged; the last checkpoint stands.
        """
        from testbed.training import learner

        self.folder.mkdir(parents=True, exist_ok=True)
        begun = last = time.monotonic()
        total, every = self.order.steps, self._interval()
        if not self.curve:
            if self.order.configuration.imitate:
                imitate(self.model, self.flights, self.order.configuration.imitate)
            self._mark()
        while self.model.num_timesteps < total:
            now = time.monotonic()
            if minutes is not None and now - begun + 1.2*(now - last) > 60.0*minutes:
                return False
            last = now
            learner.learn(self.model, min(self.model.num_timesteps + every, total))
            self._mark()
            if progress is not None:
                progress(self.model.num_timesteps, total, self.curve[-1])
        _put(self.folder/"finished", f"{self.model.num_timesteps}\n")
        return True

    def _interval(self) -> int:
        """Steps between two points of the curve: whole rollouts."""
        from testbed.training.learner import steps_per_rollout

        rollout = steps_per_rollout(self.model)
        return max(round(self.order.steps/self.order.configuration.evaluations/rollout), 1)*rollout

    def _mark(self) -> None:
        """Evaluate, write curve, policies and checkpoint, in an order that a kill cannot spoil."""
        from testbed.training.checkpoint import save
        from testbed.training.learner import policy_of

        around = self.order.configuration.env_kwargs
        policy = policy_of(self.model, self.order.configuration, self.channels)
        flown = evaluate(self.scenarios, policy, EVALUATION_CASES, observer=around.observer,
                         protection=around.protection)
        self.curve.append({"steps": self.model.num_timesteps, **flown})
        self.write()
        save(self.folder/"checkpoints", self.model, {"curve": self.curve})

    def write(self) -> None:
        """Curve and policies: the last one, and as `policy` the one that flew the fixed cases best so far."""
        from controllers.policies.files import write
        from testbed.training.learner import network_of

        network, tensors = network_of(self.model, self.order.configuration, self.channels)
        write(self.folder/"last.safetensors", network, tensors, self.card())
        if self.curve[-1]["reward"] >= max(point["reward"] for point in self.curve):
            write(self.folder/"policy.safetensors", network, tensors, self.card())
        _put(self.folder/"curve.json", json.dumps(self.curve, indent=1))
        with (self.folder/"curve.csv").open("w", newline="", encoding="utf-8") as file:
            table = csv.DictWriter(file, list(self.curve[0]))
            table.writeheader()
            table.writerows(self.curve)

    def card(self) -> dict[str, Any]:
        """How the policy was made."""
        order = self.order
        return {"command": order.command, "algorithm": order.algorithm, "name": order.name, "seed": order.seed,
                "steps": order.steps, "steps_flown": self.curve[-1]["steps"],
                "configuration": order.configuration.model_dump(), "curve": self.curve,
                "versions": {name: version(name) for name in ("torch", "stable-baselines3", "numpy", "numba")},
                "python": platform.python_version()}


def surroundings(configuration: Configuration, shares: list[tuple[Scenario, float]]) -> tuple[Any, list[Demonstration]]:
    """The aircraft to learn on, and flights of the autopilot by which their features are scaled."""
    from testbed.sb3 import TwinOtterVecEnv
    from testbed.training.surroundings import Fleets, divided, scales

    around = configuration.env_kwargs
    parts, flights = [], []
    for (scenario, _), n in zip(shares, divided(configuration.n_envs, [share for _, share in shares]), strict=True):
        boots = around.protection and scenario.ice_protection == "management"
        parts.append(TwinOtterVecEnv(
            n, hold=around.hold, shortest=min(around.shortest, scenario.duration), scenario=scenario, mode=around.mode,
            observer=around.observer, management=around.protection, protection=around.protection, boots=boots))
        world = world_of(scenario, WARM_UP_CASES, None, observer=around.observer, protection=around.protection,
                         mode="surfaces" if around.mode == "surfaces" else None)
        flights.append(demonstrate(world, around.mode, around.hold, min(WARM_UP_TIME, scenario.duration), WARM_UP_SEED))
    channels = parts[0].world.view.channels
    centre, per_scale = scales(np.concatenate([f.seen.reshape(-1, len(channels)) for f in flights]), channels)
    return Fleets(parts, centre, per_scale, configuration.reward_scale, configuration.reward_root), flights


def begin(order: Order, folder: Path, **options: Any) -> Run:
    """A new run; its directory must not hold one already. InputError if it does."""
    if (folder/"run.json").exists():
        raise InputError(f"{folder}: holds a run already; go on with it by --resume, or choose another --out")
    run = Run(order, folder, **options)
    folder.mkdir(parents=True, exist_ok=True)
    _put(folder/"run.json", json.dumps({
        "command": order.command, "algorithm": order.algorithm, "name": order.name, "seed": order.seed,
        "steps": order.steps, "configuration": order.configuration.model_dump()}, indent=1))
    return run


def resumed(folder: Path, **options: Any) -> Run:
    """A run gone on with, from its directory. Raises InputError if that holds none."""
    from icing_env.configuration import validate
    from testbed.training.checkpoint import finished

    path = folder/"run.json"
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError) as problem:
        raise InputError(f"{path}: no run to go on with: {problem}") from None
    configuration = validate(Configuration, data.pop("configuration", {}), str(path))
    run = Run(Order(configuration=configuration, **data), folder, **options)
    if finished(folder/"checkpoints"):  # killed before its first: it begins again
        run.resume()
    return run


def command_line(algorithm: str, name: str, seed: int, steps: int, scenario: str | None) -> str:
    """The command that makes this run again."""
    words = ["icing", "train", algorithm, "--config", name, "--steps", str(steps), "--seed", str(seed)]
    return shlex.join(words + (["--scenario", scenario] if scenario else []))


def _put(path: Path, text: str) -> None:
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def _tensorboard(folder: Path) -> Any:
    from stable_baselines3.common.logger import configure

    try:
        return configure(str(folder/"tensorboard"), ["tensorboard"])
    except (AssertionError, ImportError):
        raise InputError("--tensorboard needs the package tensorboard (extra `learning`)") from None
