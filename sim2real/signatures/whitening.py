"""Innovations made white and of unit size: by the predictor's covariance, and by their own noise where it errs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.jit import entry
from icing_env.record import FloatArray
from sim2real.prediction.kalman import Gain
from sim2real.records.channels import FED_BACK, MEASURED, NOISE_FLOOR
from sim2real.records.reconstruct import Reconstruction

SETTLE = 4.0  # s, until the predictor has forgotten how it was started
FARTHEST = 1e5  # noise units: a variant that departs from flight is no nearer to the record for being a number


def whitening(left: FloatArray, gain: Gain, flight: Reconstruction) -> FloatArray:
    """Matrices that make innovations white and of unit size [steps, channels, channels]; zero for absent channels.

    Args:
        left: the model's own innovations [steps, channels].
    """
    n, settled = len(MEASURED), slice(round(SETTLE / flight.dt), None)
    use = np.array([c for c in range(FED_BACK - 1) if flight.has(MEASURED[c])], np.intp)
    out, seen = factors(left, gain, use), np.isfinite(left)
    for c in range(FED_BACK - 1, n):
        if flight.has(MEASURED[c]):
            out[:, c, c] = 1.0 / max(_spread(left[settled, c]), NOISE_FLOOR[MEASURED[c]], flight.unseen[c])
    white = whiten(left[:, None], out)[settled, 0]
    for c in use:
        out[:, c] /= max(_spread(white[seen[settled, c], c]), 1.0 if flight.unseen[c] else 0.3)
    return out / np.sqrt(worth_less(flight))[:, None]


def factors(left: FloatArray, gain: Gain, use: NDArray[np.intp]) -> FloatArray:
    """Inverse roots of the innovations' covariance among those of `use` that were read [steps, channels, channels]."""
    n, read = len(MEASURED), np.isfinite(left[:, use])
    out = np.zeros((len(left), n, n))
    for pattern in np.unique(read, axis=0):
        own, at = use[pattern], np.flatnonzero((read == pattern).all(axis=1))
        S = gain.S[at] if gain.along else gain.S
        out[np.ix_(at, own, own)] = np.linalg.inv(np.linalg.cholesky(S[..., own[:, None], own]))
    return out


def worth_less(flight: Reconstruction) -> FloatArray:
    """What every channel's innovations are worth less because they are coloured where there is no gap [channels]."""
    return np.array([flight.inadequacy.colour.get(name, 1.0) for name in MEASURED])


def whiten(left: FloatArray, factor: FloatArray) -> FloatArray:
    """[N, rows, channels] whitened by one matrix or one per step; what was not measured counts as zero."""
    return np.asarray(np.where(np.isfinite(left), left, 0.0) @ np.swapaxes(factor, -1, -2))


@entry
def departures(left: Any, count: int, factor: Any, farthest: float, out: Any) -> None:
    """The first row whitened as `whiten` does, and the others' departures from it, none beyond `farthest`.

    Args:
        left: [N, rows or more, channels], nan where nothing was measured.
        count: of the rows.
        factor: [N, channels, channels], lower triangles.
        out: [N x channels, rows].
    """
    steps, channels = left.shape[0], left.shape[2]
    known = np.empty((channels, count))
    for k in range(steps):
        for i in range(count):
            for c in range(channels):
                known[c, i] = left[k, i, c] if np.isfinite(left[k, i, c]) else 0.0
        for c in range(channels):
            row = out[k*channels + c]
            row[:] = 0.0
            for d in range(c + 1):
                share = factor[k, c, d]
                if share != 0.0:
                    for i in range(count):
                        row[i] += share*known[d, i]
            for i in range(count):
                row[i] = min(max(row[i], -farthest), farthest)
            for i in range(1, count):
                row[i] -= row[0]


def _spread(values: NDArray[np.floating]) -> float:
    """Standard deviation of white noise, from the differences of its samples."""
    good = values[np.isfinite(values)].astype(float)
    return 1.4826 * float(np.median(np.abs(np.diff(good)))) / np.sqrt(2.0) if len(good) > 10 else 0.0
