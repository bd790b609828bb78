"""Least squares with standard errors that hold when residuals are coloured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from icing_env.record import FloatArray


@dataclass(frozen=True)
class Fit:
    """Least squares z = X theta: theta (p,), covariances (p, p), residual (N,), its variance, R2 and rank of X."""

    theta: FloatArray
    covariance: FloatArray  # corrected for coloured residuals
    covariance_white: FloatArray
    residual: FloatArray
    variance: float
    r2: float
    full_rank: bool

    @property
    def std_error(self) -> FloatArray:
        """Standard errors corrected for coloured residuals, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))


def least_squares(regressors: FloatArray, target: FloatArray, lags: int | None = None, fade: bool = False) -> Fit:
    """Fit `target` (N,) by `regressors` (N, p).

    theta = (X'X)^-1 X'z, s2 = v'v / (N - p), R2 = 1 - v'v / sum (z - zbar)^2, and the covariance corrected for
    coloured residuals, (X'X)^-1 {sum_ij x(i) Rvv(i-j) x(j)'} (X'X)^-1 with the biased autocorrelation Rvv.
    Source: Klein & Morelli, Aircraft System Identification (AIAA 2006), sections 5.1 and 5.2. A row of zeros with a
    zero target keeps the time axis whole where a sample is missing, and is not counted.

    Args:
        lags: largest lag of the autocorrelation; all by default, which gives the textbook's printed values.
        fade: let the autocorrelation fall to zero at `lags` (a tenth of N if None), and no error below the one for
            white residuals. With all lags the sum sees the residual only where the fit has already taken its share
            out: a bias's error comes out half of what it scatters by (measured on 100 records).
    """
    used = int(np.count_nonzero(np.any(regressors != 0.0, axis=1)))
    scale = np.sqrt(np.mean(regressors**2, axis=0))
    scale[scale == 0.0] = 1.0
    u, singular, vt = np.linalg.svd(regressors / scale, full_matrices=False)
    full_rank = bool(singular[-1] > 1e-9 * singular[0])
    inverse = np.where(singular > 1e-9 * singular[0], 1.0 / np.maximum(singular, 1e-300), 0.0)
    theta = (vt.T @ (inverse * (u.T @ target))) / scale
    information_inverse = (vt.T * inverse**2) @ vt / np.outer(scale, scale)
    residual = target - regressors @ theta
    counted = np.any(regressors != 0.0, axis=1)
    total = float(np.sum((target[counted] - np.mean(target[counted])) ** 2)) if used else 0.0
    variance = float(residual @ residual) / max(used - regressors.shape[1], 1)
    middle = regressors.T @ _coloured(regressors, residual, used, lags, fade)
    coloured = information_inverse @ (0.5 * (middle + middle.T)) @ information_inverse
    if fade:
        coloured = _lifted(coloured, variance * np.diag(information_inverse))
    return Fit(
        theta=theta,
        covariance=coloured,
        covariance_white=variance * information_inverse,
        residual=residual,
        variance=variance,
        r2=1.0 - float(residual @ residual) / total if total > 0.0 else 0.0,
        full_rank=full_rank,
    )


def _lifted(covariance: FloatArray, floor: FloatArray) -> FloatArray:
    """Covariance (p, p) with no variance below `floor` (p,), correlations kept."""
    lift = np.sqrt(np.maximum(floor / np.maximum(np.diag(covariance), 1e-300), 1.0))
    return np.asarray(covariance * np.outer(lift, lift), dtype=np.float64)


def _coloured(regressors: FloatArray, residual: FloatArray, used: int, lags: int | None, fade: bool) -> FloatArray:
    """Columns of `regressors` convolved with the autocorrelation of `residual`, shape (N, p), by FFT."""
    n = len(residual)
    size = next_fast_len(2 * n, real=True)
    autocorrelation = irfft(np.abs(rfft(residual, size)) ** 2, size) / max(used, 1)
    if fade:
        far = np.minimum(np.arange(size), size - np.arange(size))
        autocorrelation *= np.maximum(1.0 - far / (1.0 + (max(used // 10, 1) if lags is None else lags)), 0.0)
        # The fit takes out p of the N / tau samples that are worth counting, tau the residual's correlation time.
        together = float(np.sum(autocorrelation)) / max(float(autocorrelation[0]), 1e-300)
        taken = min(regressors.shape[1] * max(together, 1.0) / max(used, 1), 0.5)
        autocorrelation /= 1.0 - taken
    elif lags is not None and lags < n - 1:
        autocorrelation[lags + 1 : size - lags] = 0.0
    spectrum = rfft(autocorrelation)[:, None]
    return np.asarray(irfft(rfft(regressors, size, axis=0) * spectrum, size, axis=0)[:n], dtype=np.float64)


def correlation(regressors: FloatArray) -> FloatArray:
    """Correlation matrix (p, p) of the columns; 0 for a constant column."""
    centred = regressors - np.mean(regressors, axis=0)
    norm = np.sqrt(np.sum(centred**2, axis=0))
    norm[norm == 0.0] = np.inf
    return np.asarray((centred / norm).T @ (centred / norm), dtype=np.float64)
