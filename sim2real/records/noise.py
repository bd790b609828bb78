"""White noise in sampled signals, told from their third differences: smooth motion does not show in them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray

FEWEST = 17  # third differences


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
