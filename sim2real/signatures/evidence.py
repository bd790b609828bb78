"""Innovations of every candidate along a record, whitened, as one matrix of inner products.

Gust intensity is chosen by the likelihood of the innovations; the noise of every channel is measured on them (from
their differences, which a slow misfit does not touch). Inner products are all that the attribution needs, and those
of several records add.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.actuators.paths import counted, path_gram, path_residuals
from sim2real.library.candidates import Bank, parameter_rows
from sim2real.library.pushes import pushes
from sim2real.library.terms import Term
from sim2real.prediction.as_predicted import as_predicted
from sim2real.prediction.gusts import Gusts
from sim2real.prediction.kalman import Gain, follow
from sim2real.prediction.predictor import Push, held, innovations, with_spare
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.gust_intensity import SIGMAS, choose_gain
from sim2real.signatures.means import Means
from sim2real.signatures.response import Filter, Responses
from sim2real.signatures.whitening import FARTHEST, SETTLE, departures, whitening, worth_less

CHUNK = 500  # samples whitened at a time
NONE = Responses()


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
    def gusts(self) -> Gusts:
        """Those along the record."""
        return self.gain.gusts


def typical(evidences: Sequence[Evidence]) -> Gusts:
    """Gusts of some records' mean intensity; they are of one kind."""
    return Gusts(float(np.mean([e.gusts.sigma for e in evidences])), evidences[0].gusts.kind)


def gather(flight: Reconstruction, bank: Bank, gain: Gain | None = None) -> Evidence:
    """Fly every candidate along one record; the rows of `bank.linear` are kept themselves.

    Args:
        gain: of the predictor; the likeliest of SIGMAS if omitted.
    """
    if gain is None:
        gain = follow(flight, choose_gain(flight, SIGMAS))
    base = innovations(flight, flight.parameters, gain.K, (), gain.gusts.kind)[:, 0]
    factor = whitening(base, gain, flight)
    about = Filter(as_predicted(flight, base, gain), gain, factor, round(SETTLE / flight.dt))
    with np.errstate(over="ignore", invalid="ignore"):  # of a model that departs: see `settling.departs`
        known = about.respond(pushes(about.flight, bank.terms))
        found = compare(flight, parameter_rows(flight, bank), gain, factor, bank.terms, bank.linear, known)
    return replace(found, linear=about)


def compare(flight: Reconstruction, rows: NDArray, gain: Gain, factor: FloatArray, terms: Sequence[Term] = (),
            keep: Sequence[int] = (), linear: Responses = NONE) -> Evidence:
    """Inner products of rows flown along one record, the first being the one that the others are compared with.

    Args:
        terms: generic ones, of which those of a path are judged there.
        keep: rows that are wanted themselves.
        linear: rows whose response is known and that are not flown.
    """
    found, first = flown(flight, rows, (), gain, factor, keep, linear), round(SETTLE / flight.dt)
    samples = sum(counted(flight, component, first) for component, _, _ in path_residuals(flight, rows[:1]))
    return replace(found, gram=found.gram + path_gram(flight, rows, terms, first), samples=found.samples + samples)


def flown(flight: Reconstruction, rows: NDArray, pushed: tuple[Push, ...], gain: Gain, factor: FloatArray,
          keep: Sequence[int] = (), linear: Responses = NONE) -> Evidence:
    """The same but for the paths, which do not care how the aircraft flies."""
    moved, renamed = to_fly(flight, rows, pushed)
    left = with_spare(flight, np.take(rows, moved), gain.K, renamed, gain.gusts.kind)
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
