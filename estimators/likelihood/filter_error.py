"""Filter error: output error for turbulence, with the gust estimated along the way.

A Kalman filter flies the model, the gust of MIL-F-8785C (Dryden form) being two of its states and what the tail meets
of it a third; its innovations are white if the derivatives, the intensity of the gust and the noise of every channel
are right, and their likelihood is maximised over all of them:

    J = 1/2 sum (v^2/s + ln s),    M = sum dv dv'/s + 1/2 sum ds ds'/s^2

with innovations v and variances s taken one measurement after another. In calm air it is output error. Sources:
Jategaonkar, Flight Vehicle System Identification (AIAA 2006), chapter 5; Klein & Morelli, Aircraft System
Identification (AIAA 2006), section 6.2; Maine and Iliff, NASA RP-1168.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.estimate import Estimate
from estimators.likelihood.descent import Point, descend
from estimators.likelihood.equations import FIRST_GUST, STATES, VANE
from estimators.likelihood.inputs import OUTPUTS, flown
from estimators.likelihood.model import COUNT, NAMES, Model, model, quasi_steady
from estimators.likelihood.newton import coloured_covariance
from estimators.likelihood.output_error import FEW, MOST, axes, best_flight, r_squared, starting_values
from estimators.likelihood.report import Found, estimates
from estimators.likelihood.simulate import filtered_flight
from estimators.regression.equations import EXCITED, SURFACES, movement
from estimators.regression.noisy_regressors import white_noise
from estimators.signals.coefficients import Airframe, airframe_of
from estimators.signals.data_checks import check
from estimators.signals.instruments import calibrated, calibration
from estimators.signals.resample import Grid, common_grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray

METHOD = "filter error"
# Standard deviations of the first state: m/s across, rad/s, rad. Within what the first samples tell of it (assumed).
SPREAD = {"longitudinal": (1.0, 0.02, 0.01, 0.01), "lateral": (1.0, 0.02, 0.02, 0.01)}
GUST, DRIVE = 0.3, 1e-5  # start: m/s, rad2/s3 (assumed)
# Unmodelled acceleration across (m2/s3) over the gust's variance: a gust along the path changes the lift by 2 g u/V.
# This is Dryden's spectrum of it at 0.6 rad/s, 72 m/s: of 0.005 to 0.5 the value that biases the pitch derivatives
# least on development flights. And what there always is (assumed).
ALONG, ACROSS = {"longitudinal": 0.05, "lateral": 0.0}, 1e-6
# What is known beforehand, as standard deviations about zero or the start: in turbulence the kinematics no longer tell
# an error of the vane from a gust, and in calm air the record does not show the gust's intensity (assumed).
# Least standard deviation of what is measured, in the order of the outputs: rad, rad/s, m/s2 (assumed: a twentieth of
# what the instruments of the simulation have, so that records smoothed by their owner do not count as exact).
RESOLUTION = {"longitudinal": (1e-4, 1e-4, 1e-4, 0.003, 0.003), "lateral": (1e-4, 1e-4, 1e-4, 1e-4, 0.003)}
WIDE = 3.0  # of the logarithm of an intensity
KNOWN = {"scale": 0.03, "lag": 0.03, "az": 0.1, "ay": 0.1, "lift": 0.05}  # by the last word of a name: 1, s, m/s2, 1
# What the model of the gust leaves unexplained, as a share of each derivative: by how much errors over simulated
# flights in turbulence (development flights of benchmarks.coverage) exceed what the likelihood tells. It enters the
# standard error in so far as the gust exceeds FELT, m/s; what it leaves of the pitching moment is said beyond SAID.
MISFIT = {"CZ_alpha": 0.015, "CZ_q": 0.05, "CZ_elevator": 0.05, "Cm_alpha": 0.015, "Cm_q": 0.03, "Cm_elevator": 0.035,
          "CY_r": 0.025, "CY_rudder": 0.022, "Cl_p": 0.003, "Cl_aileron": 0.003, "Cl_rudder": 0.02}  # fmt: skip
MODEL = {"CZ_alpha": 0.003, "Cl_p": 0.002, "Cl_aileron": 0.0015}  # the same in calm air
FELT, SAID = 0.15, 0.3
VANES = ("alpha_lag", "beta_lag", "gust_lag")
TOLD = 0.003  # s: what is not known of the lag of a vane whose lag the record declares (assumed)
LOG_STEP, LARGEST_LOG, WIDENED, FIRST_STEPS = 0.05, 1.0, 4.0, 10
NEAR = 0.3  # standard errors that may be left to go: intensities that a record hardly shows are found slowly


def identify(record: FlightRecord, start: float | None = None, default: Airframe | None = None) -> dict[str, Estimate]:
    """Derivatives by name as for output error, and `sigma_gust_w`, `sigma_gust_v` (m/s), the gusts' intensity.

    Args:
        start: factor on the published derivatives of the clean aircraft to start from; None starts from equation error.
        default: the airframe for what the record does not state.

    Raises:
        InputError: the record is refused by `data_checks.check` or lacks the channels of both axes.
    """
    record = check(record)
    known = "alpha" in calibration(record.meta.sensors).lags
    record = calibrated(record)
    grid = common_grid(record)
    airframe, first = airframe_of(record, default), starting_values(record, start, default)
    first |= {"gust_lag": 0.0} if known else {}
    result: dict[str, Estimate] = {}
    for axis in axes(grid, record.meta.name):
        flight = flown(grid, airframe, axis)
        starts = tuple(n for n in ("start_w", "start_q", "start_theta", "start_v", "start_p", "start_r", "start_phi"))
        likelihood = begin(model(flight, first, starts, gusts=True), model(flight, first), grid, known)
        moved = any(movement(grid.time, grid.values[n], grid.good((n,))) >= EXCITED for n in SURFACES[axis])
        result.update(estimates(likelihood.found(MOST if moved else FEW), grid, METHOD))
    return result


def begin(plan: Model, free: Model, grid: Grid, known: bool = False) -> Likelihood:
    """The likelihood of `plan` at the likelier of two starts.

    One is where the plan stands, with noise as the second differences of the channels show it, widened; the other where
    a few steps of output error on `free` lead, with what they leave over as noise, which is better in calm air.
    `known`: the vanes' lag was declared, and taken out.
    """
    flight, names = plan.flown, OUTPUTS[plan.flown.axis]
    there = [name for name, column in zip(names, flight.measured.T, strict=True) if np.isfinite(column).any()]
    noise = [max(white_noise(grid.values[name]) * WIDENED / flight.thin, 1e-12) for name in there]
    starts = [Likelihood(plan, np.concatenate((plan.theta0, np.log([GUST, DRIVE, *noise]))), known)]
    best, _ = best_flight(free, FIRST_STEPS)
    values = dict(zip(free.free_names, best.theta, strict=True))
    theta = np.array([values.get(name, value) if name[0] == "C" else value
                      for name, value in zip(plan.free_names, plan.theta0, strict=True)])  # fmt: skip
    starts.append(Likelihood(plan, np.concatenate((theta, np.log([GUST, DRIVE, *best.noise]))), known))
    return min(starts, key=lambda start: float(start.costs(start.start[None])[0]))


@dataclass(frozen=True)
class Likelihood:
    """Of a model's free parameters, then the logarithms of gust intensity, drive and noise variances.

    `start` (p,): where the search begins, and about which the intensities are known beforehand. `known`: whether the
    vanes' lag was declared.
    """

    plan: Model
    start: FloatArray
    known: bool = False

    @property
    def there(self) -> list[int]:
        """Outputs that were measured."""
        return [i for i, column in enumerate(self.plan.flown.measured.T) if np.isfinite(column).any()]

    def fly(self, thetas: FloatArray) -> FloatArray:
        """Innovations and their variances, (2, m, M, outputs that are there)."""
        flight, p, count = self.plan.flown, len(self.plan.free), len(NAMES[self.plan.flown.axis])
        whole, logs = self.plan.spread(thetas[:, :p])[:, :count], np.exp(np.clip(thetas[:, p:], -40.0, 20.0))
        noises, drives = np.ones((len(thetas), flight.measured.shape[1])), np.empty((len(thetas), 3))
        noises[:, self.there] = logs[:, 2:] + np.square(RESOLUTION[flight.axis])[self.there]
        drives[:, 0], drives[:, 2] = logs[:, 0], logs[:, 1]
        drives[:, 1] = ALONG[flight.axis] * logs[:, 0] ** 2 + ACROSS
        first, spread = np.zeros(STATES), np.zeros(STATES)
        first[: COUNT[flight.axis]], spread[:FIRST_GUST] = flight.start, SPREAD[flight.axis]
        first[VANE], spread[VANE] = flight.measured[np.isfinite(flight.measured[:, 0]), 0][0], SPREAD[flight.axis][-1]
        steady = bool(np.isfinite(flight.measured[:: flight.thin, self.there]).all())
        out = filtered_flight(flight.index, np.ascontiguousarray(whole), noises, drives, first, spread, flight.data,
                              flight.inverse, flight.measured, flight.thin, steady, flight.dt)  # fmt: skip
        return np.asarray(out[:, :, :, self.there], dtype=np.float64)

    @property
    def spread(self) -> FloatArray:
        """Standard deviations of what is known beforehand; infinite for the derivatives."""
        known = {**KNOWN, **(dict.fromkeys(VANES, TOLD) if self.known else {})}
        of = [known.get(name, known.get(name.split("_")[-1], np.inf)) if name[0] != "C" else np.inf
              for name in self.plan.free_names]  # fmt: skip
        return np.array([*of, *[WIDE] * (2 + len(self.there))])

    def _prior(self, thetas: FloatArray) -> FloatArray:
        """Distance from what is known beforehand in its standard deviations, shaped as `thetas`."""
        return np.asarray((thetas - self.start) / self.spread, dtype=np.float64)

    def costs(self, thetas: FloatArray) -> FloatArray:
        """J of parameter sets (m, p); infinite where the filter did not hold."""
        v, s = self.fly(thetas)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            cost = 0.5 * np.sum(v * v / s + np.log(s), axis=(1, 2)) + 0.5 * np.sum(self._prior(thetas) ** 2, axis=1)
        return np.asarray(np.where(np.isfinite(cost), cost, np.inf), dtype=np.float64)

    def expand(self, theta: FloatArray, step: FloatArray | None) -> Point:
        """J, gradient and information; as detail the innovations, their variances and whitened slopes (M, k, p)."""
        p, q = len(theta), len(self.plan.free)
        width = np.concatenate((self.plan.step(theta[:q]), np.full(p - q, LOG_STEP))) if step is None else step
        v, s = self.fly(np.concatenate((theta[None], theta + np.diag(width), theta - np.diag(width))))
        if not (np.isfinite(v).all() and np.isfinite(s).all()):
            raise InputError("filter error: the model cannot be flown with these parameters; start elsewhere")
        scale = 2.0 * width[:, None, None]
        root = np.sqrt(s[0])
        dv = ((v[1 : 1 + p] - v[1 + p :]) / scale / root).reshape(p, -1)
        ds = ((s[1 : 1 + p] - s[1 + p :]) / scale / s[0]).reshape(p, -1)
        whitened = (v[0] / root).ravel()
        prior = self._prior(theta)
        gradient = -dv @ whitened - 0.5 * ds @ (1.0 - whitened**2) - prior / self.spread
        information = dv @ dv.T + 0.5 * ds @ ds.T + np.diag(self.spread**-2.0)
        cost = float(0.5 * np.sum(whitened**2) + 0.5 * np.sum(np.log(s[0])) + 0.5 * np.sum(prior**2))
        slopes = np.moveaxis(dv.reshape(p, *root.shape), 0, 2)
        return Point(cost, gradient, information, np.mean(s[0], axis=0), (v[0], s[0], slopes))

    def found(self, most: int) -> Found:
        """The fit in at most so many steps."""
        plan, q, start = self.plan, len(self.plan.free), self.start
        limit = np.where(np.arange(len(start)) < q, np.inf, LARGEST_LOG)
        end = descend(self, start, None, most, limit, NEAR)
        v, s, slopes = end.point.detail
        whole = coloured_covariance(end.inverse, slopes, v / np.sqrt(s), np.ones(v.shape[1]), np.isfinite(v))
        theta, covariance = quasi_steady(plan, end.theta[:q], whole[:q, :q])
        gust = float(np.exp(end.theta[q]))
        names = (*plan.free_names, f"sigma_gust_{'w' if plan.flown.axis == 'longitudinal' else 'v'}")
        felt = gust**2 / (gust**2 + FELT**2)
        share = np.array([np.hypot(felt * MISFIT.get(name, 0.0), MODEL.get(name, 0.0)) for name in plan.free_names])
        wider = np.zeros((q + 1, q + 1))
        wider[:q, :q], wider[q, q] = covariance + np.diag((share * theta) ** 2), gust**2 * whole[q, q]
        measured = plan.flown.measured[:: plan.flown.thin][:, self.there]
        outputs = [OUTPUTS[plan.flown.axis][i] for i in self.there]
        failure = "" if end.converged else f"filter error did not converge: {end.reason}"
        return Found(plan.flown.axis, names, np.append(theta, gust), wider,
                     r_squared(v, measured, outputs), failure, _warning(plan, gust))  # fmt: skip


def _warning(plan: Model, gust: float) -> str:
    """A sentence where gusts are strong enough to bias the pitching moment."""
    if plan.flown.axis != "longitudinal" or gust < SAID:
        return ""
    return (f"in vertical gusts of {gust:.2f} m/s filter error finds Cm_q and Cm_elevator 1 to 2 % too small in "
            "simulation (0.5 to 1 m/s); the standard errors are widened by 3 %")  # fmt: skip
