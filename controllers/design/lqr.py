"""Linear-quadratic regulators with integral action over the grid of airspeed and flap.

Bryson's rule (Bryson & Ho, Applied Optimal Control, section 5.2): each deviation is weighed by one over the square of
the largest that is acceptable. Integrals of the pitch error, of the bank error and of the lateral specific force are
states of their own (Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic Systems, section 7.10).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from controllers.design.models import (
    DT,
    FLAPS,
    READ_LATERAL,
    READ_LONGITUDINAL,
    SHORT,
    SPEEDS,
    FloatArray,
    Point,
    clean,
    grid,
    side_force,
)
from controllers.parameters import read_parameters
from icing_env.linearise import LATERAL
from icing_env.types import Field

LIMITS: list[Field] = [
    ("airspeed", "m/s", "largest acceptable deviation"), ("alpha", "rad", "the same"), ("q", "rad/s", "the same"),
    ("theta", "rad", "the same"), ("theta_integral", "rad s", "the same"), ("elevator", "rad", "the same"),
    ("beta", "rad", "the same"), ("p", "rad/s", "the same"), ("r", "rad/s", "the same"), ("phi", "rad", "the same"),
    ("phi_integral", "rad s", "the same"), ("ay_integral", "m/s", "integral of the lateral specific force"),
    ("aileron", "rad", "the same"), ("rudder", "rad", "the same"),
]  # fmt: skip


def limits(name: str | Path = "lqr") -> dict[str, float]:
    """Largest acceptable deviations by name. Raises InputError for a file that does not fit."""
    row = read_parameters(name, LIMITS)
    return {field: float(row[field][0]) for field, _, _ in LIMITS}


def regulator(a: FloatArray, b: FloatArray, states: FloatArray, inputs: FloatArray) -> FloatArray:
    """Gain K of u = -K x for the largest acceptable deviations of states and inputs (continuous Riccati equation)."""
    x = linalg.solve_continuous_are(a, b, np.diag(states**-2.0), np.diag(inputs**-2.0))
    return np.asarray((b.T @ x)*(inputs**2)[:, None])


def longitudinal(point: Point, accepted: dict[str, float]) -> FloatArray:
    """Elevator per airspeed, alpha, q, theta and integral of the pitch error [1, 5]."""
    a, b = point.model(SHORT, ("elevator",))
    full, drive = np.zeros((5, 5)), np.zeros((5, 1))
    full[:4, :4], full[4, 3], drive[:4] = a, 1.0, b
    states = np.array([accepted[name] for name in (*SHORT, "theta_integral")])
    return regulator(full, drive, states, np.array([accepted["elevator"]]))


def lateral(point: Point, accepted: dict[str, float]) -> FloatArray:
    """Aileron and rudder per beta, p, r, phi, integral of the bank error and of the lateral force [2, 6]."""
    a, b = point.model(LATERAL, ("aileron", "rudder"))
    force, direct = side_force(point)
    full, drive = np.zeros((6, 6)), np.zeros((6, 2))
    full[:4, :4], full[4, 3], full[5, :4] = a, 1.0, force
    drive[:4], drive[5] = b, direct
    states = np.array([accepted[name] for name in (*LATERAL, "phi_integral", "ay_integral")])
    return regulator(full, drive, states, np.array([accepted["aileron"], accepted["rudder"]]))


def grid_of_design() -> FloatArray:
    """First value, step and number of the speeds and of the flaps."""
    return np.array([SPEEDS[0], SPEEDS[1] - SPEEDS[0], len(SPEEDS), FLAPS[0], FLAPS[1] - FLAPS[0], len(FLAPS)])


def design(parameters: NDArray[Any] | None = None) -> tuple[dict[str, FloatArray], list[str]]:
    """Tables of the scheduled regulator, and nothing to note.

    `grid`, and the gains `longitudinal` and `lateral` [speeds, flaps, rows, columns]; of the clean aircraft if no
    PARAMETERS row is given.
    """
    accepted = limits()
    tables = {"grid": grid_of_design(), "longitudinal": np.zeros((len(SPEEDS), len(FLAPS), 1, 5)),
              "lateral": np.zeros((len(SPEEDS), len(FLAPS), 2, 6))}
    for i, j, point in grid(clean() if parameters is None else parameters):
        tables["longitudinal"][i, j] = longitudinal(point, accepted)
        tables["lateral"][i, j] = lateral(point, accepted)
    return tables, []


def compensator(tables: dict[str, FloatArray], i: int, j: int, point: Point, axis: str) -> tuple[FloatArray, ...]:
    """A, B, C, D from readings of one axis to its surfaces, as `controllers.laws.lqr` runs them.

    States: the integrators of the surfaces. Readings: READ_LONGITUDINAL or READ_LATERAL.
    """
    k = tables[axis][i, j]
    n, states = k.shape[0], 4
    readings = READ_LONGITUDINAL if axis == "longitudinal" else READ_LATERAL
    straight, integral = np.zeros((n, len(readings))), np.zeros((n, len(readings)))
    straight[:, :states] = -k[:, :states]
    integral[:, 3] = -k[:, 4]*DT
    if axis == "lateral":
        integral[:, 4] = -k[:, 5]*DT
    return np.eye(n), integral, np.eye(n), straight
