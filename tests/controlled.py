"""Rows for the tests of the controllers: a level cruise, and random but possible measurements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers import ice_management
from icing_env import aircraft
from icing_env.types import COMMAND, ESTIMATE, MEASUREMENT, TARGET

BOUNDS = {
    "airspeed": (0.0, 120.0), "alpha": (-0.5, 0.7), "beta": (-0.5, 0.5), "p": (-2.0, 2.0), "q": (-1.0, 1.0),
    "r": (-1.0, 1.0), "phi": (-np.pi, np.pi), "theta": (-1.57, 1.57), "psi": (-50.0, 50.0), "ax": (-20.0, 20.0),
    "ay": (-20.0, 20.0), "az": (-40.0, 20.0), "elevator": (-0.45, 0.24), "aileron": (-0.28, 0.28),
    "rudder": (-0.28, 0.28), "flap": (0.0, 0.65), "throttle_left": (0.0, 1.0), "throttle_right": (0.0, 1.0),
    "altitude": (-100.0, 8000.0), "temperature": (0.0, 320.0), "pressure": (0.0, 1.1e5),
}


CLEAN = aircraft.load("twin_otter")


def airframe() -> NDArray:
    """One row with what ice management, protection and laws know of the clean aircraft."""
    return CLEAN.copy()


def cruise(n: int = 1) -> NDArray:
    """Level flight at 72 m/s and 2200 m, as the instruments see it."""
    m = np.zeros(n, MEASUREMENT)
    for name, value in {
        "airspeed": 72.0, "alpha": 0.02, "theta": 0.02, "ax": 0.196, "az": -9.80, "elevator": 0.01,
        "throttle_left": 0.6, "throttle_right": 0.6, "altitude": 2200.0, "temperature": 268.0, "pressure": 77500.0,
    }.items():
        m[name] = value
    return m


def scattered(n: int, seed: int) -> NDArray:
    """Random measurements within what instruments can show."""
    rng = np.random.default_rng(seed)
    m = np.zeros(n, MEASUREMENT)
    for name, (low, high) in BOUNDS.items():
        m[name] = rng.uniform(low, high, n)
    return m


def believed(n: int = 1, severity: float = 0.0) -> NDArray:
    """A healthy estimate of an aircraft with this severity, its drag known well, its derivatives excited."""
    e = np.zeros(n, ESTIMATE)
    kept = 1.0 - 0.28*severity
    for name, value in {
        "CD_0": 0.0488 + 0.06*severity, "CD_0_std": 0.001, "excess_drag": 0.06*severity, "health": 1.0,
        "CL_alpha": (5.66 - 0.0488)*kept, "CL_alpha_std": 0.1,
        "Cm_0": 0.04, "Cm_alpha": -1.31*kept, "Cm_alpha_std": 0.05,
        "Cm_elevator": -1.74*kept, "Cm_elevator_std": 0.05, "excitation_longitudinal": 0.5,
    }.items():
        e[name] = value
    return e


def requested(n: int, seed: int) -> NDArray:
    """Random commands within the travel of the surfaces."""
    rng = np.random.default_rng(seed)
    c = np.zeros(n, COMMAND)
    for name in ("elevator", "aileron", "rudder"):
        c[name] = rng.uniform(-0.28, 0.24, n)
    for name in ("throttle_left", "throttle_right"):
        c[name] = rng.uniform(0.0, 1.0, n)
    c["flap"] = rng.uniform(0.0, 0.65, n)
    return c


def targets(n: int, seed: int) -> NDArray:
    """Random targets in every mode."""
    rng = np.random.default_rng(seed)
    t = np.zeros(n, TARGET)
    t["pitch_mode"] = rng.integers(0, 3, n)
    t["speed_mode"] = rng.integers(0, 2, n)
    t["roll_mode"] = rng.integers(0, 2, n)
    for name, low, high in (("theta", -1.0, 1.0), ("altitude", 0.0, 6000.0), ("climb_rate", -30.0, 30.0),
                            ("throttle", -1.0, 2.0), ("airspeed", 0.0, 150.0), ("phi", -3.0, 3.0),
                            ("heading", -10.0, 10.0), ("flap", 0.0, 0.65)):
        t[name] = rng.uniform(low, high, n)
    return t


def free(n: int = 1) -> NDArray:
    """Advisories that limit nothing."""
    return ice_management.init(n)


def steer(law, memory: NDArray, command: NDArray, m: NDArray, target: NDArray, advisory: NDArray, gains: NDArray,
          dt: float, estimate: NDArray | None = None) -> None:
    """One step of a law for an aircraft that it believes clean, unless an estimate is given."""
    estimate = believed(len(command)) if estimate is None else estimate
    law.step(memory, command, m, estimate, target, advisory, airframe(), gains, dt)
