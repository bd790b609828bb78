"""Noise of sampled signals: white, told from third differences, where smooth motion does not show; or rounding."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FlightRecord, FloatArray
from sim2real.records.channels import MEASURED, NOISE_FLOOR
from sim2real.records.rounding import rounding, share_rounded

FEWEST = 17  # third differences
THINNED = 1.5  # samples a step, from which on most are not at steps


def white(samples: FloatArray) -> float:
    """Standard deviation of the white noise in samples, robustly; zero of too few.

    The variance of third differences is 20 times that of white noise.
    """
    third = np.diff(samples, 3)
    third = third[np.isfinite(third)]
    return 1.4826 * float(np.median(np.abs(third))) / math.sqrt(20.0) if len(third) > FEWEST else 0.0


def step_noise(values: FloatArray, sampled: NDArray[np.bool_]) -> float:
    """Standard deviation of the white noise, a draw a step, whose sum over many steps is that of noisy `values`.

    Between samples, every so many steps, they are straight lines.
    """
    samples = values[sampled]
    return white(samples) * math.sqrt(len(values) / max(len(samples), 1))


def channel_noise(measured: FloatArray, record: FlightRecord, power_from: str) -> tuple[FloatArray, FloatArray]:
    """Noise of every channel of MEASURED; the same again where differences of its samples show less, zero elsewhere.

    Interpolation to the steps takes some of the noise of samples between them away, and rounding does not show.

    Args:
        measured: at the steps [N, channels].
        power_from: "torque" where that predicts thrusts, which its rounding then goes into.
    """
    out, unseen = np.array([NOISE_FLOOR[name] for name in MEASURED]), np.zeros(len(MEASURED))
    for j, name in enumerate(MEASURED):
        steps = measured[np.isfinite(measured[:, j]), j]
        if not len(steps):
            continue
        shown, samples = white(steps), record[name][np.isfinite(record[name])]
        more = max(white(samples) if len(samples) < THINNED * len(steps) else 0.0, rounding(samples))
        if name.startswith("thrust") and power_from == "torque":
            driven = share_rounded(record, name.replace("thrust", "torque")) * float(np.median(np.abs(samples)))
            more = float(np.hypot(more, driven))
        out[j] = max(out[j], shown, more)
        unseen[j] = more if more > shown else 0.0
    return out, unseen


def power_noise(record: FlightRecord, name: str, power: FloatArray, sampled: NDArray[np.bool_]) -> float:
    """Noise of a power [W] that comes from a channel, a draw a step: what its samples show, or a reading's rounding.

    A lever stands still for as long as nobody moves it.

    Args:
        power: at the steps [N].
        sampled: where the channel was [N].
    """
    shown = step_noise(power, sampled)
    if not name.startswith(("torque", "thrust")):
        return shown
    rounded = share_rounded(record, name) * float(np.median(np.abs(power)))
    return max(shown, rounded * math.sqrt(len(power) / max(int(np.count_nonzero(sampled)), 1)))
