"""Non-dimensional force and moment coefficients from what was measured.

Definitions: Klein & Morelli, Aircraft System Identification (AIAA 2006), section 5.1, and those printed for SIDPAC's
data channels: CX = (m ax - T)/(qbar S), CY, CZ = m a/(qbar S), CL = CX sin(alpha) - CZ cos(alpha),
CD = -CX cos(alpha) - CZ sin(alpha), moments by the full rigid-body equations with Ixz; hat rates are rate times c/2V or
b/2V. The moment of the thrust about the c.g. is not subtracted: it lies in Cm_0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.atmosphere import GAS_CONSTANT, density
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray, Geometry


@dataclass(frozen=True)
class Airframe:
    """Mass (kg), inertia (xx, yy, zz, xz; kg m2) and reference geometry that coefficients are formed with."""

    mass: float
    inertia: tuple[float, float, float, float]
    geometry: Geometry

    @staticmethod
    def from_parameters(row: NDArray[Any] | np.void) -> Airframe:
        """From one row of the aircraft's parameters (fields mass, inertia_*, wing_area, span, chord)."""
        row = np.asarray(row).reshape(-1)[0]
        inertia = (row["inertia_xx"], row["inertia_yy"], row["inertia_zz"], row["inertia_xz"])
        geometry = Geometry(float(row["wing_area"]), float(row["span"]), float(row["chord"]))
        xx, yy, zz, xz = (float(x) for x in inertia)
        return Airframe(float(row["mass"]), (xx, yy, zz, xz), geometry)


def airframe_of(record: FlightRecord, default: Airframe | None = None) -> Airframe:
    """What the record states of its airframe, the rest from `default`.

    Raises:
        InputError: the record is silent and there is no default.
    """
    meta, found = record.meta, default
    if found is None:
        for key in ("mass", "inertia", "geometry"):
            if getattr(meta, key) is None:
                raise InputError(f"record '{meta.name}' states no {key}; give it in the .toml beside it")
        found = Airframe(meta.mass, meta.inertia, meta.geometry)  # type: ignore[arg-type]
    return replace(
        found,
        mass=meta.mass or found.mass,
        inertia=meta.inertia or found.inertia,
        geometry=meta.geometry or found.geometry,
    )


def dynamic_pressure(values: Mapping[str, FloatArray]) -> FloatArray:
    """Dynamic pressure, Pa, shape (N,).

    The owner's, where stated; else from airspeed and the owner's density, or pressure and temperature, or the
    standard atmosphere (US 1976) at the recorded altitude.
    """
    if "qbar" in values:
        return values["qbar"]
    if "density" in values:
        rho = values["density"]
    elif "pressure" in values and "temperature" in values:
        rho = values["pressure"] / (GAS_CONSTANT * values["temperature"])
    elif "altitude" in values:
        rho = np.array([density(float(h)) for h in values["altitude"]])
    else:
        raise InputError("no air density: the record needs altitude, or pressure and temperature")
    return 0.5 * rho * values["airspeed"] ** 2


def thrust(values: Mapping[str, FloatArray]) -> FloatArray | None:
    """Sum of both engines' thrust along x, N, shape (N,); None where it was not recorded."""
    if "thrust_left" not in values or "thrust_right" not in values:
        return None
    return values["thrust_left"] + values["thrust_right"]


def body_forces(values: Mapping[str, FloatArray], qbar: FloatArray, airframe: Airframe) -> dict[str, FloatArray]:
    """CX, CY, CZ (each (N,)) of the accelerations recorded. CX contains thrust where thrust was not recorded."""
    force = qbar * airframe.geometry.wing_area
    mass = values.get("mass", np.full(len(qbar), airframe.mass))
    push = thrust(values)
    out = {}
    if "ax" in values:
        out["CX"] = (mass * values["ax"] - (0.0 if push is None else push)) / force
    for name, acceleration in (("CY", "ay"), ("CZ", "az")):
        if acceleration in values:
            out[name] = mass * values[acceleration] / force
    return out


def lift_drag(CX: FloatArray, CZ: FloatArray, alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
    """CL and CD, each (N,), from body-axis coefficients and the angle of attack (rad)."""
    return CX * np.sin(alpha) - CZ * np.cos(alpha), -CX * np.cos(alpha) - CZ * np.sin(alpha)


def products(p: FloatArray, q: FloatArray, r: FloatArray) -> dict[str, FloatArray]:
    """Products of rates (rad2/s2) that the moment equations need, each (N,)."""
    return {"pq": p * q, "qr": q * r, "pr": p * r, "pp_rr": p * p - r * r}


def moment_coefficients(
    accelerations: tuple[FloatArray, FloatArray, FloatArray],
    product: Mapping[str, FloatArray],
    qbar: FloatArray,
    airframe: Airframe,
) -> dict[str, FloatArray]:
    """Cl, Cm, Cn (each (N,)) from angular accelerations (rad/s2), `products` of the rates and qbar (Pa).

    The products are given, not the rates, so that they can pass through the filter that the accelerations came from.
    """
    xx, yy, zz, xz = airframe.inertia
    p_dot, q_dot, r_dot = accelerations
    rolling = xx * p_dot - xz * (product["pq"] + r_dot) + (zz - yy) * product["qr"]
    pitching = yy * q_dot + (xx - zz) * product["pr"] + xz * product["pp_rr"]
    yawing = zz * r_dot - xz * (p_dot - product["qr"]) + (yy - xx) * product["pq"]
    force = qbar * airframe.geometry.wing_area
    span, chord = airframe.geometry.span, airframe.geometry.chord
    return {"Cl": rolling / (force * span), "Cm": pitching / (force * chord), "Cn": yawing / (force * span)}


def hat_rates(values: Mapping[str, FloatArray], airframe: Airframe) -> dict[str, FloatArray]:
    """p b/2V, q c/2V and r b/2V of the rates recorded, each (N,)."""
    geometry = airframe.geometry
    lengths = {"p": geometry.span, "q": geometry.chord, "r": geometry.span}
    return {f"{n}_hat": values[n] * length / (2.0 * values["airspeed"]) for n, length in lengths.items() if n in values}
