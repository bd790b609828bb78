"""Shaft powers that drive the model along a record: from what tells them best.

Torque where recorded; else thrust, through the propeller's chart; else the levers, through the engines' spool, with a
chart between lever and power that is uncertain (`candidates.nuisances`); else what the recorded axial acceleration
asks for beside the model's own drag. That acceleration is then no longer there to be compared, and nothing that a
thrust may do as well can be told.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from icing_env.atmosphere import density, pressure
from icing_env.propulsion import power_available
from icing_env.record import FloatArray

SIDES = ("left", "right")
Powers = dict[str, FloatArray]


def powers(row: NDArray, values: Mapping[str, FloatArray], altitude: FloatArray, dt: float,
           notes: list[str]) -> tuple[str, Powers]:  # fmt: skip
    """Powers left and right (W) at every sample, and where they come from: "torque", "thrust", "throttle", "balance".

    Args:
        row: one PARAMETERS row.
        values: channels by name (N,).
        altitude: m (N,).
        dt: s.
        notes: gets what was assumed.
    """
    p = row[0]
    per_power = thrust_per_power(p, values["airspeed"], values["alpha"])
    if all(f"torque_{s}" in values for s in SIDES):
        rpm = {s: values.get(f"rpm_{s}", np.full(len(altitude), p["propeller_rpm"])) for s in SIDES}
        return "torque", {f"power_{s}": values[f"torque_{s}"] * rpm[s] * math.pi / 30.0 for s in SIDES}
    if all(f"thrust_{s}" in values for s in SIDES):
        notes.append("torque not recorded: power from the recorded thrust")
        return "thrust", {f"power_{s}": values[f"thrust_{s}"] / per_power for s in SIDES}
    if all(f"throttle_{s}" in values for s in SIDES):
        notes.append("thrust and torque not recorded: power from the levers, through the published chart and spool")
        full = np.array([power_available(pressure(float(h)), p) for h in altitude])
        return "throttle", {f"power_{s}": _spooled(full * np.clip(values[f"throttle_{s}"], 0.0, 1.0), p, dt)
                            for s in SIDES}  # fmt: skip
    notes.append("thrust, torque and levers not recorded: the power that the axial acceleration asks for")
    return "balance", {f"power_{s}": 0.5 * _balancing(p, values, altitude) / per_power for s in SIDES}


def thrust_per_power(p: NDArray, airspeed: FloatArray, alpha: FloatArray) -> FloatArray:
    """What a watt of shaft power pulls with, N/W (icing_env.propulsion), at a recorded airspeed [m/s] and alpha (N,).

    The propellers meet the part of it along the body's axis; what sideslip takes off that is left out.
    """
    forward = airspeed * np.cos(alpha)
    return np.asarray(p["propeller_efficiency"] / np.sqrt(forward**2 + p["propeller_static_speed"] ** 2))


def _spooled(wanted: FloatArray, p: NDArray, dt: float) -> FloatArray:
    """Powers behind the engines' spool, settled at the start (N,)."""
    share = 1.0 - math.exp(-dt / float(p["spool_time"]))
    return np.asarray(lfilter([share], [1.0, share - 1.0], wanted, zi=[(1.0 - share) * wanted[0]])[0])


def _balancing(p: NDArray, values: Mapping[str, FloatArray], altitude: FloatArray) -> FloatArray:
    """Thrust of both engines that the axial acceleration asks for beside the model's attached flow (N,)."""
    rho = np.array([density(float(h)) for h in altitude])
    qs = 0.5 * rho * values["airspeed"] ** 2 * p["wing_area"]
    alpha = values["alpha"]
    axial = qs * (p["CX_0"] + p["CX_alpha"] * alpha + p["CX_alpha2"] * alpha**2)
    return np.asarray(np.maximum(p["mass"] * values["ax"] - axial, 0.0))
