"""What noise in measured regressors takes from least squares, put back.

With X = X0 + E, white noise of variance d_j in the columns of E, X'X exceeds what belongs to z = X0 theta by N D, so
that least squares comes out at (X'X)^-1 (X'X - N D) theta: a derivative by a noisy angle too small, those beside it
wrong the other way. Knowing D, theta = (I - N (X'X)^-1 D)^-1 theta_ls (bias-compensated least squares; Klein & Morelli,
Aircraft System Identification (AIAA 2006), section 5.1, on noise in the regressors; Stoica & Soderstrom, Automatica
18(1), 1982). D is told by the second differences of the channels before they are smoothed, and by the smoother.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimators.regression.least_squares import Fit
from icing_env.record import FloatArray

LARGEST = 0.25  # share of a regressor, as it stands beside the others, that may be noise; beyond it less is put back


def white_noise(signal: FloatArray) -> float:
    """Variance of the noise on a signal (N,), from its second differences; their median sets quick moves aside."""
    second = np.abs(np.diff(signal, 2))
    return float((np.median(second) / 0.6745) ** 2 / 6.0) if len(second) else 0.0


def compensated(fit: Fit, regressors: FloatArray, target: FloatArray, noise: FloatArray) -> Fit:
    """The fit of `target` (N,) by `regressors` (N, p) with what their noise of variance `noise` (p,) took put back."""
    if not np.any(noise > 0.0) or not fit.full_rank:
        return fit
    used = int(np.count_nonzero(np.any(regressors != 0.0, axis=1)))
    information_inverse = fit.covariance_white / max(fit.variance, 1e-300)
    excess = np.sqrt(used * noise)
    share = float(np.linalg.eigvalsh(excess[:, None] * information_inverse * excess[None, :])[-1])
    weight = min(1.0, LARGEST / max(share, 1e-300))
    back = np.linalg.inv(np.eye(len(noise)) - weight * information_inverse * (used * noise)[None, :])
    theta = back @ fit.theta
    residual = target - regressors @ theta
    variance = float(residual @ residual) / max(used - len(noise), 1)
    return replace(fit, theta=theta, covariance=back @ fit.covariance @ back.T,
                   covariance_white=variance * back @ information_inverse @ back.T, residual=residual,
                   variance=variance)  # fmt: skip
