"""What noise on the recorded controls does to output error.

The model is flown with the controls as measured; their noise moves it, and the residual then holds a free oscillation
of the aircraft, as slow and as little damped as its motion. Its autocorrelation is too long to be read from one record,
but follows from the noise of the control and the model: y = G n, Cov gains M^-1 S'R^-1 G q G' R^-1 S M^-1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from estimators.likelihood.inputs import COLUMNS, SURFACES
from estimators.likelihood.model import NAMES, Model
from estimators.likelihood.newton import MaximumLikelihood
from estimators.likelihood.simulate import free_flight
from icing_env.record import FloatArray

PULSE = 1e-3  # rad


def with_control_noise(
    plan: Model, best: MaximumLikelihood, there: NDArray[np.bool_], rows: FloatArray | None = None
) -> FloatArray:
    """Covariance (p, p): the larger of that found from the residual and that expected from the noise.

    Args:
        plan: the model that was fitted.
        best: the fit.
        there: (5,) outputs that were fitted.
        rows: (M, N) what was fitted of the samples; every `thin`-th by default.
    """
    steps, thin = len(plan.flown.data), plan.flown.thin
    weighted = np.zeros((steps, *best.sensitivity.shape[1:]))
    if rows is None:
        weighted[::thin] = best.sensitivity / best.noise[:, None]
    else:
        weighted[:] = np.tensordot(rows.T, best.sensitivity / best.noise[:, None], axes=1)
    size = next_fast_len(2 * steps, real=True)
    spectrum = rfft(weighted, size, axis=0)
    middle = np.zeros_like(best.covariance)
    for response, variance in zip(_responses(plan, best.theta), plan.flown.noise, strict=True):
        answer = np.conj(rfft(response[:, there], size, axis=0))
        reached = irfft(np.einsum("fkp,fk->fp", spectrum, answer), size, axis=0)
        middle += variance * reached.T @ reached
    expected = best.covariance_white + best.covariance_white @ middle @ best.covariance_white
    lift = np.sqrt(np.maximum(np.diag(expected) / np.maximum(np.diag(best.covariance), 1e-300), 1.0))
    return np.asarray(best.covariance * np.outer(lift, lift), dtype=np.float64)


def _responses(plan: Model, theta: FloatArray) -> list[FloatArray]:
    """Outputs (N, 5) that follow a pulse of one sample on each surface, per rad."""
    flown, whole, count = plan.flown, plan.spread(theta[None]), len(NAMES[plan.flown.axis])
    flights = []
    for surface in (None, *SURFACES[flown.axis]):
        data = np.repeat(flown.data.mean(axis=0)[None], len(flown.data), axis=0)
        if surface is not None:
            data[1, COLUMNS[flown.axis].index(surface)] += PULSE
        parameters, start = np.ascontiguousarray(whole[:, :count]), np.zeros((1, whole.shape[1] - count))
        flights.append(free_flight(flown.index, parameters, start, data, flown.inverse, flown.dt)[0])
    return [np.roll(flight - flights[0], -1, axis=0) / PULSE for flight in flights[1:]]
