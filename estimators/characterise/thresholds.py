"""Thresholds of detection by rival, kind and turbulence class: `configs/estimators/characterise/thresholds.toml`.

Written by `icing characterise --train` from clear-air flights; the file names the command, the false-alarm rate and
the hours flown.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimators.characterise.model import KINDS
from icing_env.configuration import Strict, read_toml, validate
from icing_env.errors import InputError, nearest

FloatArray = NDArray[np.float64]


class Levels(Strict):
    """Scores (log-odds) by turbulence class, in the order of the file's `turbulence`."""

    threshold: tuple[float, ...]
    usual: tuple[float, ...]  # median in clear air


class File(Strict):
    """The file as it is written."""

    command: str
    false_alarms_per_100_h: float
    hours: tuple[float, ...]  # of clear air flown in each class
    turbulence: dict[str, float]  # sigma_w [m/s] by class, rising
    levels: dict[str, dict[str, Levels]]  # by rival, by kind


class Thresholds:
    """Thresholds of one rival."""

    def __init__(self, file: File, rival: str) -> None:
        self.sigma = np.array(list(file.turbulence.values()))
        self.levels = {kind: file.levels[rival][kind] for kind in KINDS}

    def at(self, gust: FloatArray, referenced: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        """Threshold and usual score [n] in gusts of `gust` m/s [n], by whether features are `own` or `type` [n]."""
        found = {kind: [np.interp(gust, self.sigma, row) for row in (levels.threshold, levels.usual)]
                 for kind, levels in self.levels.items()}
        return (np.where(referenced, found["own"][0], found["type"][0]),
                np.where(referenced, found["own"][1], found["type"][1]))


@cache
def load_thresholds(rival: str, where: Path | None = None) -> Thresholds:
    """The thresholds of one rival, as they come or of a folder; InputError if the file or the rival is not there."""
    name = "characterise/thresholds" if where is None else where / "thresholds.toml"
    file = validate(File, read_toml("estimators", name), f"estimators '{name}'")
    if rival not in file.levels:
        raise InputError(f"estimators '{name}': no thresholds of '{rival}': {nearest(rival, list(file.levels))}")
    return Thresholds(file, rival)
