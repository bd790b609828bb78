"""What a recursive identifier learned from, looked at again at the end: scatter, and what noise in regressors took.

Least squares on the rows of a channel, each with the weight that the gate gave it. Noise in the measured flow angles,
rates and surfaces is in the rows too and makes the recursion's estimate wrong by the same share as that of least
squares (estimators.regression.noisy_regressors); the estimate that is told at the end of a record has it put back. In
flight it stays in: 1 to 3 % of CL_alpha and Cm_alpha in a doublet set.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.observer.excitation import heard
from estimators.observer.layout import ACCELEROMETER, COUNT, FIRST, PARAMETER_NAMES
from estimators.regression.least_squares import Fit, least_squares
from estimators.regression.noisy_regressors import compensated, white_noise
from estimators.signals.resample import Grid
from icing_env.errors import InputError
from icing_env.record import FloatArray

ENERGY = np.dtype([("energy", "f8", (7,))])  # all that the gate reads of a memory
# Channels that stand in regressors: the last word of a parameter's name.
MEASURED = ("alpha", "beta", "p", "q", "r", "elevator", "aileron", "rudder")


@dataclass(frozen=True)
class History:
    """What the observer believed at each instant: `time` (N,) s, `estimate` ESTIMATE (N,), `memory` (N,)."""

    time: FloatArray
    estimate: NDArray[np.void]
    memory: NDArray[np.void]
    tuning: NDArray[np.void]

    def parameter(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Estimate of one parameter over time and the standard deviation that the method gives it, each (N,)."""
        if name not in PARAMETER_NAMES:
            raise InputError(f"recursive identifiers have no '{name}'; valid are: {', '.join(PARAMETER_NAMES)}")
        index = PARAMETER_NAMES.index(name)
        return self.memory["theta"][:, index], self.memory["deviation"][:, index]


def noise_of(grid: Grid) -> dict[str, float]:
    """Variance of white noise times the interval (s) on each measured regressor, by channel."""
    return {name: white_noise(grid.values[name][grid.good((name,))]) * grid.dt
            for name in MEASURED if name in grid.values}  # fmt: skip


def learned(run: History, c: int, airframe: NDArray[np.void], noise: dict[str, float]) -> tuple[Fit, FloatArray]:
    """Least squares on the rows of channel `c`, and what is to be added to the recursion's estimates (p,).

    Args:
        run: of one start.
        c: which channel.
        airframe: AIRFRAME row that the run flew with.
        noise: of `noise_of`.
    """
    part, memory = slice(FIRST[c], FIRST[c] + COUNT[c]), run.memory
    good = (run.estimate["health"] == 1.0) & (memory["seated"] == 1.0)
    a, rows = ACCELEROMETER[c], memory["filtered"][:, part]
    felt = a >= 0 and np.isfinite(run.tuning["accelerometer"][0, a])
    target = memory["felt_filtered"][:, a] if felt else memory["y"][:, c] - memory["zeta"][:, c]
    fit = least_squares(np.where(good[:, None], rows, 0.0), np.where(good, target, 0.0))
    if c == 0:
        return fit, np.zeros(1)
    weight = np.zeros((len(memory), 6))
    energy = np.zeros(len(memory), ENERGY)
    energy["energy"] = memory["energy"]
    heard(energy, run.tuning, airframe, weight)
    root = np.sqrt(np.where(good, weight[:, c], 0.0))
    part_rows, part_target = rows * root[:, None], target * root
    if np.count_nonzero(root) <= 2 * COUNT[c]:
        return fit, np.zeros(COUNT[c])
    plain = least_squares(part_rows, part_target, lags=0)
    back = compensated(plain, part_rows, part_target, _behind(run, c, rows[root > 0.0], airframe, noise))
    return fit, np.asarray(back.theta - plain.theta)


def _behind(
    run: History, c: int, rows: FloatArray, airframe: NDArray[np.void], noise: dict[str, float]
) -> FloatArray:
    """Variance of the noise on each regressor of channel `c` behind the matched filter (p,).

    White noise of variance s2 every dt comes out of 1/(s + w) with the variance s2 dt/2w; a constant with 1/w.
    """
    rate, level = float(run.memory["bandwidth"][-1, c]), float(np.mean(rows[:, 0] ** 2))
    airspeed = float(np.mean(run.memory["y"][:, 0]))
    hat = {"p": airframe["span"][0], "q": airframe["chord"][0], "r": airframe["span"][0]}
    found = np.zeros(COUNT[c])
    for i in range(1, COUNT[c]):
        channel = PARAMETER_NAMES[FIRST[c] + i].split("_")[1]
        scale = float(hat[channel]) / (2.0 * airspeed) if channel in hat else 1.0
        found[i] = 0.5 * rate * level * scale**2 * noise.get(channel, 0.0)
    return found
