"""Small flights with known derivatives for tests, made without the simulator, and where recorded flights lie."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from icing_env.record import FlightRecord, Geometry, RecordMeta

PITCH = {"CL_0": 0.45, "CL_alpha": 6.0, "CL_q": 19.0, "CL_elevator": 0.6, "CD_0": 0.05, "CD_K": 0.04,
         "Cm_0": 0.0, "Cm_alpha": -1.4, "Cm_q": -36.0, "Cm_elevator": -1.85}  # fmt: skip
LATERAL = {"CY_beta": -0.85, "CY_r": 0.9, "CY_rudder": 0.35, "Cl_beta": -0.11, "Cl_p": -0.57, "Cl_r": 0.19,
           "Cl_aileron": -0.22, "Cl_rudder": 0.03, "Cn_beta": 0.086, "Cn_p": -0.055, "Cn_r": -0.195,
           "Cn_aileron": -0.02, "Cn_rudder": -0.131}  # fmt: skip
META = RecordMeta(aircraft="test", mass=4950.0, inertia=(28345.0, 32905.0, 52164.0, 1528.0),
                  geometry=Geometry(39.25, 19.81, 1.98), name="made")  # fmt: skip
V, RHO, G = 72.0, 1.03, 9.80665
NOISE = {"alpha": 0.001, "beta": 0.001, "p": 0.001, "q": 0.001, "r": 0.001, "phi": 0.001, "theta": 0.001,
         "ax": 0.02, "ay": 0.02, "az": 0.05}  # fmt: skip


def flight_data(name: str) -> Path:
    """A recorded flight, or skip the test and say why."""
    folder = Path(os.environ.get("ICING_FLIGHT_DATA") or Path(__file__).resolve().parents[2] / "shared" / "flight_data")
    path = folder / name
    if not path.is_file():
        pytest.skip(f"{path} is absent: set ICING_FLIGHT_DATA to the folder of the recorded flights")
    return path


def doublet(t: float, start: float, half: float, size: float) -> float:
    """A doublet with edges that a surface can follow (0.1 s)."""
    edge = 0.03
    up, turn, back = (np.tanh((t - start - k * half) / edge) for k in range(3))
    return float(size * (0.5 * up - turn + 0.5 * back))


def longitudinal(seed: int | None = None, duration: float = 12.0, dt: float = 0.02) -> FlightRecord:
    """Two elevator doublets at constant airspeed with the derivatives of `PITCH`; noise where a seed is given."""
    m, geometry, (_, yy, _, _) = META.mass, META.geometry, META.inertia
    force = 0.5 * RHO * V**2 * geometry.wing_area

    def elevator(t: float) -> float:
        return doublet(t, 1.0, 1.0, 0.035) + doublet(t, 6.0, 0.5, 0.03)

    def coefficients(x: np.ndarray, t: float) -> tuple[float, float, float]:
        alpha, q, de = x[0], x[1] * geometry.chord / (2 * V), elevator(t)
        lift = PITCH["CL_0"] + PITCH["CL_alpha"] * alpha + PITCH["CL_q"] * q + PITCH["CL_elevator"] * de
        moment = PITCH["Cm_0"] + PITCH["Cm_alpha"] * alpha + PITCH["Cm_q"] * q + PITCH["Cm_elevator"] * de
        return lift, PITCH["CD_0"] + PITCH["CD_K"] * lift**2, moment

    def rhs(t: float, x: np.ndarray) -> list[float]:
        lift, _, moment = coefficients(x, t)
        gamma = x[2] - x[0]
        return [x[1] - (force * lift / m - G * np.cos(gamma)) / V, force * geometry.chord * moment / yy, x[1]]

    time = np.arange(round(duration / dt) + 1) * dt
    x = solve_ivp(rhs, (0, time[-1]), [0.0, 0.0, 0.0], t_eval=time, max_step=0.01, rtol=1e-9, atol=1e-11).y
    lift, drag, _ = np.array([coefficients(x[:, i], t) for i, t in enumerate(time)]).T
    push = np.full(len(time), 3200.0)
    channels = {
        "time": time + 100.0, "airspeed": np.full(len(time), V), "alpha": x[0], "q": x[1], "theta": x[2],
        "ax": (force * (lift * np.sin(x[0]) - drag * np.cos(x[0])) + 2 * push) / m,
        "az": force * (-lift * np.cos(x[0]) - drag * np.sin(x[0])) / m,
        "elevator": np.array([elevator(t) for t in time]), "thrust_left": push, "thrust_right": push,
        "pressure": np.full(len(time), RHO * 287.05287 * 280.0), "temperature": np.full(len(time), 280.0),
    }  # fmt: skip
    return FlightRecord(_noisy(channels, seed), META)


def lateral(seed: int | None = None, duration: float = 16.0, dt: float = 0.02) -> FlightRecord:
    """Rudder and aileron doublets at constant airspeed with the derivatives of `LATERAL`."""
    m, geometry, (xx, _, zz, xz) = META.mass, META.geometry, META.inertia
    force, b = 0.5 * RHO * V**2 * geometry.wing_area, geometry.span
    inverse = np.linalg.inv([[xx, -xz], [-xz, zz]])

    def controls(t: float) -> tuple[float, float]:
        return doublet(t, 7.0, 1.0, 0.09), doublet(t, 1.0, 1.4, 0.05)

    def coefficient(name: str, x: np.ndarray, t: float) -> float:
        aileron, rudder = controls(t)
        terms = {"beta": x[0], "p": x[1] * b / (2 * V), "r": x[2] * b / (2 * V), "aileron": aileron, "rudder": rudder}
        return sum(LATERAL.get(f"{name}_{k}", 0.0) * v for k, v in terms.items())

    def rhs(t: float, x: np.ndarray) -> list[float]:
        p_dot, r_dot = inverse @ [force * b * coefficient("Cl", x, t), force * b * coefficient("Cn", x, t)]
        return [(force * coefficient("CY", x, t) / m + G * np.sin(x[3])) / V - x[2], p_dot, r_dot, x[1]]

    time = np.arange(round(duration / dt) + 1) * dt
    x = solve_ivp(rhs, (0, time[-1]), [0.0] * 4, t_eval=time, max_step=0.01, rtol=1e-9, atol=1e-11).y
    side = np.array([coefficient("CY", x[:, i], t) for i, t in enumerate(time)])
    moved = np.array([controls(t) for t in time]).T
    channels = {
        "time": time, "airspeed": np.full(len(time), V), "beta": x[0], "p": x[1], "r": x[2], "phi": x[3],
        "ay": force * side / m, "aileron": moved[0], "rudder": moved[1],
        "pressure": np.full(len(time), RHO * 287.05287 * 280.0), "temperature": np.full(len(time), 280.0),
    }  # fmt: skip
    return FlightRecord(_noisy(channels, seed), META)


def _noisy(channels: dict[str, np.ndarray], seed: int | None) -> dict[str, np.ndarray]:
    if seed is None:
        return channels
    rng = np.random.default_rng(seed)
    return {k: v + NOISE[k] * rng.standard_normal(len(v)) if k in NOISE else v for k, v in channels.items()}


def with_channel(record: FlightRecord, name: str, values: np.ndarray) -> FlightRecord:
    """The record with one channel replaced."""
    return replace(record, channels={**record.channels, name: values})
