"""Which errors of the instruments a record can show: fitted, and dropped where it cannot.

An error is left out at once if the motion could not show even the largest that is plausible, or if it goes with a
better known one beyond 0.9 (Klein & Morelli, Aircraft System Identification, section 5.5); after the fit, if its
standard error exceeds a third of it. What is left out counts as zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.compatibility.kinematics import COUNT, INPUTS, PARAMETERS, START
from estimators.compatibility.model import ORDER, PLAUSIBLE, Model
from estimators.likelihood.descent import inverse_information
from estimators.likelihood.newton import MaximumLikelihood
from icing_env.record import FloatArray

LARGEST_CORRELATION = 0.9
SIGNIFICANT = 3.0  # an estimate over its standard error
ROUNDS = 4


@dataclass(frozen=True)
class Found:
    """A fit of some errors.

    Attributes:
        names: of what was fitted, start values first.
        result: their likelihood.
        covariance: (p, p), with what the noise of the inputs adds.
        row: all parameters (21,).
        dropped: why others are not in it.
    """

    names: tuple[str, ...]
    result: MaximumLikelihood
    covariance: FloatArray
    row: FloatArray
    dropped: dict[str, str]

    def value(self, name: str) -> tuple[float, float]:
        """Estimate and standard error of one that was fitted."""
        i = self.names.index(name)
        return float(self.result.theta[i]), float(np.sqrt(self.covariance[i, i]))


def select(model: Model, candidates: tuple[str, ...], dropped: dict[str, str], near: FloatArray | None = None) -> Found:
    """Fit those of the candidates that the record shows.

    Args:
        model: what is fitted.
        candidates: errors that the channels allow.
        dropped: those that have been ruled out before, with the reason; more are added to a copy.
        near: parameter row (21,) to start from; found from the readings if None.
    """
    starts = tuple(START[i] for i in model.readings.channels)
    row = _near(model, starts, candidates) if near is None else near
    whole = (*starts, *candidates)
    information = _information(model.fit(whole, row, most=0))
    kept, ruled = _seen(whole, information)
    dropped = {**dropped, **ruled}
    for _ in range(ROUNDS):
        row = _only(row, kept)
        result = model.fit(kept, row)
        row = _with(row, kept, result.theta)
        covariance = model.covariance(result, row)
        stays, weak = _significant(kept, result.theta, covariance)
        if not weak:
            break
        dropped |= weak
        kept = stays
    return Found(kept, result, covariance, row, dropped)


def _near(model: Model, starts: tuple[str, ...], candidates: tuple[str, ...]) -> FloatArray:
    """Row (21,) of the start and the biases of what drives the motion: the record drifts away without them."""
    row = np.zeros(COUNT)
    row[list(model.readings.channels)] = model.readings.start
    core = (*starts, *(name for name in candidates if name.removeprefix("bias_") in INPUTS))
    return _with(row, core, model.fit(core, row, most=4).theta)


def _with(row: FloatArray, names: tuple[str, ...], theta: FloatArray) -> FloatArray:
    out = row.copy()
    out[[PARAMETERS.index(name) for name in names]] = theta
    return out


def _only(row: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """`row` with zero for every error that is not named."""
    return np.where(np.isin(PARAMETERS, names), row, 0.0)


def _information(result: MaximumLikelihood) -> FloatArray:
    """Information matrix (p, p) about the point at which `result` stands."""
    columns = (result.sensitivity / np.sqrt(result.noise)[:, None]).reshape(-1, result.sensitivity.shape[2])
    return np.asarray(columns.T @ columns, dtype=np.float64)


def _seen(names: tuple[str, ...], information: FloatArray) -> tuple[tuple[str, ...], dict[str, str]]:
    """What can be told apart, and why not the rest: one is dropped at a time, the worst first."""
    kept, dropped = list(names), dict[str, str]()
    while True:
        rows = [names.index(name) for name in kept]
        covariance = _inverse(information[np.ix_(rows, rows)])
        errors = np.sqrt(np.diag(covariance))
        free = [i for i, name in enumerate(kept) if name in PLAUSIBLE]
        reach = {kept[i]: errors[i] * SIGNIFICANT / PLAUSIBLE[kept[i]] for i in free}
        # Of those beyond reach the one that goes first; its leaving may bring the others back.
        beyond = [name for name in reversed(ORDER) if reach.get(name, 0.0) > 1.0]
        if beyond:
            dropped[beyond[0]] = f"the motion would not show it: standard error {reach[beyond[0]] / 3:.2g} of plausible"
            kept.remove(beyond[0])
            continue
        table = np.abs(covariance / np.outer(errors, errors))[np.ix_(free, free)] - np.eye(len(free))
        if not free or np.max(table) <= LARGEST_CORRELATION:
            return tuple(kept), dropped
        pair = sorted((kept[free[i]] for i in np.unravel_index(np.argmax(table), table.shape)), key=ORDER.index)
        dropped[pair[1]] = f"goes with {pair[0]} (correlation {np.max(table):.2f})"
        kept.remove(pair[1])


def _inverse(information: FloatArray) -> FloatArray:
    """Inverse in which what cannot be told apart has large errors, not none."""
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    size = len(scale)
    scaled = information / np.outer(scale, scale) + 1e-12 * np.eye(size)
    return np.asarray(inverse_information(scaled)[0] / np.outer(scale, scale) + 0.0, dtype=np.float64)


def _significant(
    names: tuple[str, ...], theta: FloatArray, covariance: FloatArray
) -> tuple[tuple[str, ...], dict[str, str]]:
    """What stays, and what does not exceed three standard errors: one by one, the others moved as the fit has it."""
    kept = list(names)
    dropped: dict[str, str] = {}
    while True:
        errors = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        ratio = {i: abs(theta[i]) / errors[i] for i, name in enumerate(kept) if name in PLAUSIBLE}
        worst = min(ratio, key=ratio.__getitem__, default=-1)
        if worst < 0 or ratio[worst] >= SIGNIFICANT:
            return tuple(kept), dropped
        dropped[kept[worst]] = f"its standard error {errors[worst]:.2g} exceeds a third of it, {theta[worst]:.2g}"
        column = covariance[:, worst] / covariance[worst, worst]
        theta = np.delete(theta - column * theta[worst], worst)
        covariance = covariance - np.outer(column, covariance[worst])
        covariance = np.delete(np.delete(covariance, worst, 0), worst, 1)
        del kept[worst]
