"""Stationary Kalman filters over the grid of airspeed and flap, for the regulators of `controllers.design.lqr`.

The separation theorem (Kwakernaak & Sivan, Linear Optimal Control Systems, section 5.3) lets the regulator act on the
filter's states. Two states of the Dryden form (MIL-F-8785C 3.7.2) make the gust that the vane reads a thing of its own;
two random walks take up moments and lift that the clean aircraft lacks, so that ice biases no estimate.

Longitudinal states: airspeed, alpha, q, theta, two of the gust angle, walk of alpha_dot, walk of q_dot.
Lateral states: beta, p, r, phi, two of the gust angle, walk of p_dot, walk of r_dot.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from controllers.design import lqr
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
)
from controllers.parameters import read_parameters
from icing_env.atmosphere import G0
from icing_env.linearise import LATERAL
from icing_env.types import Field

BELIEFS: list[Field] = [
    ("sigma_w", "m/s", "standard deviation of the gusts"),
    ("scale_length", "m", "of the gusts"),
    ("walk_alpha", "rad/s", "random walk of alpha_dot per square root of a second"),
    ("walk_q", "rad/s2", "the same of q_dot"), ("walk_p", "rad/s2", "of p_dot"), ("walk_r", "rad/s2", "of r_dot"),
    ("drive_airspeed", "m/s", "noise that drives the airspeed, per square root of a second"),
    ("drive_beta", "rad", "the same of beta"), ("drive_q", "rad/s", "of q"),
    ("drive_p", "rad/s", "of p"), ("drive_r", "rad/s", "of r"),
    ("noise_airspeed", "m/s", "noise of the pitot"), ("noise_alpha", "rad", "of the vane"),
    ("noise_beta", "rad", "of the vane"), ("noise_rate", "rad/s", "of the gyros"), ("noise_attitude", "rad", "noise"),
]  # fmt: skip
N = 8  # states of either filter
GUST = np.sqrt(0.5)*np.array([np.sqrt(3.0), 1.0 - np.sqrt(3.0)])  # gust of the two states, `icing_env.turbulence`


def beliefs(name: str | Path = "lqg") -> dict[str, float]:
    """Intensities by name. Raises InputError for a file that does not fit."""
    row = read_parameters(name, BELIEFS)
    return {field: float(row[field][0]) for field, _, _ in BELIEFS}


def with_gust(a: FloatArray, by_gust: FloatArray, time: float) -> FloatArray:
    """State matrix [8, 8]: the aircraft, the Dryden pair of time constant `time` [s], and room for two walks."""
    full = np.zeros((N, N))
    full[:4, :4], full[:4, 4:6] = a, np.outer(by_gust, GUST)
    full[4, 4], full[5, 4], full[5, 5] = -1.0/time, 1.0/time, -1.0/time
    return full


def kalman(a: FloatArray, b: FloatArray, c: FloatArray, drive: FloatArray, noise: FloatArray) -> FloatArray:
    """One matrix [8, 8 + inputs + readings] that turns (estimate, surfaces, readings) into the next estimate.

    Args:
        a, b, c: continuous model; `drive`: intensity of the noise on each state; `noise`: deviation of each reading.

    Discretised with Van Loan's integral of the noise (IEEE Trans. Automatic Control 23, 1978).
    """
    loan = linalg.expm(np.block([[-a, np.diag(drive**2)], [np.zeros((N, N)), a.T]])*DT)
    ad = loan[N:, N:].T
    q = ad @ loan[:N, N:]
    bd = linalg.expm(np.block([[a, b], [np.zeros((b.shape[1], N + b.shape[1]))]])*DT)[:N, N:]
    r = np.diag(noise**2)
    p = linalg.solve_discrete_are(ad.T, c.T, 0.5*(q + q.T), r)
    gain = np.linalg.solve(c @ p @ c.T + r, c @ p).T
    correct = np.eye(N) - gain @ c
    return np.hstack([correct @ ad, correct @ bd, gain])


def longitudinal(point: Point, k: dict[str, float]) -> FloatArray:
    """Filter of (estimate, elevator, airspeed, alpha, q, theta) [8, 13]."""
    a, b = point.model(SHORT, ("elevator",))
    by_gust = a[:, 1].copy()
    by_gust[0] -= G0*np.cos(point.trim.theta - point.trim.alpha)  # gravity does not feel the gust
    full = with_gust(a, by_gust, k["scale_length"]/point.airspeed)
    full[1, 6] = full[2, 7] = 1.0
    readings = np.eye(4, N)
    readings[1, 4:6] = GUST
    gust = k["sigma_w"]/point.airspeed*np.sqrt(2.0*point.airspeed/k["scale_length"])
    drive = np.array([k["drive_airspeed"], 0.0, k["drive_q"], 0.0, gust, 0.0, k["walk_alpha"], k["walk_q"]])
    noise = np.array([k["noise_airspeed"], k["noise_alpha"], k["noise_rate"], k["noise_attitude"]])
    return kalman(full, np.vstack([b, np.zeros((4, 1))]), readings, drive, noise)


def lateral(point: Point, k: dict[str, float]) -> FloatArray:
    """Filter of (estimate, aileron, rudder, beta, p, r, phi) [8, 14]."""
    a, b = point.model(LATERAL, ("aileron", "rudder"))
    full = with_gust(a, a[:, 0], k["scale_length"]/point.airspeed)
    full[1, 6] = full[2, 7] = 1.0
    readings = np.eye(4, N)
    readings[0, 4:6] = GUST
    gust = k["sigma_w"]/point.airspeed*np.sqrt(2.0*point.airspeed/k["scale_length"])
    drive = np.array([k["drive_beta"], k["drive_p"], k["drive_r"], 0.0, gust, 0.0, k["walk_p"], k["walk_r"]])
    noise = np.array([k["noise_beta"], k["noise_rate"], k["noise_rate"], k["noise_attitude"]])
    return kalman(full, np.vstack([b, np.zeros((4, 2))]), readings, drive, noise)


def design(parameters: NDArray[Any] | None = None) -> tuple[dict[str, FloatArray], list[str]]:
    """Tables of regulator and filter, and nothing to note; of the clean aircraft if no PARAMETERS row is given."""
    k, (tables, notes) = beliefs(), lqr.design(parameters)
    shape = (len(SPEEDS), len(FLAPS), N)
    tables["filter_longitudinal"], tables["filter_lateral"] = np.zeros((*shape, N + 5)), np.zeros((*shape, N + 6))
    for i, j, point in grid(clean() if parameters is None else parameters):
        tables["filter_longitudinal"][i, j] = longitudinal(point, k)
        tables["filter_lateral"][i, j] = lateral(point, k)
    return tables, notes


def compensator(tables: dict[str, FloatArray], i: int, j: int, point: Point, axis: str) -> tuple[FloatArray, ...]:
    """A, B, C, D from readings of one axis to its surfaces, as `controllers.laws.lqg` runs them.

    States: of the filter, then the integrators of the surfaces.
    """
    surfaces = 1 if axis == "longitudinal" else 2
    gain, m = tables[axis][i, j], tables[f"filter_{axis}"][i, j]
    before, surfaces_read, readings = m[:, :N], m[:, N:N + surfaces], m[:, N + surfaces:]
    width = len(READ_LONGITUDINAL) if axis == "longitudinal" else len(READ_LATERAL)
    read = np.zeros((N, width))
    read[:, :4], read[:, width - surfaces:] = readings, surfaces_read
    integral = np.zeros((surfaces, width))
    if axis == "lateral":
        integral[:, 4] = -DT*gain[:, 5]
    integral += np.outer(-DT*gain[:, 4], read[3])
    a = np.block([[before, np.zeros((N, surfaces))], [np.outer(-DT*gain[:, 4], before[3]), np.eye(surfaces)]])
    return (a, np.vstack([read, integral]), np.hstack([-gain[:, :4] @ before[:4], np.eye(surfaces)]),
            -gain[:, :4] @ read[:4])
