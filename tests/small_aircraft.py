"""A small rigid aircraft of the tests' own: SciPy, Euler angles, coefficients linear as the identifiers take them.

It shares no equation with the project's simulator, so that estimators are tested against something they do not know.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from icing_env.types import MEASUREMENT

G, DENSITY, TEMPERATURE = 9.80665, 0.95, 265.0


def controls(t: float) -> np.ndarray:
    """Departures of elevator, aileron and rudder (rad): doublets with ramped edges, twice in 20 s."""

    def doublet(at: float, half: float, size: float) -> float:
        corners = [0.0, 0.1, half, half + 0.2, 2 * half + 0.1, 2 * half + 0.2]
        return size * float(np.interp(t - at, corners, [0, 1, 1, -1, -1, 0]))

    return np.array([
        doublet(1.0, 0.8, 0.045) + doublet(11.0, 0.6, 0.045),
        doublet(5.5, 0.9, 0.09) + doublet(15.0, 0.7, 0.09),
        doublet(3.5, 0.8, 0.06) + doublet(13.0, 1.0, 0.06),
    ])  # fmt: skip


def accelerations(x: np.ndarray, u: np.ndarray, thrust: float, af: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Specific force (3,), derivative of the state (8,) and (V, alpha, beta, qbar); x = u v w p q r phi theta."""
    vx, vy, vz, p, q, r, phi, theta = x
    v = np.sqrt(vx * vx + vy * vy + vz * vz)
    alpha, beta, qbar = np.arctan2(vz, vx), np.arcsin(vy / v), 0.5 * DENSITY * v * v
    c, b = af["chord"] / (2 * v), af["span"] / (2 * v)
    elevator, aileron, rudder = u
    cx = af["CX_0"] + af["CX_alpha"] * alpha + af["CX_alpha2"] * alpha**2
    cl = -af["CZ_0"] + (af["CX_0"] - af["CZ_alpha"]) * alpha - af["CZ_q"] * q * c - af["CZ_elevator"] * elevator
    cz = (cx * np.sin(alpha) - cl) / np.cos(alpha)
    cy = af["CY_beta"] * beta + af["CY_p"] * p * b + af["CY_r"] * r * b + af["CY_rudder"] * rudder
    force = qbar * af["wing_area"] * np.array([cx, cy, cz]) + np.array([thrust, 0.0, 0.0])
    pitching = af["Cm_0"] + af["Cm_alpha"] * alpha + af["Cm_q"] * q * c + af["Cm_elevator"] * elevator
    lateral = (beta, p * b, r * b, aileron, rudder)
    rolling, yawing = (
        sum(af[f"{n}_{k}"] * y for k, y in zip(("beta", "p", "r", "aileron", "rudder"), lateral, strict=True))
        for n in ("Cl", "Cn")
    )
    moment = qbar * af["wing_area"] * np.array([rolling * af["span"], pitching * af["chord"], yawing * af["span"]])
    xx, yy, zz, xz = (af[f"inertia_{n}"] for n in ("xx", "yy", "zz", "xz"))
    inertia = np.array([[xx, 0, -xz], [0, yy, 0], [-xz, 0, zz]])
    rates, velocity = np.array([p, q, r]), np.array([vx, vy, vz])
    rates_dot = np.linalg.solve(inertia, moment - np.cross(rates, inertia @ rates))
    gravity = G * np.array([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)])
    specific = force / af["mass"]
    angles_dot = [p + np.tan(theta) * (q * np.sin(phi) + r * np.cos(phi)), q * np.cos(phi) - r * np.sin(phi)]
    derivative = np.concatenate([specific + gravity - np.cross(rates, velocity), rates_dot, angles_dot])
    return specific, derivative, np.array([v, alpha, beta, qbar])


def fly(airframe: np.ndarray, duration: float = 20.0, dt: float = 0.02, speed: float = 70.0) -> np.ndarray:
    """MEASUREMENT rows of a flight from trim through `controls`, without any error of measurement."""
    af = {name: float(airframe[name][0]) for name in airframe.dtype.names}

    def state(alpha: float) -> np.ndarray:
        return np.array([speed * np.cos(alpha), 0, speed * np.sin(alpha), 0, 0, 0, 0, alpha])

    def unbalanced(z: np.ndarray) -> np.ndarray:
        return accelerations(state(z[0]), np.array([z[1], 0, 0]), z[2] * 1e3, af)[1][[0, 2, 4]]

    alpha, elevator, thrust = fsolve(unbalanced, [0.03, 0.0, 4.0], xtol=1e-13)
    trim = np.array([elevator, 0.0, 0.0])
    times = np.arange(round(duration / dt) + 1) * dt
    path = solve_ivp(
        lambda t, x: accelerations(x, trim + controls(t), thrust * 1e3, af)[1],
        (0.0, times[-1]), state(alpha), "DOP853", times, max_step=0.02, rtol=1e-9, atol=1e-11,
    ).y.T  # fmt: skip
    m = np.zeros(len(times), MEASUREMENT)
    for k, (t, x) in enumerate(zip(times, path, strict=True)):
        u = trim + controls(t)
        specific, _, air = accelerations(x, u, thrust * 1e3, af)
        m[k]["airspeed"], m[k]["alpha"], m[k]["beta"] = air[:3]
        m[k]["p"], m[k]["q"], m[k]["r"], m[k]["phi"], m[k]["theta"] = x[3:]
        m[k]["ax"], m[k]["ay"], m[k]["az"] = specific
        m[k]["elevator"], m[k]["aileron"], m[k]["rudder"] = u
    m["time"], m["temperature"], m["pressure"] = times, TEMPERATURE, DENSITY * 287.05287 * TEMPERATURE
    m["thrust_left"] = m["thrust_right"] = thrust * 500.0
    return m


# Standard deviations of the errors of measurement (NASA research instruments: 0.1 deg, 0.1 deg/s, 0.05 m/s2, assumed).
NOISE = {"airspeed": 0.3, "alpha": 0.001745, "beta": 0.001745, "p": 0.001745, "q": 0.001745, "r": 0.001745,
         "phi": 0.001745, "theta": 0.001745, "ax": 0.05, "ay": 0.05, "az": 0.05,
         "elevator": 0.0005236, "aileron": 0.0005236, "rudder": 0.0005236}  # fmt: skip


def noisy(measurement: np.ndarray, seed: int) -> np.ndarray:
    """The same flight as instruments with white noise would have read it."""
    random, out = np.random.default_rng(seed), measurement.copy()
    for name, deviation in NOISE.items():
        out[name] += deviation * random.standard_normal(len(out))
    return out
