"""Output error in the frequency domain: only the band in which the aircraft answers its controls is fitted.

Measured and flown outputs are compared by their Fourier coefficients between LOWEST and HIGHEST; slow drifts, the boom
at 7 Hz and most of the noise lie outside. Mean and trend are two rows more, from which the constants follow. The rows
are orthonormal, so that white noise has one variance in all, and 1/T apart, so that it is independent. Source:
Klein & Morelli, Aircraft System Identification (AIAA 2006), chapter 7, band of example 7.1; there the model is
transformed too, here it is flown in time and then transformed, for its flight condition varies.
"""

from __future__ import annotations

import numpy as np

from estimators.estimate import Estimate
from estimators.likelihood.control_noise import with_control_noise
from estimators.likelihood.inputs import OUTPUTS, flown
from estimators.likelihood.model import Model, quasi_steady
from estimators.likelihood.newton import fit
from estimators.likelihood.output_error import FEW, MODELS, MOST, axes, plan_of, present, r_squared, starting_values
from estimators.likelihood.output_error import turbulence as turbulence_in
from estimators.likelihood.report import Found, estimates
from estimators.regression.equations import EXCITED, SURFACES, movement
from estimators.signals.coefficients import Airframe, airframe_of
from estimators.signals.data_checks import check
from estimators.signals.instruments import calibrated
from estimators.signals.resample import common_grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray

LOWEST, HIGHEST = 0.1, 1.5  # Hz


def identify(
    record: FlightRecord, start: float | None = 1.0, structure: str = "full", default: Airframe | None = None
) -> dict[str, Estimate]:
    """Derivatives by name; arguments and errors as for output error in time."""
    if structure not in MODELS:
        raise InputError(f"identify: structure '{structure}' is unknown; valid are: {', '.join(MODELS)}")
    record = calibrated(check(record))
    grid = common_grid(record)
    airframe, first = airframe_of(record, default), starting_values(record, start, default)
    result: dict[str, Estimate] = {}
    for axis in axes(grid, record.meta.name):
        plan = plan_of(flown(grid, airframe, axis, smooth=False), first, structure)
        moved = any(movement(grid.time, grid.values[n], grid.good((n,))) >= EXCITED for n in SURFACES[axis])
        result.update(estimates(_fitted(plan, MOST if moved else FEW), grid, f"frequency domain, {structure}"))
    return result


def band_rows(steps: int, dt: float) -> FloatArray:
    """Orthonormal rows (M, N) that take the mean, the trend and the band out of N samples `dt` (s) apart.

    Raises:
        InputError: the record is too short to hold three frequencies of the band.
    """
    time, duration = (np.arange(steps) - 0.5 * (steps - 1)) * dt, steps * dt
    first, last = int(np.ceil(LOWEST * duration)), int(np.floor(min(HIGHEST, 0.4 / dt) * duration))
    if last - max(first, 1) < 2:
        raise InputError(f"frequency domain: {duration:.3g} s hold too few frequencies between {LOWEST:g} and "
                         f"{HIGHEST:g} Hz; at least 2 s are needed")  # fmt: skip
    angles = 2.0 * np.pi * np.outer(np.arange(max(first, 1), last + 1) / duration, time)
    rows = np.concatenate((np.ones((1, steps)), time[None], np.cos(angles), np.sin(angles)))
    return np.asarray(np.linalg.qr(rows.T)[0].T, dtype=np.float64)


def _fitted(plan: Model, most: int) -> Found:
    """The axis fitted in at most so many steps, over the outputs that are there; gaps are bridged."""
    flight = plan.flown
    there = present(flight)
    rows = band_rows(len(flight.data), flight.dt)
    known = np.isfinite(flight.measured[:, there])

    def transform(outputs: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("fn,mnk->mfk", rows, np.where(known, outputs, 0.0), optimize=True))

    def simulate(thetas: FloatArray) -> FloatArray:
        return transform(plan.simulate(thetas)[:, :, there])

    measured = np.where(known, flight.measured[:, there], 0.0)
    best = fit(simulate, plan.theta0, transform(measured[None])[0], step=plan.step(plan.theta0), most=most)
    outputs = [o for o, t in zip(OUTPUTS[flight.axis], there, strict=True) if t]
    theta, covariance = quasi_steady(plan, best.theta, with_control_noise(plan, best, there, rows))
    failure = "" if best.converged else f"output error in the band did not converge: {best.reason}"
    left = np.where(known, measured - plan.simulate(best.theta[None])[0][:, there], 0.0)
    r2 = r_squared(best.residual[2:], transform(measured[None])[0][2:], outputs)
    return Found(flight.axis, plan.free_names, theta, covariance, r2, failure, turbulence_in(left[:, 0], flight))
