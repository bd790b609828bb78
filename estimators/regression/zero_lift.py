"""Drag at zero lift from a record that flew at other lifts.

The parabola CD = CD_0 + CD_K CL^2 has its least drag at zero lift by definition. A cambered wing has not: the published
Twin Otter's drag falls from 0.064 at zero lift to 0.056 at CL 0.45, and the parabola through a doublet at CL 0.5 meets
zero lift a quarter too low with a standard error of one per cent. Axial force is free of that: CX = CX_0 + CX_alpha
alpha + CX_alpha2 alpha^2 (Klein & Morelli, Aircraft System Identification (AIAA 2006), example 5.1, and the published
airframe). About the angle of zero lift,

    CX = bias + a (alpha - alpha_0) + b (alpha - alpha_0)^2,   CD_0 = -bias/cos(alpha_0),   alpha_0 = -CL_0/CL_alpha

so that the bias carries the whole uncertainty of going so far out: narrow ranges of lift give a wide error, which
refuses it where it exceeds a third.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimators.estimate import Estimate
from estimators.regression.equations import LARGEST_RATIO, PITCH
from estimators.regression.least_squares import Fit, least_squares
from icing_env.record import FloatArray


def zero_lift_drag(
    data: Mapping[str, FloatArray], rows: NDArray[np.bool_], method: str, all_lags: bool = False
) -> Estimate:
    """CD_0 of a record.

    Args:
        data: CL, CX, alpha, q_hat and elevator, each (N,).
        rows: those to use (N,).
        method: name that the estimate carries.
        all_lags: as in `equations.fit_equation`.
    """
    lift = _fit(data, PITCH, "CL", rows, all_lags)
    alpha_0 = -float(lift.theta[-1] / lift.theta[0])
    slope = np.array([-lift.theta[-1] / lift.theta[0], 0.0, 0.0, 1.0]) / -lift.theta[0]
    above = {"alpha": data["alpha"] - alpha_0, "squared": (data["alpha"] - alpha_0) ** 2, "CX": data["CX"]}
    fit = _fit(above, ("alpha", "squared"), "CX", rows, all_lags)
    value = -float(fit.theta[-1]) / np.cos(alpha_0)
    moved = float(fit.theta[0]) ** 2 * float(slope @ lift.covariance @ slope)
    error = float(np.sqrt(fit.covariance[-1, -1] + moved) / np.cos(alpha_0))
    why = ""
    if not error <= LARGEST_RATIO * abs(value):
        low, high = (float(x) for x in np.percentile(data["CL"][rows], (5, 95)))
        why = (f"lift coefficients of {low:.2f} to {high:.2f} do not show the drag at zero lift: standard error "
               f"{error:.2g}")  # fmt: skip
    return Estimate(float(value), error, "1", method, fit.r2, not why, why)


def _fit(data: Mapping[str, FloatArray], names: tuple[str, ...], target: str, rows: NDArray[np.bool_], all_lags: bool
         ) -> Fit:  # fmt: skip
    matrix = np.column_stack([*(data[name] for name in names), np.ones(len(rows))])
    return least_squares(np.where(rows[:, None], matrix, 0.0), np.where(rows, data[target], 0.0), fade=not all_lags)
