"""How well a record shows each derivative: relative error, correlation, excitation, and what that means in a sentence.

Correlations are those of the parameters of the linear equation that the derivative stands in, from (X'X)^-1 of its
regressors about their means (Klein & Morelli, Aircraft System Identification, AIAA 2006, section 5.1): a property of
the manoeuvre, whichever method estimated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimators.estimate import Estimate
from estimators.regression.equation_error import Problem, pose
from estimators.regression.equations import SURFACES, Equation, name_of
from estimators.regression.least_squares import correlation
from estimators.signals.coefficients import Airframe
from icing_env.record import FlightRecord


@dataclass(frozen=True)
class Observability:
    """What a record says of one derivative.

    Attributes:
        relative_error: standard error over the estimate; None where that has no meaning (no estimate, or zero).
        correlation: largest correlation of the parameter with another of its equation, 0 to 1.
        correlated_with: name of that other derivative; "" where there is none.
        control_rms: rms about its trend of the surface that drives it (its own, else the liveliest of the axis), rad.
        motion_rms: rms of its regressor about the mean, in the regressor's unit (rad, or hat rate); None for a bias.
        identifiable: as the estimate has it.
        sentence: all this in plain words.
    """

    relative_error: float | None
    correlation: float
    correlated_with: str
    control_rms: float
    motion_rms: float | None
    identifiable: bool
    sentence: str


def observability(
    record: FlightRecord, estimates: Mapping[str, Estimate], default: Airframe | None = None
) -> dict[str, Observability]:
    """What `record` says of each of the `estimates` that a method made from it, by name.

    Args:
        record: as recorded.
        estimates: by name.
        default: the airframe for what the record does not state.

    Raises:
        InputError: as `equation_error.identify` for a record that cannot be used.
    """
    problem = pose(record, "matched", default)
    tables = {equation.target: _table(equation, problem) for equation in problem.equations}
    equations = {equation.target: equation for equation in problem.equations}
    found = {}
    for name, estimate in estimates.items():
        target = name.split("_")[0]
        rows = tables.get(target, {})
        other, largest, motion = rows.get(name, ("", 0.0, None))
        control, surface = _control(name, equations.get(target), problem)
        found[name] = _told(name, estimate, largest, other, control, surface, motion)
    return found


def _table(equation: Equation, problem: Problem) -> dict[str, tuple[str, float, float | None]]:
    """For each derivative of an equation: the one it goes with, how closely, and the rms of its regressor."""
    rows = problem.rows[equation.target]
    names = [name for name in equation.regressors if name in problem.data]
    columns = np.column_stack([problem.data[name][rows] for name in names])
    spread = np.std(columns, axis=0)
    inverse = np.linalg.pinv(correlation(columns), rcond=1e-12, hermitian=True)
    scale = np.sqrt(np.maximum(np.diag(inverse), 1e-300))
    together = np.abs(inverse / np.outer(scale, scale)) * (1.0 - np.eye(len(names)))
    out: dict[str, tuple[str, float, float | None]] = {f"{equation.target}_0": ("", 0.0, None)}
    for i, name in enumerate(names):
        j = int(np.argmax(together[i]))
        largest = min(float(together[i, j]), 1.0)
        other = name_of(equation.target, names[j]) if largest > 0.0 else ""
        out[name_of(equation.target, name)] = (other, largest, float(spread[i]))
    return out


def _control(name: str, equation: Equation | None, problem: Problem) -> tuple[float, str]:
    """Rms (rad) and name of the surface that drives a derivative: its own, else the liveliest of its axis."""
    own = name.split("_")[-1]
    if own in problem.moved:
        return float(problem.moved[own]), own
    axis = equation.axis if equation is not None else "longitudinal"
    moved = {surface: problem.moved.get(surface, 0.0) for surface in SURFACES[axis]}
    liveliest = max(moved, key=moved.__getitem__)
    return float(moved[liveliest]), liveliest


def _told(
    name: str, estimate: Estimate, largest: float, other: str, control: float, surface: str, motion: float | None
) -> Observability:
    """One derivative with its sentence."""
    value, error = estimate.estimate, estimate.std_error
    relative = error / abs(value) if np.isfinite(error) and value else None
    moved = f"{surface} moved {np.degrees(control):.2f} deg rms"
    if not estimate.identifiable:
        sentence = f"{name} cannot be had from this record: {estimate.why or moved}."
    else:
        known = "its error is not known" if relative is None else f"it is known to {100 * relative:.2g} %"
        goes = f", and it goes with {other} (correlation {largest:.2f})" if other else ""
        sentence = f"{name}: {known}; {moved}{goes}."
    return Observability(relative, largest, other, control, motion, estimate.identifiable, sentence)
