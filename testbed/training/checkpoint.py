"""Checkpoints without pickle: all that decides how a training goes on, in safetensors, npz and JSON.

A checkpoint is a folder that appears whole, by renaming, or not at all; a kill at any moment leaves the one before.
"""

from __future__ import annotations

import json
import random
import shutil
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from icing_env.errors import InputError

OPTIMISERS = {"policy": "policy.optimizer", "actor": "actor.optimizer", "critic": "critic.optimizer",
              "entropy": "ent_coef_optimizer"}
COUNTERS = ("num_timesteps", "_n_updates", "_episode_num", "_num_timesteps_at_start")
BUFFER = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
PARTS = ("tensors.safetensors", "arrays.npz", "state.json")


def save(folder: Path, model: Any, notes: dict[str, Any]) -> None:
    """Write a checkpoint of the learner, its environment and all generators; older ones go once it stands.

    Args:
        folder: of the run's checkpoints.
        model: learner, between two calls of `learn`.
        notes: anything in JSON's types to keep beside it.
    """
    from safetensors.torch import save_file

    folder.mkdir(parents=True, exist_ok=True)
    final = folder / f"{model.num_timesteps:012d}"
    part = folder / "unfinished"
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir()
    tensors, state = _tensors(model)
    save_file(tensors, part / PARTS[0])
    np.savez(part / PARTS[1], allow_pickle=False, **_arrays(model, state))
    state |= {"notes": notes, "counters": {name: getattr(model, name) for name in COUNTERS if hasattr(model, name)}}
    state["python"] = _plain(random.getstate())
    state["actions"] = model.action_space.np_random.bit_generator.state
    (part / PARTS[2]).write_text(json.dumps(state, default=_number), encoding="utf-8")
    if final.exists():
        shutil.rmtree(final)
    part.rename(final)
    for old in finished(folder)[:-1]:
        shutil.rmtree(old)


def finished(folder: Path) -> list[Path]:
    """Checkpoints that stand, the latest last."""
    return sorted(path for path in folder.glob("[0-9]*") if path.is_dir())


def restore(folder: Path, model: Any) -> dict[str, Any]:
    """Put a fresh learner of the same configuration where the latest checkpoint left off; returns its notes.

    Raises:
        InputError: there is none, or it is incomplete or of another configuration.
    """
    from safetensors import SafetensorError
    from safetensors.torch import load_file

    stand = finished(folder)
    if not stand:
        raise InputError(f"{folder}: no checkpoint to go on from")
    latest = stand[-1]
    try:
        tensors = load_file(latest / PARTS[0])
        with np.load(latest / PARTS[1], allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        state = json.loads((latest / PARTS[2]).read_text(encoding="utf-8"))
        _take_tensors(model, tensors, state)
        _take_arrays(model, arrays, state)
        model.action_space.np_random.bit_generator.state = state["actions"]
        version, internal, gauss = state["python"]
        random.setstate((version, tuple(internal), gauss))
    except (SafetensorError, BadZipFile, OSError, ValueError, KeyError, RuntimeError) as problem:
        raise InputError(f"{latest}: not a whole checkpoint of this configuration: {problem}") from None
    for name, value in state["counters"].items():
        setattr(model, name, value)
    return dict(state["notes"])


def _optimisers(model: Any) -> dict[str, Any]:
    """Optimisers that this learner has, by name."""
    found = {}
    for name, path in OPTIMISERS.items():
        holder: Any = model
        for step in path.split("."):
            holder = getattr(holder, step, None)
        if holder is not None:
            found[name] = holder
    return found


def _tensors(model: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Weights, optimisers and PyTorch's generator as tensors; what of them is no tensor."""
    import torch

    out = {f"policy.{name}": tensor.detach().clone().contiguous() for name, tensor in model.policy.state_dict().items()}
    out["generator"] = torch.get_rng_state()
    if getattr(model, "log_ent_coef", None) is not None:
        out["log_ent_coef"] = model.log_ent_coef.detach().clone()
    groups = {}
    for name, optimiser in _optimisers(model).items():
        written = optimiser.state_dict()
        groups[name] = written["param_groups"]
        for index, slots in written["state"].items():
            out |= {f"optimiser.{name}.{index}.{slot}": torch.as_tensor(value).clone() for slot, value in slots.items()}
    return out, {"groups": groups}


def _take_tensors(model: Any, tensors: dict[str, Any], state: dict[str, Any]) -> None:
    import torch

    start = "policy."
    model.policy.load_state_dict({n[len(start):]: t for n, t in tensors.items() if n.startswith(start)})
    if getattr(model, "log_ent_coef", None) is not None:
        model.log_ent_coef.data.copy_(tensors["log_ent_coef"])
    for name, optimiser in _optimisers(model).items():
        slots: dict[int, dict[str, Any]] = {}
        for key, tensor in tensors.items():
            if key.startswith(f"optimiser.{name}."):
                index, slot = key.split(".")[2:]
                slots.setdefault(int(index), {})[slot] = tensor
        optimiser.load_state_dict({"state": slots, "param_groups": state["groups"][name]})
    torch.set_rng_state(tensors["generator"])


def _arrays(model: Any, state: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Environment, last observation, memory, replay buffer and NumPy's generator as arrays."""
    out = {f"env.{name}": array for name, array in model.env.save().items()}
    out |= {"last_obs": model._last_obs, "last_starts": model._last_episode_starts}
    kind, keys, *rest = np.random.get_state()  # noqa: NPY002 (Stable-Baselines3 draws from it)
    out["numpy"], state["numpy"] = np.asarray(keys), [kind, *rest]
    memory = getattr(model, "_last_lstm_states", None)
    if memory is not None:
        for i, pair in enumerate((memory.pi, memory.vf)):
            out |= {f"memory.{i}.{j}": tensor.numpy() for j, tensor in enumerate(pair)}
    buffer = getattr(model, "replay_buffer", None)
    if buffer is not None:
        held = buffer.buffer_size if buffer.full else buffer.pos
        out |= {f"buffer.{name}": getattr(buffer, name)[:held] for name in BUFFER}
        state["buffer"] = {"pos": buffer.pos, "full": buffer.full}
    return out


def _take_arrays(model: Any, arrays: dict[str, NDArray[Any]], state: dict[str, Any]) -> None:
    start = "env."
    model.env.restore({name[len(start):]: array for name, array in arrays.items() if name.startswith(start)})
    model._last_obs, model._last_episode_starts = arrays["last_obs"], arrays["last_starts"]
    kind, *rest = state["numpy"]
    np.random.set_state((kind, arrays["numpy"], *rest))  # noqa: NPY002
    if "memory.0.0" in arrays:
        import torch
        from sb3_contrib.common.recurrent.type_aliases import RNNStates

        pairs = [tuple(torch.from_numpy(arrays[f"memory.{i}.{j}"]) for j in (0, 1)) for i in (0, 1)]
        model._last_lstm_states = RNNStates(*pairs)
    buffer = getattr(model, "replay_buffer", None)
    if buffer is not None:
        for name in BUFFER:
            held = arrays[f"buffer.{name}"]
            getattr(buffer, name)[:len(held)] = held
        buffer.pos, buffer.full = state["buffer"]["pos"], state["buffer"]["full"]


def _plain(value: Any) -> Any:
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def _number(value: Any) -> Any:
    """NumPy's scalars and arrays in JSON's types."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"no JSON form for {type(value).__name__}")
