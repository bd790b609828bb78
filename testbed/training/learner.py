"""The learner: an algorithm of Stable-Baselines3 from a configuration, and the network that flies taken out of it."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.policies.files import Network
from controllers.policies.policy import Policy
from icing_env.actions import names
from icing_env.errors import InputError
from testbed.training.configuration import Configuration
from testbed.training.surroundings import Fleets

Tensors = dict[str, NDArray[np.float32]]


def make(algorithm: str, configuration: Configuration, env: Fleets, seed: int, total: int) -> Any:
    """A fresh learner at the beginning of its first episodes.

    Args:
        algorithm: name in `configuration.ALGORITHMS`.
        configuration: what to learn.
        env: what is flown.
        seed: of weights, exploration and episodes.
        total: steps of the whole training; a learning rate written `lin_X` falls to nothing there.

    Raises:
        InputError: a hyperparameter that the algorithm does not know.
    """
    from sb3_contrib import RecurrentPPO
    from stable_baselines3 import PPO, SAC
    from stable_baselines3.common.logger import Logger

    kinds = {"ppo": PPO, "sac": SAC, "recurrent_ppo": RecurrentPPO}
    settings = dict(configuration.hyperparameters)
    rate, falls = _rate(settings.pop("learning_rate", 3e-4))
    try:
        model = kinds[algorithm](configuration.policy, env, learning_rate=rate, seed=seed, device="cpu",
                                 policy_kwargs=dict(configuration.policy_kwargs), **settings)
    except (TypeError, ValueError) as problem:
        raise InputError(f"configs/training/{algorithm}.yml: {problem}") from None
    if falls:
        model.lr_schedule = lambda _: rate*max(1.0 - model.num_timesteps/total, 0.0)
    model.set_logger(Logger(None, []))
    model._last_obs = env.begin(seed)  # `learn` would begin other episodes than those of this seed
    model._last_episode_starts = np.ones(env.num_envs, bool)
    return model


def _rate(written: float | str) -> tuple[float, bool]:
    """Learning rate, and whether it falls linearly (RL Zoo writes `lin_3e-4`)."""
    text = str(written)
    try:
        return float(text.removeprefix("lin_")), text.startswith("lin_")
    except ValueError:
        raise InputError(f"learning_rate must be a number or lin_NUMBER, got '{text}'") from None


def learn(model: Any, until: int, callback: Any = None) -> None:
    """Go on learning up to a number of steps.

    Raises:
        InputError: the learner has diverged: a weight or an action is not finite.
    """
    try:
        model.learn(until - model.num_timesteps, callback=callback, reset_num_timesteps=False)
    except (ValueError, InputError):  # what a NaN does inside depends on where it meets a check first
        _finite(model)
        raise
    _finite(model)


def _finite(model: Any) -> None:
    for name, tensor in model.policy.state_dict().items():
        if not np.all(np.isfinite(tensor.detach().numpy())):
            raise InputError(f"the learner diverged near step {model.num_timesteps}: '{name}' is not finite; the last "
                             "checkpoint stands; try a smaller learning_rate or reward_scale") from None


def steps_per_rollout(model: Any) -> int:
    """Steps between two updates: learning can be interrupted only there."""
    if hasattr(model, "n_steps"):
        return int(model.n_steps*model.n_envs)
    return int(model.train_freq.frequency*model.n_envs)


def seed_everything(seed: int) -> None:
    """Python's, NumPy's and PyTorch's generators."""
    import torch

    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 (Stable-Baselines3 draws from it)
    torch.manual_seed(seed)


def network_of(model: Any, configuration: Configuration, channels: tuple[str, ...]) -> tuple[Network, Tensors]:
    """The deterministic policy as it flies without PyTorch."""
    state = {name: tensor.detach().numpy() for name, tensor in model.policy.state_dict().items()}
    around, env = configuration.env_kwargs, model.env
    memory = state["lstm_actor.weight_hh_l0"].shape[1] if "lstm_actor.weight_hh_l0" in state else 0
    stem, head = ("actor.latent_pi", "actor.mu") if "actor.mu.weight" in state else (
        "mlp_extractor.policy_net", "action_net")
    layers = [name.removesuffix(".weight") for name in state if name.startswith(stem) and name.endswith(".weight")]
    layers.append(head)
    tensors: Tensors = {"centre": env.centre, "per_scale": env.per_scale}
    if memory:
        tensors |= {"memory.input": state["lstm_actor.weight_ih_l0"].T,
                    "memory.hidden": state["lstm_actor.weight_hh_l0"].T,
                    "memory.bias": state["lstm_actor.bias_ih_l0"] + state["lstm_actor.bias_hh_l0"]}
    for k, name in enumerate(layers):
        tensors |= {f"layer.{k}.weight": state[f"{name}.weight"].T, f"layer.{k}.bias": state[f"{name}.bias"]}
    sizes = (state[f"{layers[0]}.weight"].shape[1], *(len(state[f"{name}.bias"]) for name in layers))
    network = Network(
        mode=around.mode, hold=around.hold, channels=channels, actions=names(around.mode, "all"), sizes=sizes,
        activation="relu" if stem.startswith("actor") else "tanh", squash=stem.startswith("actor"), memory=memory)
    return network, {name: np.ascontiguousarray(array, np.float32) for name, array in tensors.items()}


def policy_of(model: Any, configuration: Configuration, channels: tuple[str, ...]) -> Policy:
    """The same, ready to fly."""
    return Policy(*network_of(model, configuration, channels))
