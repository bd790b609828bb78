"""Effects of a diagnosis flown once more, each with its size a little off during one stretch of a record alone.

What that makes of the innovations has passed through the same filter as the record: a size may then be told for every
stretch, with the model's own numbers free to give way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.candidates import NUISANCE_STEP, Bank, shifted
from sim2real.courses import projected
from sim2real.evidence import SETTLE, Evidence, whiten
from sim2real.means import without_means
from sim2real.paths import path_residuals
from sim2real.predictor import Predictor, held
from sim2real.reconstruct import Reconstruction
from sim2real.remedy import Remedy
from sim2real.sets import SetFit
from sim2real.steps import size_steps

SHORTEST, MOST = 5.0, 12  # s of a stretch, and stretches of a record


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


def stepped(flight: Reconstruction, candidates: Bank, nuisances: FloatArray, fit: SetFit, change: Remedy) -> NDArray:
    """PARAMETERS with the explanation in them: as it is, then a step (`size_steps`) of each size."""
    base = shifted(flight.parameters, candidates.nuisances, nuisances, flight.power_from)
    steps = size_steps(fit, np.array(fit.estimate))
    values: dict[str, dict[str, float | FloatArray]] = {name: {**own} for name, own in change.values.items()}
    for m, family in enumerate(fit.families):
        sizes = np.full(1 + len(steps), fit.estimate[m])
        sizes[1 + m] += steps[m]
        values[family.effect.name][family.parameter.name] = sizes
    return effects.with_effects(np.repeat(base, 1 + len(steps)), values)


def responses(evidence: Evidence, rows: NDArray, cut: NDArray[np.intp]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of one record, whitened.

    Returns:
        What the explanation leaves, then what a step of each size during each stretch alone makes of that, stretch
        after stretch [N x channels, 1 + S k]; the same of the paths [N x paths, 1 + S k]; and what a deviation of each
        nuisance makes of the channels [N x channels, n].
    """
    flight, k, first = evidence.flight, len(rows) - 1, int(cut[0])
    flown = Predictor(flight, np.repeat(rows[:1], 1 + k * (len(cut) - 1)))
    off = held(rows, flight.dt)
    flown.place(0)
    left = [flown.fly(first, 0, evidence.gain.K)]
    for start, end, own in _stretches(cut, k):
        flown.fleet.parameters[own] = off[1:]
        left.append(flown.fly(end - start, start, evidence.gain.K))
        flown.fleet.parameters[own] = off[:1]
    white = whiten(np.concatenate(left), evidence.factor)[first:]
    white[:, 1:] -= white[:, :1]
    channels = without_means(np.swapaxes(white, 1, 2).reshape(-1, white.shape[1]), flight, first)
    paths = [np.zeros((0, white.shape[1]))]
    for _, residual, which in path_residuals(flight, rows):
        path = np.zeros((len(residual), white.shape[1]))
        path[first:, 0] = residual[first:, 0]
        departures = np.zeros((len(residual), k))
        departures[:, np.array(which[1:], np.intp) - 1] = residual[:, 1:] - residual[:, :1]
        for start, end, own in _stretches(cut, k):
            path[start:end, own] = departures[start:end]
        paths.append(path)
    return channels, np.concatenate(paths), evidence.rows


def _stretches(cut: NDArray[np.intp], k: int) -> Iterator[tuple[int, int, slice]]:
    """Start and end [samples] of each stretch of a record, and where its rows stand, one for each of `k` sizes."""
    for s, (start, end) in enumerate(pairwise(cut)):
        yield int(start), int(end), slice(1 + s * k, 1 + (s + 1) * k)


def inner(made: Sequence[tuple[FloatArray, FloatArray, FloatArray]], precision: FloatArray, nuisances: FloatArray,
          tempering: float) -> FloatArray:
    """Inner products of what is left of all records and of the steps of all stretches [1 + T k], nuisances free."""
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
    return projected(gram, 1 + n)
