"""Dryden turbulence (MIL-F-8785C) by Van Loan's discretisation at the integrator's own 5 ms step.

Above 2000 ft the scale is 1750 ft on all axes and the intensities are equal; `scale` multiplies it. The tail meets
the gust through the document's Pade approximation: with a true delay, a null at 1.5 m/s is told from the model.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, expm, solve_continuous_lyapunov
from scipy.signal import lfilter

from testbed.withheld.compiled import compiled
from testbed.withheld.plant import DT, SUB

LENGTH = 1750.0 * 0.3048  # m


def continuous(sigma: float, scale: float, speed: float) -> tuple[NDArray, NDArray, NDArray]:
    """A [5, 5], B [5, 3], C [3, 5] of the gusts u, v, w driven by white noise of unit intensity."""
    a = speed / (LENGTH * scale)
    drive = sigma * math.sqrt(2.0 * a)
    A, B, C = np.zeros((5, 5)), np.zeros((5, 3)), np.zeros((3, 5))
    A[0, 0], B[0, 0], C[0, 0] = -a, drive, 1.0
    for j, first in ((1, 1), (2, 3)):
        A[first, first], A[first + 1, first], A[first + 1, first + 1] = -a, a, -a
        B[first, j] = drive
        C[j, first], C[j, first + 1] = math.sqrt(3.0 / 2.0), (1.0 - math.sqrt(3.0)) / math.sqrt(2.0)
    return A, B, C


def discrete(A: NDArray, B: NDArray, step: float) -> tuple[NDArray, NDArray]:
    """Transition matrix and covariance of the noise over `step` seconds (Van Loan, IEEE TAC 23(3), 1978)."""
    n = len(A)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -A, B @ B.T, A.T
    e = expm(block * step)
    F = e[n:, n:].T
    Q = F @ e[:n, n:]
    return np.ascontiguousarray(F), 0.5 * (Q + Q.T)


@compiled
def _march(F: NDArray, noise: NDArray, x: NDArray) -> NDArray:
    out = np.empty((noise.shape[0] + 1, len(x)))  # C order, as F and noise are
    out[0] = x
    for k in range(noise.shape[0]):
        out[k + 1] = F @ out[k] + noise[k]
    return out


def draw(samples: int, sigma: float, scale: float, speed: float, tail_arm: float, rng: np.random.Generator) -> NDArray:
    """Gusts u, v, w and w at the tail [samples*SUB + 1, 4] along the body axes, stationary from the start."""
    steps, step = samples * SUB + 1, DT / SUB
    out = np.zeros((steps, 4))
    if sigma == 0.0:
        return out
    A, B, C = continuous(sigma, scale, speed)
    F, Q = discrete(A, B, step)
    noise = rng.standard_normal((steps - 1, 5)) @ cholesky(Q + 1e-18 * np.eye(5), lower=True).T
    stationary = solve_continuous_lyapunov(A, -B @ B.T)
    start = cholesky(stationary + 1e-12 * np.eye(5), lower=True) @ rng.standard_normal(5)
    out[:, :3] = _march(F, noise, start) @ C.T
    out[:, 3] = _delayed(out[:, 2], tail_arm / speed, step)
    return out


def _delayed(w: NDArray, delay: float, step: float) -> NDArray:
    """(1 - s delay/2)/(1 + s delay/2) of `w`, bilinear: 2 z - w with z a lag of delay/2."""
    a = delay / step
    z, _ = lfilter([1.0, 1.0], [1.0 + a, 1.0 - a], w, zi=np.array([(1.0 - (1.0 / (1.0 + a))) * w[0]]))
    return np.asarray(2.0 * z - w)
