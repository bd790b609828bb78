"""Modified stepwise regression: linear terms first, then others compete for a place in the model.

Source: Klein, Batterson & Murphy, NASA TP-1916 (1981); Klein & Morelli, Aircraft System Identification (AIAA 2006),
section 5.4. The defaults (F 20, collinearity 0.9) follow their practice for coloured residuals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimators.regression.least_squares import Fit, correlation, least_squares
from icing_env.errors import InputError, nearest
from icing_env.record import FloatArray


@dataclass(frozen=True)
class Step:
    """One step: which term entered or left, its partial F, and R2 and the predicted square error after it."""

    term: str
    action: str  # "forced", "entered", "left", "refused"
    partial_f: float
    r2: float
    pse: float

    def __str__(self) -> str:
        """One line of the history."""
        return f"{self.action:8s} {self.term:16s} F {self.partial_f:10.1f}  R2 {self.r2:.4f}  PSE {self.pse:.3e}"


@dataclass(frozen=True)
class Stepwise:
    """The model found: terms in order (the bias last, as "1"), their fit, and how it came about."""

    terms: tuple[str, ...]
    fit: Fit
    history: tuple[Step, ...]

    def table(self) -> str:
        """The history as text, one step a line."""
        return "\n".join(str(step) for step in self.history)


def predicted_square_error(fit: Fit, target: FloatArray, terms: int, weight: float) -> float:
    """PSE = v'v/N + weight sigma_max^2 p/N with sigma_max^2 the variance of the target (Barron; Morelli's bound)."""
    return float(np.mean(fit.residual**2) + weight * np.var(target) * terms / len(target))


def stepwise(
    candidates: Mapping[str, FloatArray],
    target: FloatArray,
    forced: Sequence[str] = (),
    f_in: float = 20.0,
    f_out: float = 20.0,
    weight: float = 1.0,
    collinear: float = 0.9,
    r2_gain: float = 0.005,
) -> Stepwise:
    """Choose terms for `target` (N,) among `candidates` (each (N,)); a bias is always in the model.

    The candidate with the largest partial F enters if F > `f_in`, if it lowers the predicted square error or raises R2
    by `r2_gain`, and if no term of the model is correlated with it beyond `collinear`; then every unforced term with
    F < `f_out` leaves. A term that has left does not return.

    Raises:
        InputError: a forced term is no candidate.
    """
    for name in forced:
        if name not in candidates:
            raise InputError(f"stepwise: forced term '{name}' is no candidate; {nearest(name, list(candidates))}")
    search = _Search(candidates, target, weight)
    model, waiting = list(forced), [name for name in candidates if name not in forced]
    history = [search.step(name, "forced", search.partial_f(name, model), model) for name in forced]
    while waiting:
        best = max(waiting, key=lambda name: search.partial_f(name, [*model, name]))
        f = search.partial_f(best, [*model, best])
        before, entered = search.step(best, "refused", f, model), search.step(best, "entered", f, [*model, best])
        useful = entered.pse < before.pse or entered.r2 - before.r2 > r2_gain
        if f <= f_in or not useful:
            break
        waiting.remove(best)
        if search.collinear(best, model) > collinear:
            history.append(before)
            continue
        model.append(best)
        history.append(entered)
        for name in [n for n in model if n not in forced and search.partial_f(n, model) < f_out]:
            f = search.partial_f(name, model)
            model.remove(name)
            history.append(search.step(name, "left", f, model))
    return Stepwise((*model, "1"), search.fit(model), tuple(history))


class _Search:
    """Fits of one target by subsets of the candidates."""

    def __init__(self, candidates: Mapping[str, FloatArray], target: FloatArray, weight: float) -> None:
        self.candidates, self.target, self.weight = candidates, target, weight

    def matrix(self, model: list[str]) -> FloatArray:
        return np.column_stack([*(self.candidates[name] for name in model), np.ones(len(self.target))])

    def fit(self, model: list[str]) -> Fit:
        return least_squares(self.matrix(model), self.target)

    def partial_f(self, name: str, model: list[str]) -> float:
        """theta^2 / s^2(theta) of one term with white residuals, as the F test has it; 0 if it is not in the model."""
        fit = self.fit(model)
        if name not in model or not fit.full_rank:
            return 0.0
        i = model.index(name)
        return float(fit.theta[i] ** 2 / max(fit.covariance_white[i, i], 1e-300))

    def collinear(self, name: str, model: list[str]) -> float:
        """Largest correlation of a candidate with the terms of the model."""
        if not model:
            return 0.0
        return float(np.max(np.abs(correlation(self.matrix([*model, name])[:, :-1])[-1, :-1])))

    def step(self, name: str, action: str, partial_f: float, model: list[str]) -> Step:
        """The record of a step that ends with `model`."""
        fit = self.fit(model)
        pse = predicted_square_error(fit, self.target, len(model) + 1, self.weight)
        return Step(name, action, partial_f, fit.r2, pse)
