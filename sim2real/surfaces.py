"""Where a surface was: behind its command where that says it better than the noisy recorded position.

Noise of a position drives the model as if the surface shook, and the predictor then forgets what a steady moment does.
Commands are exact. Where a smooth law from the command (its actuator at the best lag, geared, shifted, bent, drifting)
leaves nothing of the recorded position but white noise, the surface was where that law has it, where the position was
not recorded too; else where it was recorded, noise and all.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from icing_env.record import FloatArray
from sim2real.channels import SURFACES
from sim2real.paths import LAGS, UNFILTERED, follow, spread
from sim2real.reconstruct import Reconstruction

PLACED = 3e-5  # rad, what such a law leaves (assumed: a position's noise over the root of the samples behind a term)
DRIFTS = 6  # cosines over a record that a law's shift may take
SCALES = (5, 25, 100)  # samples over which what is left has to average out as white noise does
SHORTEST, FINE = 1e-3, 1e-4  # s: least lag, and how finely it is found
CHANCE = 4.0  # deviations of a mean square by chance that still pass for white


def placed(flight: Reconstruction) -> Reconstruction:
    """The record with every surface where its command puts it, if nothing but white noise is between."""
    controls, noise = dict(flight.controls), flight.surface_noise.copy()
    for j, surface in enumerate(SURFACES):
        command = flight.commands.get(f"{surface}_command")
        recorded = flight.positions[surface][np.isfinite(flight.positions[surface])]
        if command is None or not np.any(recorded != recorded[:1]):
            continue  # not recorded, one or the other
        law = _law(flight, command, surface)
        if law is not None:
            controls[surface], noise[j] = law, PLACED
    return replace(flight, controls=controls, surface_noise=noise)


def _law(flight: Reconstruction, command: FloatArray, surface: str) -> FloatArray | None:
    """Positions [N] before the recording's low pass, as the command makes them; None if they were not those."""
    good, published = np.isfinite(flight.positions[surface]), float(flight.parameters[f"{surface}_lag"][0])
    recorded = flight.positions[surface][good]

    def behind(lag: float, filtered: bool = True) -> FloatArray:
        row = flight.parameters.copy()
        row[f"{surface}_lag"] = lag
        if not filtered:
            row["filter_frequency"] = UNFILTERED
        return _basis(follow(command, recorded[0], row, surface, flight.dt)[:, 0])

    def left(lag: float) -> FloatArray:
        basis = behind(lag)[good]
        return np.asarray(recorded - basis @ np.linalg.lstsq(basis, recorded, rcond=None)[0])

    def square(lag: float) -> float:
        return float(np.sum(left(lag) ** 2))

    lags = np.unique(np.maximum(published + LAGS, SHORTEST))
    k = int(np.argmin([square(lag) for lag in lags]))
    near = (lags[max(k - 1, 0)], lags[min(k + 1, len(lags) - 1)])
    lag = float(minimize_scalar(square, bounds=near, method="bounded", options={"xatol": FINE}).x)
    if not _white(left(lag)):
        return None
    weights = np.linalg.lstsq(behind(lag)[good], recorded, rcond=None)[0]
    return np.asarray(behind(lag, filtered=False) @ weights)


def _basis(position: FloatArray) -> FloatArray:
    """What a smooth law may make of a position [N, terms]: gear, bend, advance, shift and drift."""
    n = len(position)
    slow = np.cos(np.pi * np.arange(DRIFTS + 1) * (np.arange(n)[:, None] + 0.5) / n)
    rate = np.gradient(position)
    return np.column_stack([position, position**3, rate, np.gradient(rate), slow])


def _white(left: NDArray) -> bool:
    """Whether means over SCALES of samples are as small as the means of white noise."""
    square = max(spread(left), 1e-9) ** 2
    for m in SCALES:
        if (count := len(left) // m) == 0:
            continue  # a short record
        means = left[: count * m].reshape(count, m).mean(axis=1)
        if np.mean(means**2) * m > square * (1.0 + CHANCE * np.sqrt(2.0 / count)):
            return False
    return True
