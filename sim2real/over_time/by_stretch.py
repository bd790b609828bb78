"""Effects of a diagnosis flown once more, each with its size a little off during one stretch of a record alone.

What that makes of the innovations has passed through the same filter as the record: a size may then be told for every
stretch, with the model's own numbers free to give way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from icing_env.record import FloatArray
from sim2real.actuators.paths import path_residuals
from sim2real.library.candidates import NUISANCE_STEP
from sim2real.posterior.sets import firm
from sim2real.prediction.predictor import Predictor, held, lost
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.side_by_side import each
from sim2real.signatures.evidence import Evidence
from sim2real.signatures.means import without_means
from sim2real.signatures.whitening import FARTHEST, SETTLE, departures

SHORTEST, MOST = 5.0, 12  # s of a stretch, and stretches of a record
SHARED, BY_FLIGHT, BY_RECORD = "shared", "per_flight", "per_record"  # as the interface has them


def cut_up(flight: Reconstruction) -> NDArray[np.intp]:
    """Samples between which the stretches of a record lie, but for those in which the predictor settles."""
    first, steps = round(SETTLE / flight.dt), len(flight.time) - 1
    count = int(np.clip((steps - first) * flight.dt / SHORTEST, 1, MOST))
    return np.linspace(first, steps, count + 1).round().astype(np.intp)


def spans(flights: Sequence[Reconstruction], cuts: Sequence[NDArray[np.intp]]) -> Iterator[tuple[int, float, float]]:
    """Record, start and end (s) of every stretch."""
    for i, (flight, cut) in enumerate(zip(flights, cuts, strict=True)):
        time = flight.time + flight.record.time[0]
        yield from ((i, float(time[a]), float(time[b])) for a, b in pairwise(cut))


def responses(evidence: Evidence, rows: NDArray, cut: NDArray[np.intp]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of one record, whitened.

    Args:
        evidence: of the record.
        rows: PARAMETERS in every stretch, as they are and with a step of each size [S, 1 + k].
        cut: samples between which the stretches lie.

    Returns:
        What is left, then what a step of each size during each stretch alone makes of that, stretch after stretch
        [N x channels, 1 + S k]; the same of the paths [N x paths, 1 + S k]; and what a tenth of a deviation of each
        nuisance makes of the channels [N x channels, n or more].
    """
    flight, k, first = evidence.flight, rows.shape[1] - 1, int(cut[0])
    kind = evidence.gusts.kind
    flown = Predictor(flight, np.repeat(rows[0, :1], 1 + k * len(rows)), kind=kind)
    flown.fleet.parameters[1 : 1 + k] = held(rows[0], flight.dt, kind)[1:]  # a first size has been there before
    flown.place(0)
    left = [flown.fly(first, 0, evidence.gain.K)]
    for now, (start, end, own) in zip(rows, _stretches(cut, k), strict=True):
        off = held(now, flight.dt, kind)
        flown.fleet.parameters[:] = off[0]
        flown.fleet.parameters[own] = off[1:]
        left.append(flown.fly(end - start, start, evidence.gain.K))
    kept = lost(np.concatenate(left), np.isfinite(flight.measured[1:]))[first:]
    channels = np.empty((len(kept) * len(MEASURED), kept.shape[1]))
    departures(kept, kept.shape[1], evidence.factor[first:], FARTHEST, channels)
    channels = without_means(channels, flight, first)
    return channels, _of_paths(flight, rows, cut), evidence.rows


def _of_paths(flight: Reconstruction, rows: NDArray, cut: NDArray[np.intp]) -> FloatArray:
    """What paths leave, then what a step of each size makes of that during each stretch [N x paths, 1 + S k]."""
    k = rows.shape[1] - 1
    found = [np.zeros((0, 1 + k * len(rows)))]
    for _, residual, which in path_residuals(flight, rows.ravel()):
        whole = np.repeat(residual[:, :1], rows.size, axis=1)
        whole[:, which] = residual
        path = np.zeros((len(residual), 1 + k * len(rows)))
        for s, (start, end, own) in enumerate(_stretches(cut, k)):
            read = slice(start + 1, end + 1)  # after the steps of the stretch
            now = whole[read, s * (1 + k) : (s + 1) * (1 + k)]
            path[read, 0], path[read, own] = now[:, 0], now[:, 1:] - now[:, :1]
        found.append(path)
    return np.concatenate(found)


def _stretches(cut: NDArray[np.intp], k: int) -> Iterator[tuple[int, int, slice]]:
    """Start and end [samples] of each stretch of a record, and where its rows stand, one for each of `k` sizes."""
    for s, (start, end) in enumerate(pairwise(cut)):
        yield int(start), int(end), slice(1 + s * k, 1 + (s + 1) * k)


