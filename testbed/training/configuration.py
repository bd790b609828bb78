"""What is to be learned and how: configs/training/ALGO.yml in the form of RL Zoo's hyperparameter files.

Each entry of a file is one configuration. `n_envs`, `n_timesteps`, `policy`, `policy_kwargs` and the algorithm's own
hyperparameters stand as RL Zoo writes them; `env_kwargs` says what is flown.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import Field as Limited

from icing_env import scenario as scenarios
from icing_env.configuration import Strict, folder, validate
from icing_env.errors import InputError, nearest
from icing_env.scenario import Scenario

ALGORITHMS = ("ppo", "sac", "recurrent_ppo")


class Part(Strict):
    """A share of the aircraft and what they fly."""

    scenario: str
    share: float = Limited(1.0, gt=0.0)
    changes: dict[str, Any] = {}


class Surroundings(Strict):
    """What is flown: `env_kwargs`."""

    mode: Literal["surfaces", "targets", "limits"] = "targets"
    hold: int = Limited(10, gt=0)  # simulator steps for which an action stands
    shortest: float = Limited(20.0, gt=0.0)  # s, the shortest episode
    observer: bool = True
    protection: bool = True  # ice management, boots and envelope protection
    changes: dict[str, Any] = {}  # of every scenario
    parts: tuple[Part, ...]


class Configuration(Strict):
    """One entry of a training file."""

    n_envs: int = Limited(64, gt=0)
    n_timesteps: float = Limited(gt=0)
    policy: str
    policy_kwargs: dict[str, Any] = {}
    reward_scale: float = Limited(0.05, gt=0.0)  # applied before the learner sees a reward
    reward_root: bool = False  # a reward 1 - P, P weighted squares of errors, becomes 1 - sqrt(P)
    imitate: int = Limited(0, ge=0)  # updates towards the autopilot before learning from reward; not for sac
    evaluations: int = Limited(20, gt=0)  # points of the learning curve, each a checkpoint
    seeds: tuple[int, ...] = (0,)  # trained by `python -m testbed.training.batch`
    env_kwargs: Surroundings
    hyperparameters: dict[str, Any] = {}


def load(algorithm: str, name: str | None = None) -> tuple[str, Configuration]:
    """A configuration and its name; the first of the algorithm's file if none is asked for.

    Raises:
        InputError: no such algorithm or configuration, or a key or value in it is wrong.
    """
    entries = read(algorithm)
    chosen = name or next(iter(entries))
    if chosen not in entries:
        raise InputError(f"configs/training/{algorithm}.yml has no '{chosen}': {nearest(chosen, list(entries))}")
    data = dict(entries[chosen])
    where = f"configs/training/{algorithm}.yml, {chosen}"
    if not isinstance(data.get("env_kwargs"), dict):
        raise InputError(f"{where}: 'env_kwargs' must say what is flown")
    own = {key: data.pop(key) for key in list(data) if key in Configuration.model_fields}
    return chosen, validate(Configuration, {**own, "hyperparameters": data}, where)


def read(algorithm: str) -> dict[str, dict[str, Any]]:
    """Every configuration of an algorithm, as written. Raises InputError for an unknown algorithm or a bad file."""
    import yaml

    if algorithm not in ALGORITHMS:
        raise InputError(f"no algorithm '{algorithm}': {nearest(algorithm, list(ALGORITHMS))}")
    path: Path = folder() / "training" / f"{algorithm}.yml"
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except yaml.YAMLError as problem:
        raise InputError(f"{path}: not valid YAML: {str(problem).splitlines()[0]}") from None
    return {key: value for key, value in data.items() if not key.startswith("_")}


def scenarios_of(surroundings: Surroundings) -> list[tuple[Scenario, float]]:
    """Scenario and share of every part. Raises InputError for a scenario that does not load."""
    return [(scenarios.load(part.scenario, **merged(surroundings.changes, part.changes)), part.share)
            for part in surroundings.parts]


def merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """`base` with the keys of `over` put in, level by level."""
    out = dict(base)
    for key, value in over.items():
        both = isinstance(value, dict) and isinstance(out.get(key), dict)
        out[key] = merged(out[key], value) if both else value
    return out


def on_scenario(configuration: Configuration, scenario: str) -> Configuration:
    """The same configuration, flown on one scenario as its file says."""
    around = configuration.env_kwargs.model_copy(update={"parts": (Part(scenario=scenario),), "changes": {}})
    return configuration.model_copy(update={"env_kwargs": around})
