"""Dryden gusts in what vanes and pitot read, as states of a Kalman filter: whitened, measured and drawn out.

The kinematics are driven by measured accelerations, which already hold what a gust does to the motion. So the gust is
left only where the flow is measured, as coloured noise: alpha reads -w_g / V, beta -v_g / V and airspeed -u_g beside
what the motion makes. With the gust as a state and white measurement noise, the innovations of the Kalman filter are
the residual through its whitening filter; maximum likelihood on whitened readings is then output error with wind
states. A gust is correlated with the motion that it causes, but not with the motion before it, which is why the
whitened fit has no bias where the plain one has.

Filters (MIL-F-8785C, 3.7.2; time constant T = L / V): x1' = -x1 / T + sqrt(2 / T) n; u_g = x1; x2' = (x1 - x2) / T;
v_g, w_g = (sqrt(3) x1 + (1 - sqrt(3)) x2) / sqrt(2), each of unit variance. Innovations: Anderson & Moore, Optimal
Filtering (1979), chapters 9 and 10.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import expm, solve_discrete_are
from scipy.signal import lfilter

from icing_env.record import FloatArray

RATIOS = np.concatenate(([0.0], np.geomspace(0.1, 100.0, 22)))  # gust over sensor noise, tried


@dataclass(frozen=True)
class Whitening:
    """Filter from a residual (of noise variance 1) to its innovations.

    Attributes:
        ratio: standard deviation of the gust over that of the white noise, both as the sensor reads them.
        numerator, denominator: coefficients.
        variance: of the innovations, for noise of variance 1.
    """

    ratio: float
    numerator: FloatArray
    denominator: FloatArray
    variance: float

    def __call__(self, signal: FloatArray, axis: int = -1) -> FloatArray:
        """`signal` filtered along `axis`, from rest."""
        if self.ratio == 0.0:
            return signal
        return np.asarray(lfilter(self.numerator, self.denominator, signal, axis=axis), dtype=np.float64)

    def gust(self, residual: FloatArray) -> FloatArray:
        """The gust in a residual (N,), as the sensor reads it: smoothed, from what is before and after.

        What is not gust is noise, S^-1 residual with S the covariance of both, and S^-1 is the whitening filter run
        forwards and then backwards over the variance of the innovations.
        """
        if self.ratio == 0.0:
            return np.zeros_like(residual)
        noise = self(self(residual)[::-1])[::-1] / self.variance
        return np.asarray(residual - noise, dtype=np.float64)


@lru_cache(maxsize=512)
def whitening(ratio: float, transverse: bool, step: float) -> Whitening:
    """The filter for a gust of `ratio`; `step` is dt / T; `transverse` for v_g and w_g, else u_g."""
    if ratio == 0.0:
        return Whitening(0.0, np.ones(1), np.ones(1), 1.0)
    if transverse:
        a, c = np.array([[-1.0, 0.0], [1.0, -1.0]]), np.array([[np.sqrt(3.0), 1.0 - np.sqrt(3.0)]]) / np.sqrt(2.0)
    else:
        a, c = np.array([[-1.0]]), np.ones((1, 1))
    n = len(a)
    drive = np.zeros((n, n))
    drive[0, 0] = 2.0 * ratio**2
    f, q = _discrete(a, drive, step)
    p = solve_discrete_are(f.T, c.T, q, np.eye(1))
    variance = float((c @ p @ c.T)[0, 0]) + 1.0
    gain = f @ p @ c.T / variance
    return Whitening(ratio, np.asarray(np.poly(f), float), np.asarray(np.poly(f - gain @ c), float), variance)


def _discrete(a: FloatArray, drive: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Transition over `step` and the covariance of what is driven in (C. Van Loan, IEEE Trans. AC-23, 395, 1978)."""
    n = len(a)
    block = expm(np.block([[-a, drive], [np.zeros((n, n)), a.T]]) * step)
    f = block[n:, n:].T
    return f, f @ block[:n, n:]


def measure(residual: FloatArray, transverse: bool, step: float) -> tuple[Whitening, float]:
    """The likeliest gust in a residual (N,), and the standard deviation of the white noise beside it.

    Of `RATIOS` the one whose innovations have the least variance (the likelihood with the noise at its best).
    """
    best, least = whitening(0.0, transverse, step), float(np.mean(residual**2))
    for ratio in RATIOS[1:]:
        tried = whitening(float(ratio), transverse, step)
        found = float(np.mean(tried(residual) ** 2))
        if found < least:
            best, least = tried, found
    return best, float(np.sqrt(least / best.variance))
