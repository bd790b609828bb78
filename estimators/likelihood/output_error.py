"""Output error: derivatives under which free flight through the recorded inputs comes nearest to what was measured.

Two models. `full` flies the record's own airspeed and attitude, keeps CZ_q and CY_p, and estimates what the instruments
add with the derivatives. `textbook` is that of Klein & Morelli's printed results (Aircraft System Identification, AIAA
2006, example 6.1, and SIDPAC's demonstration): no CZ_q, no CY_p and no error of the instruments but biases, and
laterally a constant flight condition.
Output error has no process noise: in turbulence its residuals are long waves and its intervals too narrow, which the
estimates then say (`Estimate.warning`); filter error is the method for such records.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimators.airframe import published_airframe
from estimators.estimate import Estimate
from estimators.likelihood.control_noise import with_control_noise
from estimators.likelihood.equations import ROW_LATERAL
from estimators.likelihood.inputs import CUTOFF, OUTPUTS, Flown, flown
from estimators.likelihood.model import Model, model, quasi_steady
from estimators.likelihood.newton import MaximumLikelihood, fit
from estimators.likelihood.report import Found, estimates
from estimators.regression import equation_error
from estimators.regression.equations import EXCITED, NEEDED, SURFACES, movement
from estimators.signals.coefficients import Airframe, airframe_of
from estimators.signals.data_checks import check
from estimators.signals.instruments import calibrated
from estimators.signals.resample import Grid, common_grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray

MODELS = ("full", "textbook")
PLAIN = ("CZ_q", "CY_p", "alpha_scale", "beta_scale", "alpha_lag", "beta_lag", "theta_lag",
         "phi_lag", "bias_q", "bias_p", "start_phi")  # fmt: skip
VARYING = ("aileron", "rudder")  # what a constant flight condition leaves as it was
WAVES, GUST = 2.0, 0.08  # in calm simulated flights 1.1 to 1.3 and 0.05 m/s; at sigma_w 0.5 m/s above 3 and 0.15
MOST, FEW = 50, 2  # steps; few where no control moved, since nothing found there is told
NIL = ("angle", "gravity", "roll_pq", "roll_qr", "yaw_qr", "yaw_pq", "kinematic")


def identify(
    record: FlightRecord,
    start: float | None = 1.0,
    structure: str = "full",
    default: Airframe | None = None,
) -> dict[str, Estimate]:
    """Derivatives by name (CZ_alpha, CL_alpha, Cm_q, CD_0, CY_beta, ..., per rad; biases and instrument errors too).

    Args:
        start: factor on the published derivatives of the clean aircraft to start from; None starts from equation error.
        structure: "full" or "textbook".
        default: the airframe for what the record does not state.

    Raises:
        InputError: the record is refused by `data_checks.check` or lacks the channels of both axes.
    """
    if structure not in MODELS:
        raise InputError(f"identify: structure '{structure}' is unknown; valid are: {', '.join(MODELS)}")
    record = calibrated(check(record))
    grid = common_grid(record)
    airframe, first = airframe_of(record, default), starting_values(record, start, default)
    result: dict[str, Estimate] = {}
    for axis in axes(grid, record.meta.name):
        plan = plan_of(flown(grid, airframe, axis, structure == "full"), first, structure)
        moved = any(movement(grid.time, grid.values[n], grid.good((n,))) >= EXCITED for n in SURFACES[axis])
        result.update(estimates(_fitted(plan, MOST if moved else FEW), grid, f"output error, {structure}"))
    return result


def axes(grid: Grid, name: str) -> list[str]:
    """Axes whose channels the record holds; InputError where there is none."""
    lacks = {axis: [n for n in needed if n not in grid.values] for axis, needed in NEEDED.items()}
    if all(lacks.values()):
        told = "; ".join(f"{axis} needs {', '.join(names)}" for axis, names in lacks.items())
        raise InputError(f"record '{name}' lacks columns: {told}")
    return [axis for axis, missing in lacks.items() if not missing]


def starting_values(record: FlightRecord, start: float | None, default: Airframe | None = None) -> dict[str, float]:
    """Derivatives to start from: the published ones times `start`, or those of equation error where they are seen."""
    published = published_airframe()[0]
    values = {name: float(published[name]) for name in published.dtype.names if name[:2] in ("CX", "CZ", "Cm", "CY",
                                                                                           "Cl", "Cn")}  # fmt: skip
    if start is not None:
        return {name: start * value for name, value in values.items()}
    found = equation_error.identify(record, default=default)
    return {name: found[name].estimate if name in found and found[name].identifiable else value
            for name, value in values.items()}  # fmt: skip


def plan_of(flown_axis: Flown, first: dict[str, float], structure: str) -> Model:
    """The free parameters of one axis, and where they start."""
    if structure == "full":
        return model(flown_axis, first)
    first = {**first, "CZ_q": 0.0, "CY_p": 0.0, "Cm_alphadot": 0.0}
    if flown_axis.axis == "longitudinal":
        return model(flown_axis, first, PLAIN)
    plan = model(_constant(flown_axis), first, PLAIN)
    return replace(plan, free=tuple(sorted((*plan.free, plan.names.index("bias_phi")))))


def _constant(flown_axis: Flown) -> Flown:
    """The lateral axis at the record's mean flight condition, linearised about zero bank and sideslip."""
    data = flown_axis.data.copy()
    for i, name in enumerate(ROW_LATERAL):
        if name not in VARYING:
            data[:, i] = 0.0 if name in NIL else np.mean(data[:, i])
    return replace(flown_axis, data=data)


