"""Innovations of every candidate along a record, whitened, as one matrix of inner products.

Gust intensity is chosen by the likelihood of the innovations; the noise of every channel is measured on them (from
their differences, which a slow misfit does not touch). Inner products are all that the attribution needs, and those
of several records add.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.candidates import Bank, parameter_rows, pushes
from sim2real.channels import FED_BACK, MEASURED, NOISE_FLOOR
from sim2real.kalman import Gain, gains
from sim2real.paths import path_residuals
from sim2real.predictor import Push, held, innovations
from sim2real.reconstruct import Reconstruction

SIGMAS = (0.02, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.5, 2.2, 3.2)  # m/s
SETTLE = 4.0  # s, until the predictor has forgotten how it was started
CHUNK = 500  # samples whitened at a time


@dataclass(frozen=True)
class Evidence:
    """What one record says.

    Attributes:
        gram: [rows, rows] inner products; row 0 the whitened innovations v of the model itself, row j > 0 the
            signature v_j - v of candidate j.
        gain: the predictor's, with the gust intensity that the record was whitened with.
        factor: whitens innovations [channels, channels].
        samples: whitened numbers behind the inner products.
        whitened: [N, channels of MEASURED], v itself, for showing where the gap lies.
    """

    gram: FloatArray
    gain: Gain
    factor: FloatArray
    samples: int
    whitened: FloatArray
    flight: Reconstruction

    @property
    def sigma_w(self) -> float:
        """Gust intensity, m/s."""
        return self.gain.sigma


def gather(flight: Reconstruction, bank: Bank, gain: Gain | None = None) -> Evidence:
    """Fly every candidate along one record.

    Args:
        gain: of the predictor; the likeliest of SIGMAS if omitted.
    """
    if gain is None:
        gain = choose_gain(flight, gains(flight, SIGMAS)).with_start()
    base = innovations(flight, flight.parameters, gain.K)[:, 0]
    factor = whitening(base[round(SETTLE / flight.dt) :], gain, flight)
    pushed = pushes(replace(flight, measured=predicted(flight, base)), bank)
    return compare(flight, parameter_rows(flight, bank), pushed, gain, factor)


def compare(flight: Reconstruction, rows: NDArray, pushed: tuple[Push, ...], gain: Gain,
            factor: FloatArray) -> Evidence:
    """Inner products of rows flown along one record, the first being the one that the others are compared with."""
    moved = flown_rows(flight, rows, {q.row for q in pushed})
    index = {row: i for i, row in enumerate(moved)}
    renamed = tuple(replace(q, row=index[q.row]) for q in pushed)
    left = innovations(flight, rows[moved], gain.K, renamed)
    first = round(SETTLE / flight.dt)
    flown, samples = np.zeros((len(moved), len(moved))), 0
    whitened = np.zeros((len(left), len(MEASURED)))
    for k in range(first, len(left), CHUNK):
        part = whiten(left[k : k + CHUNK], factor)
        whitened[k : k + CHUNK] = part[:, 0]
        samples += int(np.count_nonzero(part[:, 0]))
        flat = part.transpose(0, 2, 1).reshape(-1, len(moved))
        flat = flat[np.any(flat != 0.0, axis=1)]  # a sparse channel's blanks
        flat[:, 1:] -= flat[:, :1]
        flown += flat.T @ flat
    gram = np.zeros((len(rows), len(rows)))
    gram[np.ix_(moved, moved)] = flown
    for path, own in path_residuals(flight, rows):
        path = path[first:].copy()
        path[:, 1:] -= path[:, :1]
        gram[np.ix_(own, own)] += path.T @ path
        samples += len(path)
    return Evidence(gram, gain, factor, samples, whitened, flight)


def flown_rows(flight: Reconstruction, rows: FloatArray, pushed: set[int]) -> list[int]:
    """Row 0 and those that differ from it once surfaces and powers follow the record."""
    kept = held(rows, flight.dt)
    return [j for j in range(len(rows)) if j == 0 or j in pushed or kept[j].tobytes() != kept[0].tobytes()]


def choose_gain(flight: Reconstruction, options: list[Gain]) -> Gain:
    """The gust intensity that makes the model's innovations likeliest.

    Their size is taken from medians: a gap that shows as an offset or in the moments of a manoeuvre is no gust.
    """
    left = innovations(flight, np.repeat(flight.parameters, len(options)), np.stack([g.K for g in options]))
    left = left[round(SETTLE / flight.dt) :]
    scores = []
    for i, gain in enumerate(options):
        use = [c for c in range(FED_BACK - 1) if flight.has(MEASURED[c])]
        z = np.nan_to_num(left[:, i, use].astype(float))
        factor = np.linalg.cholesky(gain.S[np.ix_(use, use)])
        white = np.linalg.solve(factor, z.T)
        away = np.median(np.abs(white - np.median(white, axis=1, keepdims=True)), axis=1)
        scores.append(-0.5 * np.sum((1.4826 * away) ** 2) - np.sum(np.log(np.diag(factor))))
    return options[int(np.argmax(scores))]


def predicted(flight: Reconstruction, left: FloatArray) -> FloatArray:
    """One-step predictions of the channels [N, channels].

    They carry no noise of the sample they belong to, so that time courses made of them cannot fit that noise.
    """
    out = flight.measured.copy()
    out[1:] -= left
    out[0] = out[1]
    return out


def whitening(left: NDArray[np.floating], gain: Gain, flight: Reconstruction) -> FloatArray:
    """Matrix that makes innovations white and of unit size [channels, channels]; zero rows for absent channels."""
    n = len(MEASURED)
    use = [c for c in range(FED_BACK - 1) if flight.has(MEASURED[c])]
    out = np.zeros((n, n))
    out[np.ix_(use, use)] = np.linalg.inv(np.linalg.cholesky(gain.S[np.ix_(use, use)]))
    for c in range(FED_BACK - 1, n):
        if flight.has(MEASURED[c]):
            out[c, c] = 1.0 / max(_spread(left[:, c]), NOISE_FLOOR[MEASURED[c]])
    white = np.nan_to_num(left.astype(float)) @ out.T
    for c in use:
        out[c] /= max(_spread(white[:, c]), 0.3)
    return out


def whiten(left: NDArray[np.floating], factor: FloatArray) -> FloatArray:
    """[N, rows, channels] whitened; what was not measured counts as zero."""
    return np.where(np.isfinite(left), left, 0.0) @ factor.T


def _spread(values: NDArray[np.floating]) -> float:
    """Standard deviation of white noise, from the differences of its samples."""
    good = values[np.isfinite(values)].astype(float)
    return 1.4826 * float(np.median(np.abs(np.diff(good)))) / np.sqrt(2.0) if len(good) > 10 else 0.0
