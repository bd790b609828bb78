"""H-infinity attitude loops: weights, aircraft, tables. One controller each for pitch and roll, at all airspeeds.

The synthesis is `controllers.design.mixed_sensitivity`, at the reference dynamic pressure; in flight the surface is
scaled by the inverse of the dynamic pressure. The yaw damper is closed before the roll loop is designed.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from controllers.design.mixed_sensitivity import ORDER, behind_surface, synthesise
from controllers.design.models import (
    ALTITUDE,
    DT,
    READ_LATERAL,
    READ_LONGITUDINAL,
    FloatArray,
    Point,
    clean,
    steady,
)
from controllers.laws.guidance import GUIDANCE_GAINS_FIELDS
from controllers.parameters import read_parameters
from icing_env.atmosphere import G0, density
from icing_env.errors import InputError
from icing_env.linearise import LATERAL
from icing_env.types import Field

if TYPE_CHECKING:
    from control import StateSpace

OWN: list[Field] = [
    ("airspeed", "m/s", "equivalent airspeed of the design"), ("delay", "s", "of computer and instruments"),
    *((f"{axis}_{name}", unit, meaning) for axis in ("pitch", "roll") for name, unit, meaning in (
        ("bandwidth", "rad/s", "up to which the angle is to follow"),
        ("peak", "1", "largest sensitivity"),
        ("surface", "1", "surface per command at low frequency"),
        ("surface_fast", "1", "surface per command at high frequency"),
        ("surface_corner", "rad/s", "between the two"),
        ("uncertain", "rad/s", "where what the model lacks is as large as the model"),
        ("disturbance", "1", "disturbance at the surface per command"))),
    ("rate_noise", "rad/s", "noise of the gyro per command"),
    ("K_r", "s", "rudder per yaw rate beyond that of the turn"),
    ("K_ay_integral", "rad s/m", "rudder rate per lateral specific force"),
]
def weights(name: str | Path = "h_infinity") -> dict[str, float]:
    """Numbers of the weights by name. Raises InputError for a file that does not fit."""
    row = read_parameters(name, OWN)
    return {field: float(row[field][0]) for field, _, _ in OWN}


def pitching(point: Point, k: dict[str, float]) -> StateSpace:
    """Pitch angle and rate from elevator and disturbance: the short period, airspeed held."""
    a, b = point.model(("alpha", "q", "theta"), ("elevator",))
    lag = float(point.parameters["elevator_lag"][0])
    return behind_surface(a, b, np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]), lag, k["delay"])


def rolling(point: Point, k: dict[str, float]) -> StateSpace:
    """Bank angle and roll rate from aileron and disturbance, the yaw damper closed."""
    a, b = point.model(LATERAL, ("aileron", "rudder"))
    a = a + np.outer(b[:, 1], k["K_r"]*np.array([0.0, 0.0, 1.0, -G0/point.airspeed]))
    lag = float(point.parameters["aileron_lag"][0])
    return behind_surface(a, b[:, :1], np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]), lag, k["delay"])


def design(parameters: NDArray[Any] | None = None) -> tuple[dict[str, FloatArray], list[str]]:
    """Tables of both controllers, and gamma of each; of the clean aircraft if no PARAMETERS row is given.

    `pitch`, `roll`: matrices of `synthesise`; `integral`: gains of both integrators [1/s]; `yaw`: K_r, K_ay_integral;
    `gamma`: of both, for the record.
    """
    k = weights()
    point = steady(clean() if parameters is None else parameters, k["airspeed"], 0.0)
    if point is None:
        raise InputError(f"h_infinity: no steady flight at an equivalent airspeed of {k['airspeed']} m/s")
    tables = {"yaw": np.array([k["K_r"], k["K_ay_integral"]]), "integral": np.zeros(2), "gamma": np.zeros(2)}
    notes = []
    for i, (axis, process) in enumerate((("pitch", pitching(point, k)), ("roll", rolling(point, k)))):
        gain, tables[axis], gamma = synthesise(process, axis, k)
        tables["integral"][i], tables["gamma"][i] = gain[0], gamma
        notes.append(f"{axis}: gamma {gamma:.2f}, integrator {gain[0]:.3f} 1/s, {ORDER} states beside it")
    return tables, notes


def compensator(tables: dict[str, FloatArray], i: int, j: int, point: Point, axis: str) -> tuple[FloatArray, ...]:
    """A, B, C, D from readings of one axis to its surfaces, as `controllers.laws.h_infinity` runs them.

    States: of the controller, then the integrators of the surfaces. The place (i, j) is that of `point`.
    """
    name, rate, angle = ("pitch", 2, 3) if axis == "longitudinal" else ("roll", 1, 3)
    surfaces, width = (1, len(READ_LONGITUDINAL)) if axis == "longitudinal" else (2, len(READ_LATERAL))
    m, scale = tables[name], surface_scaling(point)
    pick = np.zeros((2, width))  # error and rate
    pick[0, angle], pick[1, rate] = -1.0, 1.0
    a = linalg.block_diag(m[:ORDER, :ORDER], np.eye(surfaces))
    b, c, d = np.zeros((ORDER + surfaces, width)), np.zeros((surfaces, ORDER + surfaces)), np.zeros((surfaces, width))
    b[:ORDER] = m[:ORDER, ORDER:] @ pick
    b[ORDER] = scale*tables["integral"][0 if name == "pitch" else 1]*DT*pick[0]
    c[0, :ORDER], c[:, ORDER:], d[0] = scale*m[ORDER, :ORDER], np.eye(surfaces), scale*m[ORDER, ORDER:] @ pick
    if axis == "lateral":
        d[1, 2], d[1, 3] = scale*tables["yaw"][0], -scale*tables["yaw"][0]*G0/point.airspeed
        b[ORDER + 1, 4] = scale*tables["yaw"][1]*DT
    return a, b, c, d


def surface_scaling(point: Point) -> float:
    """Scaling of the surfaces with dynamic pressure, of `controllers.laws.guidance`."""
    g = read_parameters("guidance", GUIDANCE_GAINS_FIELDS)[0]
    qbar = 0.5*density(ALTITUDE)*point.airspeed**2
    return float(np.clip(g["qbar_reference"]/qbar, g["scale_min"], g["scale_max"]))
