"""The equations that equation error fits: what stands on the left, what on the right, and when it can be told.

Structures: Klein & Morelli, Aircraft System Identification (AIAA 2006), examples 5.1 and 5.2, and for drag the
parabolic polar CD = CD_0 + CD_K CL^2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from estimators.estimate import Estimate
from estimators.regression.least_squares import Fit, correlation, least_squares
from estimators.regression.noisy_regressors import compensated
from icing_env.record import FloatArray

EXCITED = np.radians(0.25)  # rms of a surface about its trend below which it has not moved (assumed)
# What the equations leave out in doublets, as a share of each derivative: by how much errors over calm simulated
# flights (development flights of benchmarks.coverage) exceed what residuals tell. In pitch it is the downwash, which
# reaches the tail tail_arm/V late: a moment by q stands for that to first order only. In roll and yaw it is noise and
# slopes of regressors behind filters.
LEFT_OUT = {"Cm_alpha": 0.008, "Cm_q": 0.014, "Cm_elevator": 0.018, "CY_beta": 0.008, "Cl_beta": 0.006, "Cl_p": 0.005,
            "Cl_aileron": 0.004, "Cn_p": 0.04, "Cn_r": 0.012}  # fmt: skip
LARGEST_CORRELATION = 0.9  # Klein & Morelli, section 5.5
LARGEST_RATIO = 1.0 / 3.0  # standard error over estimate; beyond it the parameter is dropped


@dataclass(frozen=True)
class Equation:
    """`target` = sum of derivative x regressor + bias. `optional` regressors stay only where they are seen."""

    target: str
    regressors: tuple[str, ...]
    optional: tuple[str, ...] = ()
    axis: str = "longitudinal"


PITCH = ("alpha", "q_hat", "elevator")
LATERAL = ("beta", "p_hat", "r_hat", "aileron", "rudder")
EQUATIONS = (
    Equation("CZ", PITCH),
    Equation("CL", PITCH),
    Equation("Cm", PITCH),
    Equation("CD", ("CL2",)),
    Equation("CX", ("alpha", "alpha2")),
    Equation("CY", ("beta", "p_hat", "r_hat", "rudder"), optional=("p_hat",), axis="lateral"),
    Equation("Cl", LATERAL, axis="lateral"),
    Equation("Cn", LATERAL, axis="lateral"),
)
SURFACES = {"longitudinal": ("elevator",), "lateral": ("aileron", "rudder")}
NEEDED = {
    "longitudinal": ("airspeed", "alpha", "q", "az", "elevator"),
    "lateral": ("airspeed", "beta", "p", "r", "ay", "aileron", "rudder"),
}
# Products that may compete with the linear terms, each factor about its mean over the record, so that the linear
# derivatives stay those of the flight condition. Drag and axial force have their own powers.
COMPETING = {
    "longitudinal": (("alpha", "alpha"), ("alpha", "alpha", "alpha"), ("alpha", "q_hat"), ("alpha", "elevator"),
                     ("elevator", "elevator"), ("alpha", "alpha", "elevator")),
    "lateral": (("beta", "beta", "beta"), ("beta", "beta"), ("alpha", "beta"), ("alpha", "p_hat"), ("alpha", "r_hat"),
                ("alpha", "aileron"), ("alpha", "rudder"), ("beta", "p_hat"), ("beta", "r_hat")),
}  # fmt: skip
SUFFIX = {"p_hat": "p", "q_hat": "q", "r_hat": "r", "CL2": "K"}
UNIT = {"alpha2": "1/rad2", "CL2": "1"}


def name_of(target: str, regressor: str) -> str:
    """Name of the derivative of `target` by `regressor`."""
    return f"{target}_{'*'.join(SUFFIX.get(factor, factor) for factor in regressor.split('*'))}"


def unit_of_term(regressor: str) -> str:
    """Unit of a derivative by `regressor`: per radian for each of its factors, which all are angles or hat rates."""
    power = regressor.count("*") + 1
    return UNIT.get(regressor, "1/rad" if power == 1 else f"1/rad{power}")


def competing(equation: Equation, data: dict[str, FloatArray], good: NDArray[np.bool_]) -> dict[str, FloatArray]:
    """Nonlinear terms that may enter an equation, by name ("alpha*elevator"), each (N,); none where nothing varies."""
    if set(equation.regressors) & {"CL2", "alpha2"}:
        return {}
    terms = {"*".join(t): t for t in COMPETING[equation.axis] if all(n in data for n in t)}
    centred = {n: data[n] - np.mean(data[n][good]) for factors in terms.values() for n in factors}
    return {name: np.prod([centred[n] for n in factors], axis=0) for name, factors in terms.items()}


def movement(time: FloatArray, surface: FloatArray, good: NDArray[np.bool_]) -> float:
    """Root mean square of a surface (rad) about its straight-line trend."""
    t, x = time[good] - time[0], surface[good]
    if len(t) < 3:
        return 0.0
    return float(np.std(x - np.polyval(np.polyfit(t, x, 1), t)))


def fit_equation(
    equation: Equation,
    data: dict[str, FloatArray],
    good: NDArray[np.bool_],
    moved: Mapping[str, float],
    method: str,
    entered: tuple[str, ...] = (),
    all_lags: bool = False,
    noise: Mapping[str, float] = MappingProxyType({}),
) -> dict[str, Estimate]:
    """Fit one equation on the good rows and judge each of its derivatives.

    Args:
        equation: what to fit.
        data: the target, the regressors and the `entered` terms, each (N,).
        good: rows to use (N,).
        moved: rms of each surface, rad.
        method: name that the estimates carry.
        entered: nonlinear terms in the model beside the equation's own.
        all_lags: correct errors for coloured residuals as the textbook does (`least_squares`).
        noise: variance of the noise in regressors by name, where it is to be allowed for.
    """
    regressors = (*equation.regressors, *entered)
    full = _fit(equation.target, regressors, data, good, all_lags, noise)
    known = {name: data[name][good] for name in regressors}
    judged = judge_terms(equation, regressors, full, known, moved, method)
    unseen = [n for n in equation.optional if not judged[name_of(equation.target, n)].identifiable]
    if not unseen:
        return judged
    kept = tuple(name for name in regressors if name not in unseen)
    fit = _fit(equation.target, kept, data, good, all_lags, noise)
    result = judge_terms(equation, kept, fit, {name: known[name] for name in kept}, moved, method)
    return {**result, **{name: judged[name] for name in (name_of(equation.target, n) for n in unseen)}}


def judge_terms(
    equation: Equation,
    names: tuple[str, ...],
    fit: Fit,
    regressors: Mapping[str, FloatArray],
    moved: Mapping[str, float],
    method: str,
) -> dict[str, Estimate]:
    """Derivatives of a fitted equation by name, the bias among them, and whether the record shows each.

    Args:
        equation: what was fitted.
        names: its terms in the order of the fit, whose last one is the bias.
        fit: estimates and errors.
        regressors: the terms on the rows that were used.
        moved: rms of each surface, rad.
        method: name that the estimates carry.
    """
    table = np.abs(correlation(np.column_stack([regressors[name] for name in names]))) if names else np.zeros((0, 0))
    axis, result = _why_axis(equation, moved), dict[str, Estimate]()
    for i, name in enumerate(names):
        value, error = float(fit.theta[i]), float(fit.std_error[i])
        why = axis or _why_surface(name, moved) or _why_together(name, names, table)
        if not why and not fit.full_rank:
            why = "the record does not tell it from the other terms of its equation"
        if not why and not error <= LARGEST_RATIO * abs(value):
            why = f"its standard error {error:.2g} exceeds a third of the estimate {value:.2g}"
        result[name_of(equation.target, name)] = Estimate(
            value, error, unit_of_term(name), method, fit.r2, not why, why
        )
    bias = Estimate(float(fit.theta[-1]), float(fit.std_error[-1]), "1", method, fit.r2, not axis, axis)
    return {**result, f"{equation.target}_0": bias}


def _fit(
    target: str, names: tuple[str, ...], data: dict[str, FloatArray], good: NDArray[np.bool_], all_lags: bool,
    noise: Mapping[str, float],
) -> Fit:
    matrix = np.column_stack([*(data[name] for name in names), np.ones(len(good))])
    matrix[~good] = 0.0
    seen = np.where(good, data[target], 0.0)
    fit = least_squares(matrix, seen, fade=not all_lags)
    return compensated(fit, matrix, seen, np.array([*(noise.get(name, 0.0) for name in names), 0.0]))


def _why_axis(equation: Equation, moved: Mapping[str, float]) -> str:
    surfaces = SURFACES[equation.axis]
    if max(moved.get(s, 0.0) for s in surfaces) >= EXCITED:
        return ""
    told = ", ".join(f"{s} moved {np.degrees(moved.get(s, 0.0)):.2f} deg rms" for s in surfaces)
    return f"no {equation.axis} manoeuvre: {told}, at least {np.degrees(EXCITED):.2f} is needed"


def _why_surface(name: str, moved: Mapping[str, float]) -> str:
    if name not in moved or moved[name] >= EXCITED:
        return ""
    return f"{name} moved {np.degrees(moved[name]):.2f} deg rms, at least {np.degrees(EXCITED):.2f} is needed"


def _why_together(name: str, names: tuple[str, ...], table: FloatArray) -> str:
    """Reason from the correlations (p, p) of the terms."""
    if len(names) < 2 or "alpha2" in names:  # a power moves with its base by definition; its standard error says it
        return ""
    row = table[names.index(name)].copy()
    row[names.index(name)] = 0.0
    other = int(np.argmax(row))
    if row[other] <= LARGEST_CORRELATION:
        return ""
    return f"{name} and {names[other]} move together (correlation {row[other]:.2f}); only their sum is known"
