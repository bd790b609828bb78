"""Flow angles and accelerations brought to the centre of gravity, where the record says that they are not there yet.

Source: Klein & Morelli, Aircraft System Identification (AIAA 2006), chapter 10: a vane at x ahead of, y right of and
z below the centre of gravity reads alpha - x q / V + y p / V and beta + x r / V - z p / V; an accelerometer there reads
a + omega' x r + omega x (omega x r).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimators.signals.differentiate import half_width, slope
from icing_env.errors import InputError
from icing_env.record import FloatArray

VANES, ACCELEROMETERS = ("alpha", "beta"), ("ax", "ay", "az")


def at_centre_of_gravity(
    values: Mapping[str, FloatArray], sensors: Mapping[str, Any], dt: float
) -> tuple[dict[str, FloatArray], tuple[str, ...]]:
    """`values` with flow angles and accelerations at the centre of gravity, and a sentence for each correction.

    Args:
        values: channels by name (N,).
        sensors: of the record's side file; an entry such as `alpha = {position = [x, y, z], corrected = false}` (m
            from the centre of gravity) asks for the correction, `accelerometers` likewise.
        dt: s.

    Raises:
        InputError: a position that is not three numbers.
    """
    out, told = dict(values), []
    zero = np.zeros(len(values["airspeed"]))
    p, q, r = (values.get(name, zero) for name in ("p", "q", "r"))
    for name in VANES:
        place = _position(sensors, name)
        if place is None or name not in out:
            continue
        x, y, z = place
        turned = (x * q - y * p) if name == "alpha" else (z * p - x * r)
        out[name] = out[name] + turned / values["airspeed"]
        told.append(f"{name} corrected for the vane's place {x:g}, {y:g}, {z:g} m from the centre of gravity")
    place = _position(sensors, "accelerometers")
    if place is not None:
        shift = _felt(place, (p, q, r), dt)
        out |= {name: out[name] - shift[i] for i, name in enumerate(ACCELEROMETERS) if name in out}
        told.append(
            f"accelerations corrected for {place[0]:g}, {place[1]:g}, {place[2]:g} m from the centre of gravity"
        )
    return out, tuple(told)


def _position(sensors: Mapping[str, Any], name: str) -> tuple[float, float, float] | None:
    """Where a sensor is, if what it reads still has to be corrected."""
    entry = sensors.get(name)
    if not isinstance(entry, Mapping) or "position" not in entry or entry.get("corrected", False):
        return None
    place = entry["position"]
    if not isinstance(place, (list, tuple)) or len(place) != 3 or not all(isinstance(v, (int, float)) for v in place):
        raise InputError(f"sensors.{name}.position must be [x, y, z] in m from the centre of gravity, got {place}")
    return float(place[0]), float(place[1]), float(place[2])


def _felt(
    place: tuple[float, float, float], rates: tuple[FloatArray, FloatArray, FloatArray], dt: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Acceleration that the rotation adds at a place (m/s2, each (N,)); at the ends that of the nearest slope known."""
    half = half_width(dt)
    omega = np.stack(rates, axis=1)
    change = np.stack([_filled(slope(rate, dt, half)) for rate in rates], axis=1)
    r = np.broadcast_to(np.asarray(place), omega.shape)
    felt = np.cross(change, r) + np.cross(omega, np.cross(omega, r))
    return felt[:, 0], felt[:, 1], felt[:, 2]


def _filled(values: FloatArray) -> FloatArray:
    rows = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), rows, values[rows])
