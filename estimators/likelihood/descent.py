"""Gauss-Newton descent of a likelihood whose gradient and information are known.

Converged means all criteria at once: |dtheta| below 1e-3 of theta (or 1e-5, or 0.05 standard errors), |dJ/J| below
1e-3, |dR/R| below 0.05, and the gradient below 0.05, here measured as the length of the remaining step in standard
errors, sqrt(g' M^-1 g), so that no unit enters (criteria of Klein & Morelli, Aircraft System Identification, AIAA 2006,
chapter 6; their numbers partly assumed).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from icing_env.record import FloatArray

LARGEST_CHANGE, SMALLEST_CHANGE = 1e-3, 1e-5  # of theta: relative, or in its own unit
COST_CHANGE, NOISE_CHANGE, GRADIENT = 1e-3, 0.05, 0.05
ALIKE = 1e-10  # eigenvalue of the scaled information, over the largest, below which a direction is not seen
HALVINGS = 8


@dataclass(frozen=True)
class Point:
    """The likelihood at one theta: J, -dJ/dtheta (p,), information (p, p), noise (k,), and what else was found."""

    cost: float
    gradient: FloatArray
    information: FloatArray
    noise: FloatArray
    detail: tuple[FloatArray, ...]


class Problem(Protocol):
    """What `descend` needs of a likelihood."""

    def expand(self, theta: FloatArray, step: FloatArray | None) -> Point:
        """Everything at theta (p,), by differences of half width `step` (p,)."""

    def costs(self, thetas: FloatArray) -> FloatArray:
        """J of parameter sets (m, p): (m,), infinite where the model does not fly."""


@dataclass(frozen=True)
class Descent:
    """Where a descent ended, and why; `inverse` (p, p): of the information there."""

    theta: FloatArray
    point: Point
    inverse: FloatArray
    converged: bool
    reason: str
    full_rank: bool
    iterations: int


def descend(
    problem: Problem,
    theta: FloatArray,
    step: FloatArray | None,
    most: int,
    limit: FloatArray | None = None,
    near: float = GRADIENT,
) -> Descent:
    """Gauss-Newton with halved steps from `theta` (p,), until all criteria hold at once or `most` steps are done.

    `limit` (p,) bounds the change of each parameter in one step; `near` is how long the remaining step may be, in
    standard errors.
    """
    reason, converged, change, iterations = f"no convergence in {most} steps", False, np.inf, 0
    last, last_noise = np.inf, np.ones(1)
    while True:
        point = problem.expand(theta, step)
        inverse, full_rank = inverse_information(point.information)
        move = inverse @ point.gradient
        farthest = move if limit is None else np.clip(move, -limit, limit)
        left = max(float(point.gradient @ move), 0.0) ** 0.5
        settled = float(np.max(np.abs(point.noise - last_noise) / point.noise)) < NOISE_CHANGE
        if change < 1.0 and abs(point.cost - last) < COST_CHANGE * abs(point.cost) and settled and left < near:
            converged, reason = True, f"converged in {iterations} steps"
            break
        if iterations >= most:
            break
        taken = _shorten(problem, theta, farthest, point.cost)
        if taken is None:
            # Nothing along the step is better: at the bottom up to rounding, or stuck.
            converged = left < near
            reason = f"converged in {iterations} steps" if converged else "stopped: no step reduces the cost"
            break
        least = np.maximum(SMALLEST_CHANGE, near * np.sqrt(np.maximum(np.diag(inverse), 0.0)))
        change = float(np.max(np.abs(taken - theta) / np.maximum(LARGEST_CHANGE * np.abs(theta), least)))
        theta, last, last_noise, iterations = taken, point.cost, point.noise, iterations + 1
    if not full_rank:
        converged, reason = False, f"{reason}; some parameters cannot be told apart"
    return Descent(theta, point, inverse, converged, reason, full_rank, iterations)


def _shorten(problem: Problem, theta: FloatArray, move: FloatArray, cost: float) -> FloatArray | None:
    """The first of the halved steps that lowers the cost; None if none does."""
    full = np.asarray(theta + move, dtype=np.float64)
    if problem.costs(full[None])[0] < cost:
        return full
    thetas = theta + move * 0.5 ** np.arange(1, HALVINGS)[:, None]
    better = np.flatnonzero(problem.costs(thetas) < cost)
    return np.asarray(thetas[better[0]], dtype=np.float64) if len(better) else None


def inverse_information(information: FloatArray) -> tuple[FloatArray, bool]:
    """Inverse (p, p) of an information matrix over the directions that it holds, and whether it holds them all."""
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    seen = scale > 0.0
    scale = np.where(seen, scale, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    kept = values > ALIKE * max(values[-1], 1e-300)
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    return np.asarray(inverse / np.outer(scale, scale), dtype=np.float64), bool(kept.all() and seen.all())
