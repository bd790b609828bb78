"""The tuning of the H-infinity identifier: read from `configs/estimators/hinf.toml`, one set used everywhere."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from estimators.hinf.rows import PARAMETER_NAMES
from icing_env.configuration import folder
from icing_env.errors import InputError, nearest

CHANNELS = ("drag", "lift", "pitch", "side", "roll", "yaw")
_NUMBERS = (
    "gamma", "window", "share_low", "share_high", "control_floor", "incidence_floor", "gust_weight", "drag_smoothing",
)  # fmt: skip
_PER_CHANNEL = ("d", "n", "q0", "k0")

TUNING = np.dtype(
    [(name, "f8") for name in _NUMBERS]
    + [(name, "f8", (6,)) for name in _PER_CHANNEL]
    + [("accelerometer", "f8", (3,)), ("smallest_scale", "f8", (26,))]
)


def _check(keys: Any, known: tuple[str, ...], where: str) -> None:
    for key in keys:
        if key not in known:
            raise InputError(f"{where}: unknown key '{key}': {nearest(key, list(known))}")
    missing = [key for key in known if key not in keys]
    if missing:
        raise InputError(f"{where}: key {missing[0]!r} is missing")


def tuning_from(path: str | Path) -> np.ndarray:
    """Read a tuning file; returns a `TUNING` array of one row. Raises InputError on an unknown or missing key."""
    try:
        table = tomllib.loads(Path(path).read_text())
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a tuning file: {error}") from error
    _check(table, (*_NUMBERS, "channel", "smallest_scale"), str(path))
    _check(table["channel"], CHANNELS, f"{path} [channel]")
    tuning = np.zeros(1, TUNING)
    for name in _NUMBERS:
        tuning[name] = table[name]
    for index, channel in enumerate(CHANNELS):
        values = table["channel"][channel]
        known = (*_PER_CHANNEL, "accelerometer") if channel in ("drag", "lift", "side") else _PER_CHANNEL
        _check(values, known, f"{path} [channel.{channel}]")
        for name in _PER_CHANNEL:
            tuning[name][0, index] = values[name]
        if "accelerometer" in values:
            tuning["accelerometer"][0, ("drag", "lift", "side").index(channel)] = values["accelerometer"]
    for name, value in table["smallest_scale"].items():
        if name not in PARAMETER_NAMES:
            _check([name], PARAMETER_NAMES, f"{path} [smallest_scale]")
        tuning["smallest_scale"][0, PARAMETER_NAMES.index(name)] = value
    return tuning


@cache
def _default() -> np.ndarray:
    return tuning_from(folder() / "estimators" / "hinf.toml")


def default_tuning() -> np.ndarray:
    """A fresh copy of the one tuning that everything uses (a `TUNING` array of one row)."""
    return _default().copy()
