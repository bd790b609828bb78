"""Derivatives of sampled signals, and the smoother that belongs to them.

The local quadratic slope filter zdot = sum i z(i) / (h sum i^2) is the derivative of a parabolic smoother g. An
equation z_dot = X theta holds between filtered signals only if every regressor passes through that same g; unfiltered
regressors bias Cm_q by -6 % at 5 points and by -20 % at 11 points (filter matching; derived from the kernel below).
Source of the slope filter: Klein & Morelli, Aircraft System Identification (AIAA 2006), chapter 11, local smoothing.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

from icing_env.errors import InputError
from icing_env.record import FloatArray

WINDOW = 0.1  # s, half width of the slope filter: five samples either side at 50 Hz


def half_width(dt: float) -> int:
    """Samples either side for a record with interval `dt` (s): `WINDOW`, but at least two."""
    return max(2, round(WINDOW / dt))


def slope_kernel(half: int) -> FloatArray:
    """Weights of z(-half..half) whose sum is h zdot at the middle, shape (2 half + 1,)."""
    i = np.arange(-half, half + 1, dtype=np.float64)
    return i / np.sum(i * i)


def matched_kernel(half: int) -> FloatArray:
    """The smoother g with unit area whose derivative is the slope filter, shape (2 half + 1,).

    Minus the running sum of the slope weights gives 2 half weights that lie midway between samples; the mean of
    neighbours brings them onto the samples.
    """
    between = -np.cumsum(slope_kernel(half))[:-1]
    padded = np.concatenate(([0.0], between, [0.0]))
    return 0.5 * (padded[1:] + padded[:-1])


def slope(signal: FloatArray, dt: float, half: int) -> FloatArray:
    """Time derivative of `signal` (N,) by local quadratics; the first and last `half` samples are nan."""
    return _inside(signal, slope_kernel(half)[::-1] / dt, half)


def smooth(signal: FloatArray, half: int) -> FloatArray:
    """`signal` (N,) through the smoother matched to `slope`; the first and last `half` samples are nan."""
    return _inside(signal, matched_kernel(half), half)


def _inside(signal: FloatArray, kernel: FloatArray, half: int) -> FloatArray:
    out = np.full(len(signal), np.nan)
    if len(signal) > 2 * half:
        out[half : len(signal) - half] = np.convolve(signal, kernel, mode="valid")
    return out


def low_pass(signal: FloatArray, dt: float, cutoff: float = 10.0, order: int = 2) -> FloatArray:
    """Zero-phase Butterworth low pass of `signal` (N,) at `cutoff` Hz, forwards and backwards.

    Apply it to every channel of an equation, controls included, or none (the same rule of matching).

    Raises:
        InputError: where the cut-off is not below half the sampling rate.
    """
    if not 0.0 < cutoff < 0.5 / dt:
        raise InputError(f"low pass at {cutoff:g} Hz needs more than {2 * cutoff:g} samples/s, got {1 / dt:g}")
    sections = butter(order, cutoff, fs=1.0 / dt, output="sos")
    return np.asarray(sosfiltfilt(sections, signal), dtype=np.float64)
