"""Dryden gusts per MIL-F-8785C above 2000 ft: L = 1750 ft, isotropic.

The filters are driven by unit white noise and discretised by Tustin's rule. The rotational gusts are the
equivalent rotation of the air about the body axes: p_g independent, q_g = -dw_g/dx, r_g = dv_g/dx, the last two
from the same realisation of w_g and v_g (frozen field: d/dx = d/dt / V), low-passed at pi V/4b and pi V/3b.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter

from testbed.elsewhere.aircraft import SPAN

SCALE = 1750.0 * 0.3048  # m


def _shape(numerator: Sequence[float] | NDArray, denominator: Sequence[float], noise: NDArray, dt: float) -> NDArray:
    return np.asarray(lfilter(*bilinear(numerator, denominator, 1.0 / dt), noise))


def dryden(steps: int, dt: float, speed: float, sigma: float, rotational: bool, rng: np.random.Generator) -> NDArray:
    """Gust (6, steps): u, v, w in m/s and p, q, r in rad/s, body axes, for `sigma` m/s rms at `speed` m/s."""
    warm = int(60.0 / dt)
    noise = rng.standard_normal((4, steps + warm)) / np.sqrt(dt)
    time = SCALE / speed
    lateral = np.sqrt(time) * np.array([np.sqrt(3.0) * time, 1.0]), [time**2, 2.0 * time, 1.0]
    gust = np.zeros((6, steps + warm))
    gust[0] = _shape([np.sqrt(2.0 * time)], [time, 1.0], noise[0], dt)
    gust[1] = _shape(*lateral, noise[1], dt)
    gust[2] = _shape(*lateral, noise[2], dt)
    if rotational:
        width = 4.0 * SPAN / (np.pi * speed)
        level = np.sqrt(0.8 * np.pi / (speed * SCALE)) * (np.pi * SCALE / (4.0 * SPAN)) ** (1.0 / 6.0)
        gust[3] = _shape([level], [width, 1.0], noise[3], dt)
        gust[4] = -_shape([1.0 / speed, 0.0], [width, 1.0], gust[2], dt)
        gust[5] = _shape([1.0 / speed, 0.0], [0.75 * width, 1.0], gust[1], dt)
    return np.asarray(sigma * gust[:, warm:])
