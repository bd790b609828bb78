"""Optimal Fourier smoothing: signal told from noise by how their sine series fall, derivative and noise with it.

Method: C. Lanczos, Applied Analysis (1956), chapter V; Klein & Morelli, Aircraft System Identification (AIAA 2006),
chapter 11. The straight line through the ends is taken away and the rest reflected oddly, so that the periodic signal
and its slope are continuous and the sine coefficients b_k of a smooth signal fall as k^-3, while white noise keeps them
level at n. Wiener's weight s_k^2 / (s_k^2 + n^2) with s_k = n (k_c / k)^3 is then 1 / (1 + (k / k_c)^6): half where the
two meet, at k_c. Here k_c is where Stein's unbiased estimate of the squared error is least (C. Stein, Ann. Statist. 9,
1135, 1981), so that nothing has to be read off a plot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, dst

from icing_env.errors import InputError
from icing_env.record import FloatArray

SHORTEST = 16  # samples
NOISE_BAND = 0.6  # share of the highest frequency above which only noise is taken to be (assumed; 15 Hz at 50 Hz)
CUTS = 80  # cut-offs tried, evenly on a logarithmic scale
CHI2_MEDIAN = 0.4549  # median of chi squared with one degree of freedom


@dataclass(frozen=True)
class Smoothed:
    """A signal told from its noise.

    Attributes:
        value: the smooth signal (N,).
        rate: its time derivative (N,), per s; poorest in the first and last few samples.
        noise: standard deviation of the white noise.
        cutoff: Hz at which the weight is one half.
    """

    value: FloatArray
    rate: FloatArray
    noise: float
    cutoff: float


def fourier_smooth(signal: FloatArray, dt: float, cutoff: float | None = None) -> Smoothed:
    """Smooth and differentiate `signal` (N,), sampled every `dt` s without gaps.

    Args:
        cutoff: Hz; found from the signal if None. An equation between signals holds only if all were cut at the same
            frequency: see `smooth_together`.

    Raises:
        InputError: fewer than 16 samples, or samples that are not finite.
    """
    line, slope, sine = _sine_series(signal, dt)
    noise = _noise(sine)
    band = 0.5 / dt / len(sine)  # Hz for each k
    frequency = _best_cutoff(sine, noise, band) if cutoff is None else cutoff
    k = np.arange(1, len(sine) + 1, dtype=np.float64)
    kept = sine * _weight(k, frequency / band)
    value = line.copy()
    value[1:-1] += 0.5 * dst(kept, type=1)
    # d/dt sin(pi k t / T) = (pi k / T) cos(...): type 1 cosine transform, whose first and last terms are none.
    cosine = np.concatenate(([0.0], kept * np.pi * k / ((len(signal) - 1) * dt), [0.0]))
    rate = slope + 0.5 * dct(cosine, type=1)
    deviation = float(np.sqrt(noise * (len(signal) - 1) / 2.0))  # a sine coefficient of white noise has 2 s2/(N - 1)
    return Smoothed(value, rate, deviation, frequency)


def smooth_together(signals: Mapping[str, FloatArray], dt: float) -> dict[str, Smoothed]:
    """Each of the signals, all cut at the highest frequency that any of them needs: the filters then match."""
    highest = max(fourier_smooth(signal, dt).cutoff for signal in signals.values())
    return {name: fourier_smooth(signal, dt, highest) for name, signal in signals.items()}


def _sine_series(signal: FloatArray, dt: float) -> tuple[FloatArray, float, FloatArray]:
    """The line through the ends (N,), its slope per s, and the coefficients b_k (N - 2,) of what remains.

    The ends are those of a parabola through the first and last quarter of a second, not single noisy samples.
    """
    n = len(signal)
    if n < SHORTEST or not np.isfinite(signal).all():
        raise InputError(f"Fourier smoothing: {n} samples, {int(np.sum(~np.isfinite(signal)))} of them missing; "
                         f"at least {SHORTEST} without a gap are needed")  # fmt: skip
    reach = min(max(6, round(0.25 / dt)), n // 2)
    steps = np.arange(reach, dtype=np.float64)
    ends = [float(np.polyval(np.polyfit(steps, part, 2), 0.0)) for part in (signal[:reach], signal[::-1][:reach])]
    line = np.linspace(ends[0], ends[1], n)
    sine = dst(signal[1:-1] - line[1:-1], type=1) / (n - 1)
    return line, (ends[1] - ends[0]) / ((n - 1) * dt), np.asarray(sine, dtype=np.float64)


def _noise(sine: FloatArray) -> float:
    """Mean square of the coefficients of noise, from the median over the upper band (single peaks do not count)."""
    return float(np.median(sine[int(NOISE_BAND * len(sine)) :] ** 2) / CHI2_MEDIAN)


def _weight(k: FloatArray, cut: FloatArray | float) -> FloatArray:
    return np.asarray(1.0 / (1.0 + (k / cut) ** 6), dtype=np.float64)


def _best_cutoff(sine: FloatArray, noise: float, band: float) -> float:
    """Hz at which Stein's estimate of the squared error, sum (1 - w)^2 b^2 + 2 w n^2, is least."""
    k = np.arange(1, len(sine) + 1, dtype=np.float64)
    cuts = np.geomspace(2.0, float(len(sine)), CUTS)
    weight = _weight(k[None, :], cuts[:, None])
    risk = (1.0 - weight) ** 2 @ sine**2 + 2.0 * noise * weight.sum(axis=1)
    return float(cuts[int(np.argmin(risk))] * band)
