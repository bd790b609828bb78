"""Tunings of the recursive identifiers: one file each, and what they share in `configs/estimators/observer.toml`."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from estimators.observer.layout import CHANNELS, PARAMETER_NAMES
from icing_env.configuration import folder
from icing_env.errors import InputError, nearest

SHARED = (
    "window", "share_low", "share_high", "control_floor", "incidence_floor", "gust_weight", "drag_smoothing",
)  # fmt: skip
WITH_ACCELEROMETER = ("drag", "lift", "side")


def tuning_type(numbers: tuple[str, ...], per_channel: tuple[str, ...]) -> np.dtype:
    """Structured type of a method's tuning: what all share, its own `numbers`, and `per_channel` fields (6,)."""
    return np.dtype(
        [(name, "f8") for name in (*SHARED, *numbers)]
        + [(name, "f8", (6,)) for name in per_channel]
        + [("accelerometer", "f8", (3,)), ("smallest_scale", "f8", (26,))]
    )


def _check(keys: Any, known: tuple[str, ...], where: str) -> None:
    for key in keys:
        if key not in known:
            raise InputError(f"{where}: unknown key '{key}': {nearest(key, list(known))}")
    missing = [key for key in known if key not in keys]
    if missing:
        raise InputError(f"{where}: key {missing[0]!r} is missing")


def _table(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text())
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a tuning file: {error}") from error


@cache
def _shared() -> np.ndarray:
    """What all methods share, as a tuning of one row without a method's own fields."""
    path = folder() / "estimators" / "observer.toml"
    table = _table(path)
    _check(table, (*SHARED, "smallest_scale"), str(path))
    tuning = np.zeros(1, tuning_type((), ()))
    for name in SHARED:
        tuning[name] = table[name]
    for name, value in table["smallest_scale"].items():
        if name not in PARAMETER_NAMES:
            _check([name], PARAMETER_NAMES, f"{path} [smallest_scale]")
        tuning["smallest_scale"][0, PARAMETER_NAMES.index(name)] = value
    return tuning


def read_tuning(
    path: str | Path, numbers: tuple[str, ...], per_channel: tuple[str, ...], accelerometer: bool = True
) -> np.ndarray:
    """A method's tuning file over the shared one, as an array of one row of `tuning_type(numbers, per_channel)`.

    accelerometer: whether the method weighs accelerometers, in the tables of drag, lift and side force.

    Raises:
        InputError: the file cannot be read; a key is unknown or missing.
    """
    table = _table(Path(path))
    _check(table, (*numbers, "channel") if per_channel else numbers, str(path))
    tuning = np.zeros(1, tuning_type(numbers, per_channel))
    for name in (*SHARED, "smallest_scale"):
        tuning[name] = _shared()[name]
    for name in numbers:
        tuning[name] = table[name]
    if per_channel:
        _check(table["channel"], CHANNELS, f"{path} [channel]")
        for index, channel in enumerate(CHANNELS):
            values, felt = table["channel"][channel], accelerometer and channel in WITH_ACCELEROMETER
            _check(values, (*per_channel, "accelerometer") if felt else per_channel, f"{path} [channel.{channel}]")
            for name in per_channel:
                tuning[name][0, index] = values[name]
            if felt:
                tuning["accelerometer"][0, WITH_ACCELEROMETER.index(channel)] = values["accelerometer"]
    return tuning


@dataclass(frozen=True)
class Tuning:
    """Where a method's tuning stands and what it holds: `name` of its file in `configs/estimators`, and its own fields.

    numbers: scalar fields; per_channel: fields of six; each on top of what all methods share.
    """

    name: str
    numbers: tuple[str, ...] = ()
    per_channel: tuple[str, ...] = ()

    def read(self, path: str | Path) -> np.ndarray:
        """A tuning file as an array of one row. Raises InputError on an unknown or missing key."""
        return read_tuning(path, self.numbers, self.per_channel)

    def default(self) -> np.ndarray:
        """A fresh copy of the one tuning that everything uses, an array of one row."""
        return _default(self).copy()


@cache
def _default(tuning: Tuning) -> np.ndarray:
    return tuning.read(folder() / "estimators" / f"{tuning.name}.toml")
