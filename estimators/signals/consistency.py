"""How channels depend on each other: by what factor, how surely, and which unit that factor betrays."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimators.regression.least_squares import least_squares
from icing_env.record import FloatArray

FEWEST = 20  # samples
CLEAR = 4.0  # standard errors
NEAR = 0.15  # a factor within this of a ratio of units is taken for it


def factors(
    change: FloatArray,
    terms: list[FloatArray],
    good: NDArray[np.bool_],
    lively: float,
    explained: float,
    nuisance: FloatArray | None = None,
) -> list[tuple[float, bool]] | None:
    """Factor of each term in a change, and whether it stands clear of 1 and of 0.

    Args:
        change: what the terms should add up to (N,).
        terms: each (N,).
        good: rows to use (N,).
        lively: rms of the change below which nothing can be said.
        explained: R2 below which nothing can be said.
        nuisance: a term (N,) whose factor is fitted and of no interest.

    Returns:
        (factor, clear) of each term, with errors for coloured residuals; None where nothing can be said.
    """
    count = len(terms)
    terms = terms if nuisance is None else [*terms, nuisance]
    rows = good & np.isfinite(change) & np.isfinite(np.sum(terms, axis=0))
    if rows.sum() < FEWEST or np.std(change[rows]) < lively:
        return None
    fit = least_squares(np.column_stack([*(term[rows] for term in terms), np.ones(rows.sum())]), change[rows])
    if fit.r2 < explained or not fit.full_rank:
        return None
    pairs = zip(fit.theta[:count], fit.std_error[:count], strict=True)
    return [(float(k), abs(k - 1.0) > CLEAR * error and abs(k) > CLEAR * error) for k, error in pairs]


def nearest_unit(factor: float, units: Mapping[str, float], within: float = NEAR) -> str:
    """The unit whose ratio a factor is, by a relative difference of less than `within`; "" if none."""
    near = {unit: abs(factor / ratio - 1.0) for unit, ratio in units.items()}
    unit = min(near, key=near.__getitem__)
    return unit if near[unit] < within else ""


def line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope and correlation of y over x; zeros where either is constant."""
    spread = float(np.std(x) * np.std(y))
    if len(x) < FEWEST or spread == 0.0:
        return 0.0, 0.0
    covariance = float(np.mean((x - x.mean()) * (y - y.mean())))
    return covariance / float(np.var(x)), covariance / spread
