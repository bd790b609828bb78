"""Equation error: aerodynamic derivatives from a flight record by least squares and modified stepwise regression.

Every equation has its linear terms; products of them then compete for a place by modified stepwise regression, so that
a linear derivative is not bent by a curve that it has to stand for. What stands in the equations, and how signals are
smoothed and differentiated: estimators.regression.preparation. Equations: estimators.regression.equations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimators.estimate import Estimate
from estimators.regression.equations import (
    EQUATIONS,
    EXCITED,
    LEFT_OUT,
    NEEDED,
    SURFACES,
    Equation,
    competing,
    fit_equation,
    movement,
)
from estimators.regression.preparation import noise_of, prepare
from estimators.regression.stepwise import PRACTICE, Criteria, Stepwise, choose, stepwise
from estimators.regression.zero_lift import zero_lift_drag
from estimators.signals.coefficients import Airframe, airframe_of, thrust
from estimators.signals.data_checks import check
from estimators.signals.gust_level import turbulence_warnings
from estimators.signals.instruments import calibrated
from estimators.signals.resample import Grid, common_grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray


@dataclass(frozen=True)
class Problem:
    """A record as equations.

    Attributes:
        data: targets and regressors by name (N,).
        rows: usable rows by target (N,).
        moved: rms of each surface about its trend, rad.
        thrust_known: whether drag and axial force are free of it.
        warnings: by axis, where gusts bias what regression finds.
        noise: variance of the noise in regressors by name.
    """

    data: Mapping[str, FloatArray]
    rows: Mapping[str, NDArray[np.bool_]]
    moved: Mapping[str, float]
    thrust_known: bool
    warnings: Mapping[str, str]
    noise: Mapping[str, float]

    @property
    def equations(self) -> tuple[Equation, ...]:
        """The equations that the record has the channels for."""
        return tuple(equation for equation in EQUATIONS if equation.target in self.rows)

    def finished(self, equation: Equation, found: dict[str, Estimate]) -> dict[str, Estimate]:
        """Estimates of an equation with the warning of its axis; refused where they contain thrust not recorded."""
        told = self.warnings.get(equation.axis, "")
        found = {name: replace(e, warning=told, std_error=float(np.hypot(e.std_error, self._misfit(name) * e.estimate)))
                 for name, e in found.items()}  # fmt: skip
        if self.thrust_known or equation.target not in ("CD", "CX"):
            return found
        why = "thrust was not recorded and cannot be told from drag"
        return {name: replace(e, identifiable=False, why=why) for name, e in found.items()}

    def _misfit(self, name: str) -> float:
        """Share of a derivative that the equation itself may be wrong by, where noise is allowed for as well."""
        return LEFT_OUT.get(name, 0.0) if self.noise else 0.0

    def flown(self, equation: Equation) -> bool:
        """Whether a surface of the equation's axis moved: without it products of noise and drift would compete."""
        return max(self.moved.get(surface, 0.0) for surface in SURFACES[equation.axis]) >= EXCITED


def identify(
    record: FlightRecord,
    mode: str = "matched",
    default: Airframe | None = None,
    nonlinear: bool | None = None,
    half: int | None = None,
) -> dict[str, Estimate]:
    """Derivatives by name (CZ_alpha, CL_alpha, CD_0, Cm_q, CY_beta, Cl_p, Cn_rudder ..., per rad; biases as *_0).

    An axis whose channels are absent is left out; a derivative that the record does not excite is carried with
    `identifiable` false and the reason. Forces and moments are in the owner's or the record's own signs and units.

    Args:
        mode: "matched", "fourier", "textbook", "unmatched" or "unmatched_smoothed" (`preparation`).
        default: the airframe for what the record does not state.
        nonlinear: whether products of the regressors compete; not in the mode "textbook", whose structure is linear,
            and otherwise, by default.
        half: samples either side in the slope filter; 0.1 s by default.

    Raises:
        InputError: the record is refused by `data_checks.check`, or lacks the channels of both axes or of the mode.
    """
    problem = pose(record, mode, default, half)
    compete = mode != "textbook" if nonlinear is None else nonlinear
    result: dict[str, Estimate] = {}
    for equation in problem.equations:
        data, rows = dict(problem.data), problem.rows[equation.target]
        entered: tuple[str, ...] = ()
        if compete:
            terms = competing(equation, data, rows) if problem.flown(equation) else {}
            data.update(terms)
            model = choose(*_candidates(equation, data, terms, rows))[0] if terms else ()
            entered = tuple(term for term in model if term in terms)
        found = fit_equation(
            equation, data, rows, dict(problem.moved), f"equation error, {mode}", entered, mode == "textbook",
            problem.noise,
        )
        if equation.target == "CD" and problem.flown(equation):
            found["CD_0"] = zero_lift_drag(data, rows, f"equation error, {mode}", mode == "textbook")
        result.update(problem.finished(equation, found))
    return result


