"""The file of a policy: safetensors, which hold numbers and strings and never code.

Metadata: `format`, `network` (JSON of a `Network`), `card` (JSON: how it was made). Tensors: `centre` and `per_scale`
of the features; `memory.*`, `layer.K.weight` [inputs, outputs] and `layer.K.bias`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field as Limited

from icing_env.configuration import Strict, validate
from icing_env.errors import InputError, nearest
from icing_env.observation import CHANNELS

FORMAT = "icing-policy/1"
FOLDER = Path(__file__).resolve().parent


class Network(Strict):
    """What the numbers in a file mean."""

    mode: Literal["surfaces", "targets", "limits"]
    axes: Literal["all", "longitudinal", "lateral"] = "all"
    hold: int = Limited(gt=0)  # simulator steps for which an action stands
    dt: float = Limited(0.02, gt=0.0)  # s, of the simulator
    channels: tuple[str, ...]  # of the observation, in order
    actions: tuple[str, ...]
    sizes: tuple[int, ...]  # width of the first layer's input and of every layer's output
    activation: Literal["tanh", "relu"] = "tanh"
    squash: bool = False  # tanh on the output, else it is cut at -1 and 1
    memory: int = Limited(0, ge=0)  # units of the long short-term memory before the layers, 0 without one


def shipped() -> list[str]:
    """Names of the policies that come with the project."""
    return sorted(path.stem for path in FOLDER.glob("*.safetensors"))


def find(name: str | Path) -> Path:
    """File of a policy by its name, or by a path of the user's own; InputError names the nearest."""
    path = Path(name) if str(name).endswith(".safetensors") else FOLDER / f"{name}.safetensors"
    if not path.is_file():
        raise InputError(f"no policy '{name}': {nearest(str(name), shipped())}")
    return path


def shapes(network: Network) -> dict[str, tuple[int, ...]]:
    """Name and shape of every tensor that a network has."""
    seen, units = len(network.channels), network.memory
    out: dict[str, tuple[int, ...]] = {"centre": (seen,), "per_scale": (seen,)}
    if units:
        out |= {"memory.input": (seen, 4*units), "memory.hidden": (units, 4*units), "memory.bias": (4*units,)}
    for k, (inputs, outputs) in enumerate(zip(network.sizes, network.sizes[1:], strict=False)):
        out |= {f"layer.{k}.weight": (inputs, outputs), f"layer.{k}.bias": (outputs,)}
    return out


def write(path: Path, network: Network, tensors: dict[str, NDArray[Any]], card: dict[str, Any]) -> None:
    """Write a policy file, whole or not at all."""
    from safetensors.numpy import save_file

    part = path.with_name(path.name + ".part")
    metadata = {"format": FORMAT, "network": network.model_dump_json(), "card": json.dumps(card)}
    save_file({name: np.ascontiguousarray(array, np.float32) for name, array in tensors.items()}, part, metadata)
    part.replace(path)


def read(path: Path) -> tuple[Network, dict[str, NDArray[np.float32]], dict[str, Any]]:
    """Network, tensors and card of a policy file.

    Raises:
        InputError: not a policy, cut short, changed, or with numbers that do not fit together or are not finite.
    """
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, "np") as file:
            metadata = file.metadata() or {}
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (not a dict)
    except (SafetensorError, OSError) as problem:
        raise InputError(f"{path}: not a safetensors file, or cut short: {problem}") from None
    if metadata.get("format") != FORMAT:
        raise InputError(f"{path}: format is {metadata.get('format')!r}, must be '{FORMAT}'")
    network = validate(Network, _json(path, metadata, "network"), str(path))
    _check(path, network, tensors)
    return network, tensors, _json(path, metadata, "card")


def _json(path: Path, metadata: dict[str, str], key: str) -> dict[str, Any]:
    try:
        found = json.loads(metadata[key])
    except (KeyError, json.JSONDecodeError) as problem:
        raise InputError(f"{path}: metadata '{key}' must be JSON: {problem!r}") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: metadata '{key}' must be a JSON object")
    return found


def _check(path: Path, network: Network, tensors: dict[str, NDArray[Any]]) -> None:
    """Do the tensors make up that network?"""
    first = network.memory or len(network.channels)
    if len(network.sizes) < 2 or network.sizes[0] != first or network.sizes[-1] != len(network.actions):
        raise InputError(f"{path}: sizes {network.sizes} must lead from {first} to {len(network.actions)} numbers")
    known = {c.name for c in CHANNELS}
    for name in network.channels:
        if name not in known:
            raise InputError(f"{path}: the policy sees '{name}', which no observation holds")
    wanted = shapes(network)
    for name in {*wanted, *tensors}:
        if name not in wanted or name not in tensors:
            raise InputError(f"{path}: tensor '{name}' is {'missing' if name in wanted else 'not part of the network'}")
        array = tensors[name]
        if array.shape != wanted[name] or array.dtype != np.float32:
            raise InputError(f"{path}: tensor '{name}' is {array.dtype} {array.shape}, must be float32 {wanted[name]}")
        if not np.all(np.isfinite(array)):
            raise InputError(f"{path}: tensor '{name}' holds numbers that are not finite")
