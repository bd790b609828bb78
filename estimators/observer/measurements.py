"""A flight record as the measurements and the airframe that the recursive identifiers take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimators.airframe import airframe_from, published_airframe
from estimators.observer.rows import GAS_CONSTANT
from estimators.regression.equations import NEEDED
from estimators.signals.coefficients import dynamic_pressure
from estimators.signals.instruments import calibration, time_constant
from estimators.signals.resample import Grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord
from icing_env.types import MEASUREMENT

REFERENCE_TEMPERATURE = 288.15  # K: only the density, pressure over temperature, enters the observer


def airframe_of_record(record: FlightRecord, airframe: NDArray[np.void] | None) -> NDArray[np.void]:
    """One AIRFRAME row: `airframe` or the published one; mass, inertia, geometry and vanes as the record states."""
    aircraft = airframe_from(published_airframe() if airframe is None else airframe)[:1].copy()
    meta = record.meta
    if meta.mass is not None:
        aircraft["mass"] = meta.mass
    if meta.inertia is not None:
        for name, value in zip(("xx", "yy", "zz", "xz"), meta.inertia, strict=True):
            aircraft[f"inertia_{name}"] = value
    if meta.geometry is not None:
        aircraft["wing_area"], aircraft["span"] = meta.geometry.wing_area, meta.geometry.span
        aircraft["chord"] = meta.geometry.chord
    known = calibration(meta.sensors)
    if known.stated:
        aircraft["vane_lag"] = time_constant(known.lag("alpha"), record.dt)
        aircraft["boom_gain"] = known.bending
    return aircraft


def absent(grid: Grid) -> dict[str, list[str]]:
    """Channels that each axis lacks."""
    return {axis: [n for n in needed if n not in grid.values] for axis, needed in NEEDED.items()}


def measurements(grid: Grid, record: FlightRecord) -> NDArray[np.void]:
    """The record as MEASUREMENT rows: nan inside gaps of what an axis needs, zero for what was never recorded.

    Without theta the flight path is taken as level; the axis whose channels are absent is not reported anyway.
    """
    lacks = absent(grid)
    if all(lacks.values()):
        told = "; ".join(f"{axis} needs {', '.join(names)}" for axis, names in lacks.items())
        raise InputError(f"record '{record.meta.name}' lacks columns: {told}")
    measurement = np.zeros(len(grid.time), MEASUREMENT)
    for name in MEASUREMENT.names or ():
        if name in grid.values:
            measurement[name] = grid.values[name]
            if name in grid.missing:
                measurement[name][grid.missing[name]] = np.nan
    if "theta" not in grid.values:
        measurement["theta"] = measurement["alpha"]
    density = 2.0 * dynamic_pressure(grid.values) / grid.values["airspeed"] ** 2
    measurement["time"], measurement["temperature"] = grid.time, REFERENCE_TEMPERATURE
    measurement["pressure"] = density * GAS_CONSTANT * REFERENCE_TEMPERATURE
    return measurement
