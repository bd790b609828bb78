"""Dryden turbulence (MIL-F-8785C) by Van Loan's discretisation at the integrator's own 5 ms step.

Above 2000 ft the scale is 1750 ft on all axes and the intensities are equal; `scale` multiplies it. How gusts differ
along the aircraft is one of `conditions.KINDS`. "later": the tail meets the vertical one later, through the document's
Pade approximation (with a true delay, a null at 1.5 m/s is told from the model). "turning": the air turns with the
document's spectra of p, q and r. "at_once": all of the aircraft meets the same. "rolling": the tail meets the vertical
gust later, and the air turns in p and r.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, expm, solve_continuous_lyapunov
from scipy.signal import lfilter

from testbed.withheld.compiled import compiled
from testbed.withheld.plant import DT, G_P, G_Q, G_R, G_TAIL, G_U, G_V, G_W, GUSTS, SUB
from testbed.withheld.published import PUBLISHED

LENGTH = 1750.0 * 0.3048  # m
LATER, TURNING = ("later", "rolling"), ("turning", "rolling")  # of `conditions.KINDS`


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


def along(kind: str, sigma: float, scale: float, speed: float) -> tuple[NDArray, NDArray, NDArray]:
    """A [n, n], B [n, m], C [GUSTS, n] of all that the aircraft meets; the first five states are those of `continuous`.

    MIL-F-8785C 3.7.2: p is white noise through a lag of 4 b / (pi V), q = -dw/dt / V and r = dv/dt / V behind lags of
    4 b / (pi V) and 3 b / (pi V).
    """
    A5, B5, C5 = continuous(sigma, scale, speed)
    later, turns = kind in LATER, kind in TURNING
    n, m = 5 + later + 3 * turns, 3 + turns
    A, B, C = np.zeros((n, n)), np.zeros((n, m)), np.zeros((GUSTS, n))
    A[:5, :5], B[:5, :3], C[[G_U, G_V, G_W], :5] = A5, B5, C5
    v, w = C[G_V].copy(), C[G_W].copy()
    C[G_TAIL] = w
    if later:  # (1 - s delay/2) / (1 + s delay/2) of w: 2 z - w, z a lag of delay/2
        half = 0.5 * PUBLISHED["tail_arm"] / speed
        A[5], A[5, 5] = w / half, -1.0 / half
        C[G_TAIL, :], C[G_TAIL, 5] = -w, 2.0
    if turns:
        p, q, r = range(n - 3, n)
        span, length = PUBLISHED["span"], LENGTH * scale
        lag = 4.0 * span / (math.pi * speed)
        power = sigma**2 * 0.8 * (math.pi * length / (4.0 * span)) ** (1.0 / 3.0) / (length * speed)
        A[p, p], B[p, 3], C[G_P, p] = -1.0 / lag, math.sqrt(math.pi * power) / lag, 1.0
        A[q] += w / lag
        A[r] += v / (0.75 * lag)
        A[q, q], A[r, r] = -1.0 / lag, -1.0 / (0.75 * lag)
        C[G_R], C[G_R, r] = v / (0.75 * lag * speed), -1.0 / (0.75 * lag * speed)
        if not later:
            C[G_Q], C[G_Q, q] = -w / (lag * speed), 1.0 / (lag * speed)
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


def draw(samples: int, sigma: float, scale: float, speed: float, rng: np.random.Generator, kind: str = "later"
         ) -> NDArray:  # fmt: skip
    """Gusts [samples*SUB + 1, GUSTS] as the plant takes them, stationary from the start."""
    steps, step = samples * SUB + 1, DT / SUB
    out = np.zeros((steps, GUSTS))
    if sigma == 0.0:
        return out
    A, B, C = along(kind, sigma, scale, speed)
    A5, B5, C5 = A[:5, :5], B[:5, :3], C[[G_U, G_V, G_W], :5]
    out[:, [G_U, G_V, G_W]] = _drawn(A5, B5, steps, step, rng) @ C5.T
    v, w = out[:, G_V], out[:, G_W]
    out[:, G_TAIL] = w
    if kind in LATER:
        out[:, G_TAIL] = 2.0 * _lagged(w, 0.5 * PUBLISHED["tail_arm"] / speed, step) - w
    if kind in TURNING:
        p, lag = np.flatnonzero(B[:, 3])[0], 4.0 * PUBLISHED["span"] / (math.pi * speed)
        out[:, G_P] = _drawn(A[p : p + 1, p : p + 1], B[p : p + 1, 3:], steps, step, rng)[:, 0]
        out[:, G_R] = (v - _lagged(v, 0.75 * lag, step)) / (0.75 * lag * speed)
        if kind not in LATER:
            out[:, G_Q] = (_lagged(w, lag, step) - w) / (lag * speed)
    return out


def _drawn(A: NDArray, B: NDArray, steps: int, step: float, rng: np.random.Generator) -> NDArray:
    """States [steps, n]."""
    F, Q = discrete(A, B, step)
    noise = rng.standard_normal((steps - 1, len(A))) @ cholesky(Q + 1e-18 * np.eye(len(A)), lower=True).T
    stationary = solve_continuous_lyapunov(A, -B @ B.T)
    start = cholesky(stationary + 1e-12 * np.eye(len(A)), lower=True) @ rng.standard_normal(len(A))
    return np.asarray(_march(F, noise, start))


def _lagged(x: NDArray, time: float, step: float) -> NDArray:
    """`x` behind a lag, bilinear: of the straight lines that the plant flies between samples, not of what is quicker.

    With a lag of all that is quicker, the air would turn for good by what the plant does not meet of v and w, and the
    tail would not have its delay's gain of one.
    """
    a = 2.0 * time / step
    return np.asarray(lfilter([1.0, 1.0], [1.0 + a, 1.0 - a], x, zi=np.array([(1.0 - 1.0 / (1.0 + a)) * x[0]]))[0])
