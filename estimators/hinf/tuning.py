"""The tuning of the H-infinity identifier: read from `configs/estimators/hinf.toml`, one set used everywhere."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from estimators.observer.tuning import read_tuning, tuning_type
from icing_env.configuration import folder

NUMBERS = ("gamma",)
PER_CHANNEL = ("d", "n", "q0", "k0")
TUNING = tuning_type(NUMBERS, PER_CHANNEL)


def tuning_from(path: str | Path) -> np.ndarray:
    """Read a tuning file; returns a `TUNING` array of one row. Raises InputError on an unknown or missing key."""
    return read_tuning(path, NUMBERS, PER_CHANNEL)


@cache
def _default() -> np.ndarray:
    return tuning_from(folder() / "estimators" / "hinf.toml")


def default_tuning() -> np.ndarray:
    """A fresh copy of the one tuning that everything uses (a `TUNING` array of one row)."""
    return _default().copy()