def _fitted(plan: Model, most: int) -> Found:
    """The axis fitted in at most so many steps, over the outputs that are there."""
    best, there = best_flight(plan, most)
    outputs = [o for o, t in zip(OUTPUTS[plan.flown.axis], there, strict=True) if t]
    failure = "" if best.converged else f"output error did not converge: {best.reason}"
    r2 = r_squared(best.residual, plan.flown.measured[:: plan.flown.thin, there], outputs)
    theta, covariance = quasi_steady(plan, best.theta, with_control_noise(plan, best, there))
    warning = turbulence(np.repeat(best.residual[:, 0], plan.flown.thin), plan.flown)
    return Found(plan.flown.axis, plan.free_names, theta, covariance, r2, failure, warning)


def best_flight(plan: Model, most: int = MOST) -> tuple[MaximumLikelihood, NDArray[np.bool_]]:
    """The fit of a model in at most so many steps, and which outputs (5,) were there to be fitted."""
    there = present(plan.flown)

    def simulate(thetas: FloatArray) -> FloatArray:
        return plan.simulate(thetas)[:, :: plan.flown.thin, there]

    measured = plan.flown.measured[:: plan.flown.thin, there]
    return fit(simulate, plan.theta0, measured, step=plan.step(plan.theta0), most=most), there


def present(flight: Flown) -> NDArray[np.bool_]:
    """Which outputs (5,) were measured."""
    return np.asarray(np.isfinite(flight.measured).any(axis=0), dtype=np.bool_)


def r_squared(residual: FloatArray, measured: FloatArray, outputs: list[str]) -> dict[str, float]:
    """1 - sum v2 / sum (z - zbar)2 of each output."""
    total = np.nansum((measured - np.nanmean(measured, axis=0)) ** 2, axis=0)
    return dict(zip(outputs, (1.0 - np.sum(residual**2, axis=0) / np.maximum(total, 1e-300)).tolist(), strict=True))


def turbulence(residual: FloatArray, flight: Flown) -> str:
    """A sentence where the flow angle's residual (N,) at the flight's rate is long waves of more than calm air has."""
    apart = max(1, int(0.5 / (CUTOFF * flight.dt)))
    v = residual[: len(residual) // apart * apart].reshape(-1, apart).mean(axis=1)
    waves = float(np.var(v) / max(0.5 * np.var(np.diff(v)), 1e-300))  # 1 for white noise
    gust = flight.airspeed * float(np.std(v))
    if waves < WAVES or gust < GUST:
        return ""
    return (f"the flow angle leaves the model in long waves of {gust:.2f} m/s, as in turbulence, which output error "
            "does not know: bias and too narrow intervals are likely; use filter_error")  # fmt: skip
