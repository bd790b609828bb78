"""Multivariate orthogonal functions: terms made orthogonal on the data, so that each earns its place alone.

Source: Morelli, "Global nonlinear aerodynamic modeling using multivariate orthogonal functions", J. Aircraft 32(2),
1995; Klein & Morelli, Aircraft System Identification (AIAA 2006), section 5.5. From ordinary functions xi_j:
p_j = xi_j - sum_{k<j} gamma_kj p_k, gamma_kj = p_k'xi_j / p_k'p_k, a_j = p_j'z / p_j'p_j. Each lowers the squared
error by (p_j'z)^2 / p_j'p_j whatever else is in the model; ranked by that, as many are kept as give the least predicted
square error, v'v/N + sigma_max^2 p/N. What is kept is expanded back into ordinary functions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from estimators.estimate import Estimate
from estimators.regression.equation_error import Problem, pose
from estimators.regression.equations import (
    LARGEST_CORRELATION,
    Equation,
    competing,
    judge_terms,
    name_of,
    unit_of_term,
)
from estimators.regression.least_squares import Fit, correlation, least_squares
from estimators.regression.noisy_regressors import compensated
from estimators.regression.stepwise import predicted_square_error
from estimators.regression.zero_lift import zero_lift_drag
from estimators.signals.coefficients import Airframe
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray

METHOD = "orthogonal functions"
DEPENDENT = 1e-6  # length of p_j over that of xi_j below which xi_j says nothing that earlier functions do not
SMALL = 1e-3  # share of the rms response below which an expanded term is dropped (Morelli's practice)
BOUND = 25.0  # sigma_max^2 over the variance that all functions together leave: five deviations (assumed)
BOUNDS = ("total", "noise")


@dataclass(frozen=True)
class Function:
    """One orthogonal function: the ordinary one it comes from, how much of the squared error it takes, its rank."""

    term: str
    share: float  # of the total squared error
    pse: float  # predicted square error of the model up to this rank
    kept: bool

    def __str__(self) -> str:
        """One line of the ranking."""
        action = "kept" if self.kept else "left out"
        return f"{action:8s} {self.term:24s} share {self.share:.6f}  PSE {self.pse:.3e}"


@dataclass(frozen=True)
class Expansion:
    """A model in ordinary functions.

    Attributes:
        terms: names in order, the bias last as "1".
        theta: their coefficients, expanded from the orthogonal functions kept (p,).
        fit: least squares on the same terms, for errors and residuals.
        ranking: all orthogonal functions, the most useful first.
    """

    terms: tuple[str, ...]
    theta: FloatArray
    fit: Fit
    ranking: tuple[Function, ...]

    def table(self) -> str:
        """The ranking as text, one function a line."""
        return "\n".join(str(function) for function in self.ranking)


def expand(
    functions: Mapping[str, FloatArray], target: FloatArray, bound: str = "noise", weight: float = 1.0
) -> Expansion:
    """Model `target` (N,) by `functions` (each (N,)) and a bias, in the order in which they are made orthogonal.

    Args:
        functions: ordinary functions; simple ones first.
        target: what is modelled.
        bound: what sigma_max^2 is: "total", the variance of the target, which needs nothing to be known; or "noise",
            25 times the variance that all functions leave, which keeps more.
        weight: of the penalty in the predicted square error.

    Raises:
        InputError: `bound` is neither.
    """
    if bound not in BOUNDS:
        raise InputError(f"orthogonal functions: bound '{bound}' is unknown; valid are: {', '.join(BOUNDS)}")
    n, names = len(target), list(functions)
    p, back, names = _orthogonal(functions, names)
    size = np.sum(p**2, axis=0)
    centred = target - np.mean(target)
    a = p.T @ centred / size
    gain = a**2 * size
    total = float(centred @ centred)
    variance = total / n
    if bound == "noise":
        variance = min(variance, BOUND * max(total - float(gain.sum()), 0.0) / max(n - len(names) - 1, 1))
    order = np.argsort(-gain)
    left = (total - np.concatenate(([0.0], np.cumsum(gain[order])))) / n
    pse = [predicted_square_error(float(s), variance, k + 1, n, weight) for k, s in enumerate(left)]
    count = int(np.argmin(pse))
    kept = np.zeros(len(names), dtype=bool)
    kept[order[:count]] = True
    ranking = tuple(
        Function(names[j], float(gain[j] / total) if total else 0.0, pse[r + 1], bool(kept[j]))
        for r, j in enumerate(order)
    )
    share = np.where(kept, a, 0.0)
    response = float(np.sqrt(np.mean((p @ share) ** 2)))
    return _ordinary({name: functions[name] for name in names}, target, back @ share, response, ranking)


def _ordinary(
    functions: Mapping[str, FloatArray],
    target: FloatArray,
    theta: FloatArray,
    response: float,
    ranking: tuple[Function, ...],
) -> Expansion:
    """The model in ordinary functions, without those that add next to nothing to the rms `response`."""
    spread = np.array([np.std(values) for values in functions.values()])
    stays = np.abs(theta) * spread > SMALL * response
    terms = [name for name, stay in zip(functions, stays, strict=True) if stay]
    means = np.array([np.mean(functions[name]) for name in terms])
    bias = float(np.mean(target) - theta[stays] @ means)
    matrix = np.column_stack([*(functions[name] for name in terms), np.ones(len(target))])
    return Expansion((*terms, "1"), np.append(theta[stays], bias), least_squares(matrix, target, fade=True), ranking)


def _orthogonal(functions: Mapping[str, FloatArray], names: list[str]) -> tuple[FloatArray, FloatArray, list[str]]:
    """Orthogonal functions (N, m), the matrix (m, m) that expands their coefficients, and the names they come from.

    The first function is 1: the others lose their means. Each is made orthogonal twice, against rounding.
    """
    p: list[FloatArray] = []
    back: list[FloatArray] = []
    used: list[str] = []
    for name in names:
        xi = functions[name] - np.mean(functions[name])
        new, expansion = xi.copy(), np.zeros(len(names))
        expansion[len(used)] = 1.0
        for _ in range(2):
            for k, other in enumerate(p):
                gamma = float(other @ new / (other @ other))
                new = new - gamma * other
                expansion = expansion - gamma * back[k]
        if new @ new > DEPENDENT**2 * (xi @ xi) > 0.0:
            p.append(new)
            back.append(expansion)
            used.append(name)
    n = len(next(iter(functions.values())))
    m = len(used)
    columns = np.column_stack(p) if p else np.zeros((n, 0))
    return columns, np.array([b[:m] for b in back]).reshape(m, m).T, used


def identify(
    record: FlightRecord, mode: str = "matched", default: Airframe | None = None, bound: str = "noise"
) -> dict[str, Estimate]:
    """Derivatives by name, as `equation_error.identify` gives them; its arguments and errors, and `bound` of `expand`.

    A derivative whose term the predicted square error does not keep is carried with `identifiable` false.
    """
    problem = pose(record, mode, default)
    result: dict[str, Estimate] = {}
    for equation in problem.equations:
        found = _estimates(equation, problem, bound)
        result.update(problem.finished(equation, found))
    return result


def rankings(
    record: FlightRecord, mode: str = "matched", default: Airframe | None = None, bound: str = "noise"
) -> dict[str, Expansion]:
    """The model of each coefficient of an axis that was flown; `.table()` prints how its functions ranked."""
    problem = pose(record, mode, default)
    return {e.target: _model(e, problem, bound)[0] for e in problem.equations if problem.flown(e)}


def _model(equation: Equation, problem: Problem, bound: str) -> tuple[Expansion, dict[str, FloatArray]]:
    """The expansion of one equation, and all its functions on the usable rows."""
    rows = problem.rows[equation.target]
    terms = competing(equation, dict(problem.data), rows) if problem.flown(equation) else {}
    linear = {name: problem.data[name][rows] for name in equation.regressors}
    functions = linear | {n: x[rows] for n, x in terms.items() if not _repeats(x[rows], linear)}
    return expand(functions, problem.data[equation.target][rows], bound), functions


def _repeats(function: FloatArray, linear: Mapping[str, FloatArray]) -> bool:
    """Whether a product goes with a linear term so closely that the two derivatives could not be told apart."""
    table = correlation(np.column_stack([function, *linear.values()]))
    return bool(np.max(np.abs(table[0, 1:])) > LARGEST_CORRELATION)


def _estimates(equation: Equation, problem: Problem, bound: str) -> dict[str, Estimate]:
    model, functions = _model(equation, problem, bound)
    terms = model.terms[:-1]
    used = np.column_stack([*(functions[n] for n in terms), np.ones(len(functions[equation.regressors[0]]))])
    noise = np.array([*(problem.noise.get(n, 0.0) for n in terms), 0.0])
    target = problem.data[equation.target][problem.rows[equation.target]]
    fit = compensated(replace(model.fit, theta=model.theta), used, target, noise)
    found = judge_terms(equation, terms, fit, {n: functions[n] for n in terms}, dict(problem.moved), METHOD)
    if equation.target == "CD" and problem.flown(equation):
        found["CD_0"] = zero_lift_drag(problem.data, problem.rows["CD"], METHOD)
    for name in equation.regressors:
        if name not in terms:
            why = "its term does not lower the predicted square error"
            found[name_of(equation.target, name)] = Estimate(
                0.0, float("inf"), unit_of_term(name), METHOD, model.fit.r2, False, why
            )
    return found
