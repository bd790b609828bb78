"""A recorded flight flown again with identified derivatives: how well they explain it, or predict one not used.

Free flight through the recorded controls by the equations of `estimators.likelihood`. The derivatives stay as they
are; the first state, the constant coefficients and constant errors of the instruments are fitted to the record that is
flown, since trim and datum differ from record to record (Klein & Morelli, Aircraft System Identification, AIAA 2006,
section 11.3 on prediction).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimators.airframe import published_airframe
from estimators.estimate import Estimate
from estimators.likelihood.inputs import OUTPUTS, flown
from estimators.likelihood.model import NAMES, Model, model
from estimators.likelihood.newton import fit
from estimators.regression.equations import NEEDED
from estimators.signals.coefficients import Airframe, airframe_of
from estimators.signals.data_checks import check
from estimators.signals.resample import common_grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray

DATUM = ("start_", "bias_")  # what is fitted besides the constant coefficients
CONSTANT = ("CZ_0", "Cm_0", "CX_0", "CY_0", "Cl_0", "Cn_0")


@dataclass(frozen=True)
class FlownAgain:
    """One axis of a record and the flight that derivatives give.

    Attributes:
        axis: "longitudinal" or "lateral".
        time: s, shape (N,).
        measured, simulated: by channel, shape (N,).
        r2: share of each channel's variance explained.
    """

    axis: str
    time: FloatArray
    measured: Mapping[str, FloatArray]
    simulated: Mapping[str, FloatArray]
    r2: Mapping[str, float]

    @property
    def residual(self) -> dict[str, FloatArray]:
        """Measured less simulated, by channel."""
        return {name: self.measured[name] - self.simulated[name] for name in self.measured}


def fly_again(record: FlightRecord, estimates: Mapping[str, Estimate], default: Airframe | None = None
              ) -> list[FlownAgain]:
    """Fly every axis that the record has the channels for and the estimates the derivatives of.

    Raises:
        InputError: the record is refused by `data_checks.check`, or the derivatives give a flight that diverges.
    """
    record = check(record)
    grid = common_grid(record)
    airframe, known = airframe_of(record, default), derivatives(estimates)
    found = []
    for axis, needed in NEEDED.items():
        moment = "Cm_alpha" if axis == "longitudinal" else "Cn_beta"
        if moment not in known or any(name not in grid.values for name in needed):
            continue
        one = flown(grid, airframe, axis, smooth=False)
        plan = model(one, {**published(), **known})
        loose = tuple(i for i in plan.free if plan.names[i].startswith(DATUM) or plan.names[i] in CONSTANT)
        plan = replace(plan, free=loose)
        there = np.flatnonzero(np.isfinite(one.measured).any(axis=0))
        found.append(_fitted(plan, there, grid.time))
    return found


def _fitted(plan: Model, there: NDArray[np.intp], time: FloatArray) -> FlownAgain:
    """One axis with its datum fitted, over the outputs that are there."""

    def simulate(thetas: FloatArray) -> FloatArray:
        return plan.simulate(thetas)[:, :, there]

    names, target = [OUTPUTS[plan.flown.axis][i] for i in there], plan.flown.measured[:, there]
    best = fit(simulate, plan.theta0, target, step=plan.step(plan.theta0))
    measured = dict(zip(names, target.T, strict=True))
    simulated = dict(zip(names, simulate(best.theta[None])[0].T, strict=True))
    r2 = {n: explained(measured[n], simulated[n]) for n in names}
    return FlownAgain(plan.flown.axis, time, measured, simulated, r2)


def published() -> dict[str, float]:
    """The published derivatives of the clean aircraft, for what an identification does not tell."""
    row = published_airframe()[0]
    known = {name for names in NAMES.values() for name in names}
    return {name: float(row[name]) for name in row.dtype.names if name in known}


def derivatives(estimates: Mapping[str, Estimate]) -> dict[str, float]:
    """Derivatives of the equations of motion: those identified, body-axis force from lift where only lift is known.

    Near zero incidence CZ_alpha = CX_0 - CL_alpha, CZ_q = -CL_q, CZ_elevator = -CL_elevator (turned through alpha). A
    method without CL_q has put it into the other two: it is zero then.
    """
    found = {name: e.estimate for name, e in estimates.items() if e.identifiable and np.isfinite(e.estimate)}
    if "CZ_alpha" not in found and "CL_alpha" in found:
        found["CZ_alpha"] = published()["CX_0"] - found["CL_alpha"]
        found["CZ_elevator"] = -found.get("CL_elevator", 0.0)
        found["CZ_q"] = -found.get("CL_q", 0.0)
    known = {name for names in NAMES.values() for name in names}
    return {name: value for name, value in found.items() if name in known}


def explained(measured: FloatArray, simulated: FloatArray) -> float:
    """R2 = 1 - sum (measured - simulated)^2 / sum (measured - mean)^2 over what was measured."""
    good = np.isfinite(measured)
    if not np.isfinite(simulated).all():
        raise InputError("these derivatives give a flight that diverges")
    total = float(np.sum((measured[good] - np.mean(measured[good]))**2))
    return 1.0 - float(np.sum((measured[good] - simulated[good])**2))/max(total, 1e-300)