def histories(
    record: FlightRecord,
    mode: str = "matched",
    default: Airframe | None = None,
    criteria: Criteria = PRACTICE,
) -> dict[str, Stepwise]:
    """How stepwise regression built the model of each coefficient (CZ, CL, Cm, CY, Cl, Cn); `.table()` prints one.

    Only coefficients of an axis that was flown. Textbook structure is linear: there the history is what would enter.

    Arguments and errors as for `identify`.
    """
    problem = pose(record, mode, default)
    found = {}
    for equation in problem.equations:
        rows = problem.rows[equation.target]
        terms = competing(equation, dict(problem.data), rows)
        if terms and problem.flown(equation):
            known = {**problem.data, **terms}
            found[equation.target] = stepwise(*_candidates(equation, known, terms, rows), criteria)
    return found


def _candidates(
    equation: Equation, data: Mapping[str, FloatArray], terms: Mapping[str, FloatArray], rows: NDArray[np.bool_]
) -> tuple[dict[str, FloatArray], FloatArray, list[str]]:
    """What competes on the good rows, the target, and what is forced: the equation's own terms unless optional."""
    forced = [name for name in equation.regressors if name not in equation.optional]
    return {name: data[name][rows] for name in (*equation.regressors, *terms)}, data[equation.target][rows], forced


def pose(record: FlightRecord, mode: str, default: Airframe | None = None, half: int | None = None) -> Problem:
    """The equations of a record; arguments and errors as for `identify`."""
    record = calibrated(check(record))
    grid = common_grid(record)
    axes = {axis: [n for n in needed if n not in grid.values] for axis, needed in NEEDED.items()}
    if all(axes.values()):
        lacks = "; ".join(f"{axis} needs {', '.join(names)}" for axis, names in axes.items())
        raise InputError(f"record '{record.meta.name}' lacks columns: {lacks}")
    airframe = airframe_of(record, default)
    data, reach = prepare(grid, record, airframe, mode, half)
    surfaces = [name for pair in SURFACES.values() for name in pair if name in grid.values]
    moved = {name: movement(grid.time, grid.values[name], grid.good((name,))) for name in surfaces}
    rows = {
        equation.target: _usable(grid, equation, reach) & np.isfinite(data[equation.target])
        for equation in EQUATIONS if not axes[equation.axis] and equation.target in data
    }  # fmt: skip
    return Problem(data, rows, moved, thrust(grid.values) is not None, turbulence_warnings(grid, "regression"),
                   noise_of(grid, airframe, mode, reach))  # fmt: skip


def _usable(grid: Grid, equation: Equation, half: int) -> NDArray[np.bool_]:
    """Rows with every channel of the equation known, and none unknown or beyond the ends within reach of the filter."""
    bad = ~grid.good((*NEEDED[equation.axis], "ax", "thrust_left", "thrust_right"))
    if half:
        bad = np.convolve(bad, np.ones(2 * half + 1), mode="same") > 0.5
        bad[:half] = bad[len(bad) - half :] = True
    return ~bad
