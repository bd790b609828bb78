"""Innovations of every candidate along a record, whitened, as one matrix of inner products.

Gust intensity is chosen by the likelihood of the innovations; the noise of every channel is measured on them (from
their differences, which a slow misfit does not touch). Inner products are all that the attribution needs, and those
of several records add.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.jit import entry
from icing_env.record import FloatArray
from sim2real.actuators.paths import counted, path_gram, path_residuals
from sim2real.library.candidates import Bank, parameter_rows
from sim2real.library.terms import Term, pushes
from sim2real.prediction.kalman import Gain, follow, gains
from sim2real.prediction.predictor import LOST, Push, held, innovations, predicted, with_spare
from sim2real.records.channels import FED_BACK, MEASURED, NOISE_FLOOR
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.means import Means
from sim2real.signatures.response import Filter, Responses

# m/s
SIGMAS = (0.003, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.27, 0.35, 0.45, 0.55, 0.67, 0.82, 1.0, 1.2, 1.45, 1.75, 2.1, 2.6,
          3.2)  # fmt: skip
SETTLE = 4.0  # s, until the predictor has forgotten how it was started
CHUNK = 500  # samples whitened at a time
TOGETHER = 100  # samples that the channels have to share for their covariance to be judged
NONE = Responses()
FARTHEST = 1e5  # noise units: a variant that departs from flight is no nearer to the record for being a number


@dataclass(frozen=True)
class Evidence:
    """What one record says.

    Attributes:
        gram: [rows, rows] inner products; row 0 the whitened innovations v of the model itself, row j > 0 the
            signature v_j - v of candidate j.
        gain: the predictor's, with the gust intensity that the record was whitened with.
        factor: whitens innovations [steps, channels, channels].
        samples: whitened numbers behind the inner products, those of coloured channels in part.
        whitened: [N, channels of MEASURED], v itself, for showing where the gap lies.
        rows: [N x channels, kept] what is behind `gram` but for the paths, of the rows that were kept.
        linear: the predictor linearised along the model's flight, where the candidates were flown.
    """

    gram: FloatArray
    gain: Gain
    factor: FloatArray
    samples: float
    whitened: FloatArray
    flight: Reconstruction
    rows: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    linear: Filter | None = None

    @property
    def sigma_w(self) -> float:
        """Gust intensity, m/s."""
        return self.gain.sigma


def gather(flight: Reconstruction, bank: Bank, gain: Gain | None = None) -> Evidence:
    """Fly every candidate along one record; the rows of `bank.linear` are kept themselves.

    Args:
        gain: of the predictor; the likeliest of SIGMAS if omitted.
    """
    if gain is None:
        gain = follow(flight, choose_gain(flight, gains(flight, SIGMAS)))
    base = innovations(flight, flight.parameters, gain.K)[:, 0]
    factor = whitening(base, gain, flight)
    about = Filter(replace(flight, measured=predicted(flight, base)), gain, factor, round(SETTLE / flight.dt))
    known = about.respond(pushes(about.flight, bank.terms))
    return replace(compare(flight, parameter_rows(flight, bank), gain, factor, bank.terms, bank.linear, known),
                   linear=about)


def compare(flight: Reconstruction, rows: NDArray, gain: Gain, factor: FloatArray, terms: Sequence[Term] = (),
            keep: Sequence[int] = (), linear: Responses = NONE) -> Evidence:
    """Inner products of rows flown along one record, the first being the one that the others are compared with.

    Args:
        terms: generic ones, of which those of a path are judged there.
        keep: rows that are wanted themselves.
        linear: rows whose response is known and that are not flown.
    """
    found, first = flown(flight, rows, (), gain, factor, keep, linear), round(SETTLE / flight.dt)
    samples = counted(flight, len(flight.time) - first) * len(path_residuals(flight, rows[:1]))
    return replace(found, gram=found.gram + path_gram(flight, rows, terms, first), samples=found.samples + samples)


def flown(flight: Reconstruction, rows: NDArray, pushed: tuple[Push, ...], gain: Gain, factor: FloatArray,
          keep: Sequence[int] = (), linear: Responses = NONE) -> Evidence:
    """The same but for the paths, which do not care how the aircraft flies."""
    moved, renamed = to_fly(flight, rows, pushed)
    left = with_spare(flight, np.take(rows, moved), gain.K, renamed)
    return told(flight, left, moved, len(rows), gain, factor, keep, linear)


def to_fly(flight: Reconstruction, rows: NDArray, pushed: tuple[Push, ...] = ()) -> tuple[list[int],
                                                                                         tuple[Push, ...]]:  # fmt: skip
    """Which rows have to be flown, and what pushes these, by their place among them."""
    moved = flown_rows(flight, rows, {q.row for q in pushed})
    index = {row: i for i, row in enumerate(moved)}
    return moved, tuple(replace(q, row=index[q.row]) for q in pushed)


def told(flight: Reconstruction, left: FloatArray, moved: Sequence[int], count: int, gain: Gain, factor: FloatArray,
         keep: Sequence[int] = (), linear: Responses = NONE, gram: bool = True) -> Evidence:
    """What innovations tell.

    Args:
        left: innovations of the rows `moved`, of `count` in all, perhaps with more behind them [N-1, rows, channels].
        keep, linear: as for `compare`.
        gram: whether inner products are wanted, and not the kept rows alone.
    """
    index = {row: i for i, row in enumerate([*moved, *linear.rows])}
    first = round(SETTLE / flight.dt)
    inner, samples = np.zeros((len(index), len(index))), 0.0
    whitened = np.zeros((len(left), len(MEASURED)))
    kept = np.zeros(((len(left) - first) * len(MEASURED), len(keep)))
    means, worth = Means(flight, first), 1.0 / worth_less(flight)
    at = np.array([(i, index[row]) for i, row in enumerate(keep) if row in index], np.intp).reshape(-1, 2)
    for k in range(first, len(left), CHUNK):
        flat = np.empty((len(left[k : k + CHUNK]) * len(MEASURED), len(index)))
        departures(left[k : k + CHUNK], len(moved), factor[k : k + CHUNK], FARTHEST, flat)
        if linear.rows:
            flat[:, len(moved) :] = linear.values[(k - first) * len(MEASURED) :][: len(flat)]
        whitened[k : k + CHUNK] = flat[:, 0].reshape(-1, len(MEASURED))
        samples += float(np.sum((whitened[k : k + CHUNK] != 0.0) @ worth))
        means.take(flat, k - first)
        kept[(k - first) * len(MEASURED) :][: len(flat), at[:, 0]] = flat[:, at[:, 1]]
        if gram:
            inner += flat.T @ flat
    if means.told:
        inner -= means.energy()
        kept[:, at[:, 0]] -= means.over_time(at[:, 1].tolist())
        whitened[first:] -= means.over_time([0]).reshape(-1, len(MEASURED))
    whole = np.zeros((count, count))
    whole[np.ix_([*index], [*index])] = inner
    return Evidence(whole, gain, factor, samples, whitened, flight, kept)


def flown_rows(flight: Reconstruction, rows: FloatArray, pushed: set[int]) -> list[int]:
    """Row 0 and those that differ from it once surfaces and powers follow the record."""
    kept = held(rows, flight.dt).view(np.uint8).reshape(len(rows), -1)
    moved = np.any(kept != kept[0], axis=1)
    return [j for j in range(len(rows)) if j == 0 or j in pushed or moved[j]]


def choose_gain(flight: Reconstruction, options: list[Gain], pushed: Sequence[Push] = ()) -> Gain:
    """The gust intensity that makes the model's innovations likeliest, between those given by a parabola.

    Their size is taken from medians: a gap that shows as an offset or in the moments of a manoeuvre is no gust. It has
    to be known to a few per cent: where instruments have little noise, a fifth too much of it puts the derivatives by
    sideslip five standard deviations off.

    Args:
        options: in the order of their intensities.
        pushed: generic discrepancies that the model is flown with, whatever their rows.
    """
    scores = likelihoods(flight, options, pushed)
    k = int(np.argmax(scores))
    if k in (0, len(options) - 1):
        return options[k]
    return gains(flight, (_peak([g.sigma for g in options[k - 1 : k + 2]], scores[k - 1 : k + 2]),))[0]


def likelihoods(flight: Reconstruction, options: Sequence[Gain], pushed: Sequence[Push] = ()) -> list[float]:
    """Log likelihood of a sample's innovations with each of some gains, their size taken from medians.

    That of a filter which loses the record is minus infinity: what is lost is constant, and medians would call it calm.
    """
    everywhere = tuple(replace(push, row=i) for push in pushed for i in range(len(options)))
    left = innovations(flight, np.repeat(flight.parameters, len(options)), np.stack([g.K for g in options]), everywhere)
    left = left[round(SETTLE / flight.dt) :]
    seen = np.isfinite(left[:, 0, : FED_BACK - 1])
    use = np.flatnonzero(seen.sum(axis=0) > 0.5 * seen.sum(axis=0).max())
    together = seen[:, use].all(axis=1)
    scores = []
    for i, gain in enumerate(options):
        S = gain.S[np.ix_(use, use)]
        if together.sum() < TOGETHER:  # channels that take turns: each by itself
            factor, white = np.diag(np.sqrt(np.diag(S))), left[:, i, use] / np.sqrt(np.diag(S))
        else:
            factor = np.linalg.cholesky(S)
            white = np.linalg.solve(factor, left[together, i][:, use].astype(float).T).T
        if np.nanmax(np.abs(left[:, i, use]), initial=0.0) >= LOST:
            scores.append(-np.inf)
            continue
        median = np.nanmedian if np.isnan(white).any() else np.median
        away = median(np.abs(white - median(white, axis=0)), axis=0)
        scores.append(-0.5 * float(np.sum((1.4826 * away) ** 2)) - float(np.sum(np.log(np.diag(factor)))))
    return scores


def _peak(sigmas: Sequence[float], scores: Sequence[float]) -> float:
    """Where a parabola in the logarithm through three scores, the middle one the best, is highest."""
    if not np.all(np.isfinite(scores)):
        return sigmas[1]
    at = np.log(sigmas)
    square, slope, _ = np.polyfit(at, scores, 2)
    return float(np.exp(np.clip(-0.5 * slope / square, at[0], at[2]))) if square < 0.0 else sigmas[1]


def whitening(left: FloatArray, gain: Gain, flight: Reconstruction) -> FloatArray:
    """Matrices that make innovations white and of unit size [steps, channels, channels]; zero for absent channels.

    Args:
        left: the model's own innovations [steps, channels].
    """
    n, settled = len(MEASURED), slice(round(SETTLE / flight.dt), None)
    use = np.array([c for c in range(FED_BACK - 1) if flight.has(MEASURED[c])], np.intp)
    out, seen = np.zeros((len(left), n, n)), np.isfinite(left)
    for pattern in np.unique(seen[:, use], axis=0):
        own, at = use[pattern], np.flatnonzero((seen[:, use] == pattern).all(axis=1))
        S = gain.S[at] if gain.S.ndim == 3 else gain.S
        out[np.ix_(at, own, own)] = np.linalg.inv(np.linalg.cholesky(S[..., own[:, None], own]))
    for c in range(FED_BACK - 1, n):
        if flight.has(MEASURED[c]):
            out[:, c, c] = 1.0 / max(_spread(left[settled, c]), NOISE_FLOOR[MEASURED[c]])
    white = whiten(left[:, None], out)[settled, 0]
    for c in use:
        out[:, c] /= max(_spread(white[seen[settled, c], c]), 0.3)
    return out / np.sqrt(worth_less(flight))[:, None]


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
