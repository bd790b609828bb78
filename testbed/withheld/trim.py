"""Steady level flight of an aircraft that may have an effect in it: Newton's method on the plant's own rates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.withheld import plant as pl

ALTITUDE = 2200.0  # m, of the flight records
MOST_LEVER = 0.92  # leaves room for what the manoeuvres add
_ZERO = np.zeros(pl.GUSTS)
# rates that vanish; the seven unknown of flight and the commands that hold them
_STILL = (pl.H, pl.U, pl.V, pl.W, pl.P, pl.Q, pl.R, pl.DE, pl.DA, pl.DR, pl.PL, pl.PR)


def trimmed(row: NDArray, speed: float) -> tuple[NDArray, NDArray]:
    """State [27] and commands [5] of steady flight at `speed` [m/s] through the air, no sideslip.

    Level where the engines can; else at MOST_LEVER and descending.

    Raises:
        ArithmeticError: nothing within 1e-3 (SI) of steady flight was found.
    """
    row["altitude_start"] = ALTITUDE
    best, z = _steady(row, speed)
    if best > 1e-3 and (dead := float(row["aileron_dead"][0])):  # where the ailerons rest in it, it has no slope
        row["aileron_dead"] = 0.0
        best, z = _steady(row, speed)
        row["aileron_dead"], z[7] = dead, z[7] + np.copysign(dead, z[7])
    if best > 1e-3:
        raise ArithmeticError(f"no steady flight at {speed:g} m/s: rates of {best:.2g} are left")
    return _place(row, speed, z)


def _steady(row: NDArray, speed: float) -> tuple[float, NDArray]:
    """The same for the unknowns: level, or at MOST_LEVER."""
    best, z = _newton(row, speed, 0.0)
    if best > 1e-3 or z[9] > MOST_LEVER:
        best, z = _newton(row, speed, MOST_LEVER)
    return best, z


def _newton(row: NDArray, speed: float, lever: float) -> tuple[float, NDArray]:
    """Largest rate left and the unknowns; the lever is free if `lever` is 0, else given and the height free."""
    z = np.array([0.05, 0.0, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.4, 2e5, 2e5])
    size = np.array([1e-5] * 10 + [10.0, 10.0])
    best, found = np.inf, z
    for _ in range(40):
        left = _residual(row, speed, z, lever)
        norm = float(np.max(np.abs(left)))
        if norm < best:
            best, found = norm, z.copy()
        if norm < 1e-9:
            break
        J = np.column_stack([(_residual(row, speed, z + h, lever) - left) / h[i] for i, h in enumerate(np.diag(size))])
        step = np.linalg.lstsq(J, -left, rcond=1e-10)[0]
        z = z + step * min(1.0, 0.3 / max(float(np.max(np.abs(step[:10]))), 1e-12))
    return best, found


def _place(row: NDArray, speed: float, z: NDArray) -> tuple[NDArray, NDArray]:
    """alpha, phi, theta, surfaces, their commands, lever, powers -> state and commands."""
    y, u = np.zeros(pl.STATES), np.zeros(5)
    y[pl.H] = ALTITUDE
    y[pl.U], y[pl.W] = speed * np.cos(z[0]), speed * np.sin(z[0])
    y[pl.PHI], y[pl.THETA] = z[1], z[2]
    up = float(row["wind_up"][0])  # the aircraft rises with the air
    y[pl.U] += up * np.sin(z[2])
    y[pl.V] -= up * np.sin(z[1]) * np.cos(z[2])
    y[pl.W] -= up * np.cos(z[1]) * np.cos(z[2])
    y[pl.DE : pl.DR + 1], u[:3] = z[3:6], z[6:9]
    u[3:5] = z[9]
    y[pl.PL : pl.PR + 1], y[pl.PL2], y[pl.PR2] = z[10:12], z[10], z[11]
    y[pl.ADW] = y[pl.ADW2] = y[pl.ALAG] = z[0]
    y[pl.PLAY] = z[3]
    return y, u


def _residual(row: NDArray, speed: float, z: NDArray, lever: float) -> NDArray:
    y, u = _place(row, speed, z)
    d, o = np.empty(pl.STATES), np.empty(pl.OUTPUTS)
    pl.rates(y, row[0], u, _ZERO, 0.0, d, o)
    left = d[list(_STILL)]
    left[0] = z[9] - lever if lever > 0.0 else left[0] - float(row["wind_up"][0])
    left[7:10] += d[pl.DE1 : pl.DR1 + 1]  # second-order surfaces and spools rest where their second rate vanishes
    left[10:] = 1e-5 * (left[10:] + d[pl.PL2 : pl.PR2 + 1])  # W to the size of the others
    return left
