"""Where a surface was: behind its command where that says it better than the noisy recorded position.

Noise of a position drives the model as if the surface shook, and the predictor then forgets what a steady moment does.
Commands are exact. Where a smooth law from the command (its actuator at the best lag, geared, shifted, bent, drifting)
leaves nothing of the recorded position but white noise, the surface was where that law has it, where the position was
not recorded too; else where it was recorded, noise and all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from icing_env.record import FloatArray
from sim2real.actuators.paths import POSITION_NOISE, follow
from sim2real.actuators.timing import LAGS
from sim2real.records.channels import SURFACES
from sim2real.records.instruments import UNFILTERED
from sim2real.records.noise import white
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.rounding import SEVERAL, rounding

PLACED = 3e-5  # rad, what a fitted law leaves (assumed: a position's noise over the root of the samples behind a term)
EXACT = 3e-6  # rad, the same of a law of which nothing but the lag is fitted (assumed)
RATE, DRIFTS = 3, 6  # its column in a basis; cosines over a record that a law's shift may take
SCALES = (5, 25, 100)  # samples over which what is left has to average out as white noise does
SHORTEST, FINE = 1e-3, 1e-4  # s: least lag, and how finely it is found
CHANCE, SURE = 1e-5, 1.05  # of white noise not to pass for it; what the noise itself may be off by (squared)


def placed(flight: Reconstruction) -> Reconstruction:
    """The record with every surface where its command puts it, if nothing but white noise is between."""
    controls, noise = dict(flight.controls), flight.surface_noise.copy()
    for j, surface in enumerate(SURFACES):
        command = flight.commands.get(f"{surface}_command")
        recorded = flight.positions[surface][np.isfinite(flight.positions[surface])]
        if command is not None and not len(recorded):
            controls[surface] = _behind(flight, command, surface, flight.parameters[f"{surface}_lag"][0], False)
            continue  # nothing says how well it follows: as uncertain as if it had been recorded
        if command is None or not np.any(recorded != recorded[:1]):
            continue  # not recorded, or stuck
        law = _law(flight, command, surface)
        if law is not None:
            controls[surface], noise[j] = law
    return replace(flight, controls=controls, surface_noise=noise)


def _law(flight: Reconstruction, command: FloatArray, surface: str) -> tuple[FloatArray, float] | None:
    """Positions [N] before the recording's low pass, as the command makes them, and how well they are known.

    The simplest law that says it: the published actuator, the same at another lag, geared and shifted, bent and
    drifting too. Every number fitted costs the logarithm of the samples (Schwarz, Annals of Statistics 6, 1978), for it
    is fitted to noise: a shift of 4e-5 rad of an aileron, held for 40 s, is a rolling moment that everybody can see.
    """
    good, published = np.isfinite(flight.positions[surface]), float(flight.parameters[f"{surface}_lag"][0])
    recorded, n = flight.positions[surface][good], int(np.count_nonzero(good))
    least = rounding(recorded, SEVERAL)
    known = max(1.0, least / POSITION_NOISE)  # times which what is left by a law is as large

    def behind(lag: float, filtered: bool = True) -> FloatArray:
        return _basis(_behind(flight, command, surface, lag, filtered))

    def weights(lag: float, terms: int) -> FloatArray:
        """Of the basis' first terms; the position itself where none is fitted."""
        basis = behind(lag)[good]
        out = np.eye(basis.shape[1])[0]
        if terms:
            out = np.zeros(basis.shape[1])
            out[:terms] = np.linalg.lstsq(basis[:, :terms], recorded, rcond=None)[0]
        return out

    def left(lag: float, terms: int) -> FloatArray:
        return np.asarray(recorded - behind(lag)[good] @ weights(lag, terms))

    def square(lag: float, terms: int) -> float:
        return float(np.sum(left(lag, terms) ** 2))

    if _published(left(published, 0), behind(published)[good], least):
        return behind(published, filtered=False)[:, 0], EXACT * known
    every = behind(published).shape[1]
    laws = [(published, 0, 0), *((_lag(square, terms, published), terms, terms + 1) for terms in (0, 2, every))]
    noise = max(white(left(laws[-1][0], every)), least, 1e-9)
    fitting = [law for law in laws if _nothing_else(left(*law[:2]), least)]
    if not fitting:
        return None
    lag, terms, _ = min(fitting, key=lambda law: square(*law[:2]) / noise**2 + law[2] * np.log(n))
    return np.asarray(behind(lag, filtered=False) @ weights(lag, terms)), (PLACED if terms else EXACT) * known


def _behind(flight: Reconstruction, command: FloatArray, surface: str, lag: float, filtered: bool) -> FloatArray:
    """Positions [N] of the published actuator at some lag, behind the recording's low pass or before it."""
    row = flight.parameters.copy()
    row[f"{surface}_lag"] = lag
    if not filtered:
        row["filter_frequency"] = UNFILTERED
    return follow(command, command[0], row, surface, flight.dt)[:, 0]


def _published(left: FloatArray, basis: FloatArray, least: float) -> bool:
    """Whether nothing need be fitted: what the published actuator leaves is white, and no other law says it better.

    Another lag is to first order an advance.
    """
    square, cost = max(white(left), least, 1e-9) ** 2, np.log(len(left))

    def gain(columns: FloatArray) -> float:
        fitted = columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
        return float(fitted @ fitted) / square

    return _nothing_else(left, least) and gain(basis[:, RATE : RATE + 1]) < cost and gain(basis) < 3.0 * cost


def _lag(square: Callable[[float, int], float], terms: int, published: float) -> float:
    """The lag that leaves least."""
    lags = np.unique(np.maximum(published + LAGS, SHORTEST))
    k = int(np.argmin([square(lag, terms) for lag in lags]))
    near = (lags[max(k - 1, 0)], lags[min(k + 1, len(lags) - 1)])
    return float(minimize_scalar(square, bounds=near, args=(terms,), method="bounded", options={"xatol": FINE}).x)


def _basis(position: FloatArray) -> FloatArray:
    """What a smooth law may make of a position [N, terms]: gear, bend, advance, shift and drift."""
    n = len(position)
    slow = np.cos(np.pi * np.arange(DRIFTS + 1) * (np.arange(n)[:, None] + 0.5) / n)
    rate = np.gradient(position)
    return np.column_stack([position, slow[:, 0], position**3, rate, np.gradient(rate), slow[:, 1:]])


def _nothing_else(left: NDArray, least: float) -> bool:
    """Whether means over SCALES of samples are as small as the means of white noise, of `least` or more."""
    square = max(white(left), least, 1e-9) ** 2
    for m in SCALES:
        if (count := len(left) // m) == 0:
            continue  # a short record
        means = left[: count * m].reshape(count, m).mean(axis=1)
        if np.mean(means**2) * m > SURE * square * chi2.ppf(1.0 - CHANCE, count) / count:
            return False
    return True
