"""Modified stepwise regression: linear terms first, then others compete for a place in the model.

Source: Klein, Batterson & Murphy, NASA TP-1916 (1981); Klein & Morelli, Aircraft System Identification (AIAA 2006),
section 5.4. The defaults (F 20, R2 0.5 %, correlation 0.9, condition number 100) follow their practice for coloured
residuals. Subsets are compared through the correlation matrix of all terms, which is formed once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimators.regression.least_squares import Fit, least_squares
from icing_env.errors import InputError, nearest
from icing_env.record import FloatArray


@dataclass(frozen=True)
class Step:
    """One step: which term entered or left, its partial F, R2 and predicted square error after it, and the reason."""

    term: str
    action: str  # "forced", "entered", "left", "refused"
    partial_f: float
    r2: float
    pse: float
    why: str = ""

    def __str__(self) -> str:
        """One line of the history."""
        told = f"  {self.why}" if self.why else ""
        return f"{self.action:8s} {self.term:16s} F {self.partial_f:10.1f}  R2 {self.r2:.4f}  PSE {self.pse:.3e}{told}"


@dataclass(frozen=True)
class Stepwise:
    """The model found: terms in order (the bias last, as "1"), their fit, and how it came about."""

    terms: tuple[str, ...]
    fit: Fit
    history: tuple[Step, ...]

    def table(self) -> str:
        """The history as text, one step a line."""
        return "\n".join(str(step) for step in self.history)


@dataclass(frozen=True)
class Criteria:
    """When a term enters, stays and is refused.

    Attributes:
        f_in, f_out: partial F above which a term enters, below which it leaves.
        r2_gain: least increase of R2.
        weight: of the penalty in the predicted square error; 1 as Morelli uses it, 2 in Barron's original.
        collinear: largest correlation with a term that is in the model.
        condition: largest condition number of the correlation matrix of the model's terms, as the ratio of the
            standardised regressors' singular values.
    """

    f_in: float = 20.0
    f_out: float = 20.0
    r2_gain: float = 0.005
    weight: float = 1.0
    collinear: float = 0.9
    condition: float = 100.0


PRACTICE = Criteria()


def predicted_square_error(mean_square: float, variance: float, terms: int, count: int, weight: float) -> float:
    """PSE = v'v/N + weight sigma_max^2 p/N, sigma_max^2 being the variance of the target (Barron; Morelli's bound)."""
    return mean_square + weight * variance * terms / count


def stepwise(
    candidates: Mapping[str, FloatArray],
    target: FloatArray,
    forced: Sequence[str] = (),
    criteria: Criteria = PRACTICE,
) -> Stepwise:
    """Choose terms as `choose` does and fit the model; arguments and errors as there."""
    terms, history = choose(candidates, target, forced, criteria)
    matrix = np.column_stack([*(candidates[name] for name in terms[:-1]), np.ones(len(target))])
    return Stepwise(terms, least_squares(matrix, target), history)


def choose(
    candidates: Mapping[str, FloatArray],
    target: FloatArray,
    forced: Sequence[str] = (),
    criteria: Criteria = PRACTICE,
) -> tuple[tuple[str, ...], tuple[Step, ...]]:
    """Choose terms for `target` (N,) among `candidates` (each (N,)); a bias is always in the model.

    The candidate with the largest partial F enters if F > `f_in`, if it raises R2 by `r2_gain` and lowers the predicted
    square error; it is passed over if it is collinear with the model. Then every unforced term with F < `f_out` leaves.
    A term that has left does not return. The first candidate that fails ends the search and is told as refused.

    Returns:
        The terms in order, the bias last as "1", and how it came about.

    Raises:
        InputError: a forced term is no candidate.
    """
    for name in forced:
        if name not in candidates:
            raise InputError(f"stepwise: forced term '{name}' is no candidate; {nearest(name, list(candidates))}")
    search = Search(candidates, target, criteria)
    model, waiting = list(forced), [name for name in candidates if name not in forced]
    history = [search.step(name, "forced", f, model) for name, f in search.partial_f(model).items()]
    while waiting:
        partial = search.entering(waiting, model)
        best = max(waiting, key=partial.__getitem__)
        why = search.fails(best, partial[best], model)
        history.append(search.step(best, "refused" if why else "entered", partial[best], model, why))
        if why and not why.startswith(COLLINEAR):
            break
        waiting.remove(best)
        if why:
            continue
        model.append(best)
        history[-1] = search.step(best, "entered", partial[best], model)
        for name in [n for n in model if n not in forced]:
            f = search.partial_f(model)[name]
            if f < criteria.f_out:
                model.remove(name)
                history.append(search.step(name, "left", f, model, f"F below {criteria.f_out:g}"))
    return (*model, "1"), tuple(history)


COLLINEAR = "collinear: "  # how the reason of a candidate begins that is passed over without ending the search


class Search:
    """Fits of one target by subsets of the candidates, from the correlation matrix of all of them."""

    def __init__(self, candidates: Mapping[str, FloatArray], target: FloatArray, criteria: Criteria) -> None:
        self.index = {name: i for i, name in enumerate(candidates)}
        self.criteria, self.count, self.spread = criteria, len(target), float(np.var(target))
        table = np.vstack([*candidates.values(), target])
        table = table - table.mean(axis=1, keepdims=True)
        norm = np.sqrt(np.sum(table**2, axis=1, keepdims=True))
        table = np.divide(table, norm, out=np.zeros_like(table), where=norm > 0.0)
        self.correlation = table @ table.T

    def solve(self, model: list[str]) -> tuple[FloatArray, FloatArray, float]:
        """Standardised coefficients (p,), the inverse of the terms' correlation matrix (p, p), and 1 - R2."""
        rows = [self.index[name] for name in model]
        among, with_target = self.correlation[np.ix_(rows, rows)], self.correlation[rows, -1]
        try:
            inverse = np.linalg.inv(among)
        except np.linalg.LinAlgError:  # a forced term repeats another: share what they explain
            inverse = np.linalg.pinv(among, rcond=1e-12, hermitian=True)
        theta = inverse @ with_target
        return theta, inverse, max(float(self.correlation[-1, -1] - with_target @ theta), 1e-15)

    def freedom(self, terms: int) -> int:
        """Degrees of freedom left beside `terms` terms and the bias."""
        return max(self.count - terms - 1, 1)

    def partial_f(self, model: list[str]) -> dict[str, float]:
        """theta^2 / s^2(theta) of each term of the model, with white residuals as the F test has it."""
        theta, inverse, left = self.solve(model)
        f = theta**2 / np.maximum(np.diag(inverse) * left / self.freedom(len(model)), 1e-300)
        return {name: float(x) for name, x in zip(model, f, strict=True)}

    def entering(self, waiting: list[str], model: list[str]) -> dict[str, float]:
        """Partial F that each waiting candidate would have in the model: one solution for all (Schur complement)."""
        rows, new = [self.index[name] for name in model], [self.index[name] for name in waiting]
        theta, inverse, left = self.solve(model)
        across = self.correlation[np.ix_(rows, new)]
        own = np.diag(self.correlation)[new] - np.sum(across * (inverse @ across), axis=0)
        free = own > 1e-10
        gain = (self.correlation[new, -1] - across.T @ theta) ** 2 / np.where(free, own, 1.0)
        f = gain / (np.maximum(left - gain, 1e-15) / self.freedom(len(model) + 1))
        return {name: float(x) for name, x in zip(waiting, np.where(free, f, 0.0), strict=True)}

    def fails(self, name: str, f: float, model: list[str]) -> str:
        """Why a candidate may not enter; empty if it may."""
        limits, before, after = self.criteria, self.step(name, "", f, model), self.step(name, "", f, [*model, name])
        if f <= limits.f_in:
            return f"F not above {limits.f_in:g}"
        if after.r2 - before.r2 < limits.r2_gain:
            return f"R2 grows by less than {100 * limits.r2_gain:g} %"
        if after.pse >= before.pse:
            return "PSE does not fall"
        rows = [self.index[n] for n in [*model, name]]
        among = self.correlation[np.ix_(rows, rows)]
        if model and np.max(np.abs(among[-1, :-1])) > limits.collinear:
            other = model[int(np.argmax(np.abs(among[-1, :-1])))]
            return f"{COLLINEAR}correlation with {other} {np.max(np.abs(among[-1, :-1])):.3f}"
        values = np.linalg.eigvalsh(among)
        if values[0] * limits.condition**2 < values[-1]:
            return f"{COLLINEAR}condition number above {limits.condition:g}"
        return ""

    def step(self, name: str, action: str, partial_f: float, model: list[str], why: str = "") -> Step:
        """The record of a step that ends with `model`."""
        left = self.solve(model)[2]
        square, weight = self.spread * left, self.criteria.weight
        pse = predicted_square_error(square, self.spread, len(model) + 1, self.count, weight)
        return Step(name, action, partial_f, 1.0 - left, pse, why)