def products(made: Sequence[tuple[FloatArray, FloatArray, FloatArray]], precision: FloatArray, nuisances: FloatArray,
             tempering: float) -> FloatArray:  # fmt: skip
    """Inner products of what is left of all records (row 0), nuisances [n], and the steps of all stretches [T k].

    Args:
        made: `responses` of every record.
        precision: prior precision of the nuisances [n, n], which counts as data.
        nuisances: [n] where this was flown.
        tempering: of the evidence.
    """
    n, count = len(nuisances), sum(channels.shape[1] - 1 for channels, _, _ in made)
    gram = np.zeros((1 + n + count, 1 + n + count))
    at = 1 + n
    for channels, paths, slopes in made:
        own = np.r_[0, at : at + channels.shape[1] - 1]
        at += channels.shape[1] - 1
        gram[np.ix_(own, own)] += channels.T @ channels + paths.T @ paths
        given = slopes[:, :n] / NUISANCE_STEP
        gram[1 : 1 + n, 1 : 1 + n] += given.T @ given
        across = given.T @ channels
        gram[1 : 1 + n, own] += across
        gram[own, 1 : 1 + n] += across.T
    gram /= tempering
    gram[1 : 1 + n, 1 : 1 + n] += precision
    gram[1 : 1 + n, 0] += precision @ nuisances
    gram[0, 1 : 1 + n] = gram[1 : 1 + n, 0]
    gram[0, 0] += nuisances @ precision @ nuisances
    return gram


def inwards(sizes: FloatArray, steps: FloatArray | float, low: FloatArray | float,
            high: FloatArray | float) -> FloatArray:  # fmt: skip
    """1 where a step from a size stays within its range, -1 where the step is to be taken the other way."""
    there = sizes + steps
    return np.where((there > high) | (there < low), -1.0, 1.0)


def turned(gram: FloatArray, signs: FloatArray) -> FloatArray:
    """Inner products as if every step, the last rows, had been taken forwards; responses are linear that near."""
    back = np.r_[np.ones(len(gram) - signs.size), signs.ravel()]
    return gram * back * back[:, None]


def flown_products(evidences: Sequence[Evidence], rows: Sequence[NDArray], cuts: Sequence[NDArray[np.intp]],
                   signs: FloatArray, precision: FloatArray, nuisances: FloatArray, tempering: float
                   ) -> FloatArray:  # fmt: skip
    """`products` of all records flown, every step as if it had been taken forwards.

    Args:
        rows, cuts: as for `responses`, of every record.
        signs: 1 or -1 by which each step of `rows` was multiplied (see `inwards`).
    """
    return turned(products(each(responses, evidences, rows, cuts), precision, nuisances, tempering), signs)


def without(gram: FloatArray, steps: FloatArray) -> FloatArray:
    """Inner products of what is left (row 0) and of steps, had what was flown with `steps` been flown without."""
    back = np.eye(len(gram))
    back[1:, 0] = -steps
    return np.asarray(back.T @ gram @ back)


@dataclass(frozen=True)
class Way:
    """One way for a size to depart from a common one: departures of all stretches, one column each [T, q]."""

    scope: str
    in_time: bool
    columns: FloatArray


def ways(flights: Sequence[Reconstruction], cuts: Sequence[NDArray[np.intp]]) -> list[Way]:
    """Ways of departing from a common size, none of them first."""
    owner = np.repeat(np.arange(len(flights)), [len(cut) - 1 for cut in cuts])
    return ways_of(owner, [flight.record.meta.flight for flight in flights])


def ways_of(owner: NDArray[np.intp], flights: Sequence[str]) -> list[Way]:
    """The same of records by their flights; `owner`: record of every stretch [T]."""
    records = np.arange(len(flights))
    flight_of = np.array([flights.index(name) for name in flights])[owner]
    by_flight = (flight_of[:, None] == np.unique(flight_of)).astype(np.float64)
    by_record = (owner[:, None] == records).astype(np.float64)
    in_time = block_diag(*(random_walk(int(np.sum(owner == i))) for i in records))
    found = [Way(SHARED, False, np.zeros((len(owner), 0)))]
    if in_time.shape[1]:
        found.append(Way(SHARED, True, in_time))
    if 1 < by_flight.shape[1] < len(records):
        found.append(Way(BY_FLIGHT, False, by_flight))
    if len(records) > 1:
        found.append(Way(BY_RECORD, False, by_record))
        found += [Way(BY_RECORD, True, np.column_stack([by_record, in_time]))] * (in_time.shape[1] > 0)
    return found


def random_walk(stretches: int) -> FloatArray:
    """Departures from their mean, for a unit of each step of a walk that goes as far as one unit in a record."""
    walk = np.tril(np.ones((stretches, stretches - 1)), -1) / np.sqrt(max(stretches - 1, 1))
    return np.asarray(walk - walk.mean(axis=0))


def gaussian(gram: FloatArray, moves: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Log evidence over none, mean and covariance of unit Gaussian coefficients of `moves` [steps, coefficients].

    Args:
        gram: inner products of what is left (row 0) and of the steps.
    """
    information = firm(moves.T @ gram[1:, 1:] @ moves) + np.eye(moves.shape[1])
    onto = -moves.T @ gram[1:, 0]
    covariance: FloatArray = np.asarray(np.linalg.inv(information), np.float64)
    mean = covariance @ onto
    return 0.5 * float(onto @ mean) - 0.5 * float(np.linalg.slogdet(information)[1]), mean, covariance
