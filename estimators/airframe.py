"""What an observer may know of its aircraft beforehand: mass, size and the clean derivatives, nothing of the ice."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from icing_env.configuration import read_toml
from icing_env.errors import InputError
from icing_env.types import DERIVATIVE_NAMES, Field, structured, unit_of

AIRFRAME_FIELDS: list[Field] = [
    ("wing_area", "m2", "reference area"),
    ("span", "m", "reference span"),
    ("chord", "m", "reference chord"),
    ("mass", "kg", "mass assumed by the observer"),
    ("inertia_xx", "kg m2", "about body x"),
    ("inertia_yy", "kg m2", "about body y"),
    ("inertia_zz", "kg m2", "about body z"),
    ("inertia_xz", "kg m2", "+ integral of x z dm"),
    *((name, unit_of(name), "clean aircraft") for name in DERIVATIVE_NAMES),
    ("CL_flap", "1/rad", "lift of flap"),
    ("CD_flap", "1/rad", "parasite drag of flap"),
    ("Cm_flap", "1/rad", "moment of flap"),
    ("induced_drag", "1", "K of CD = CD_0 + K CL^2, for the drag of flap lift"),
    ("vane_lag", "s", "known time constant of the flow vanes, for which they are corrected; 0 where it is not stated"),
    ("boom_gain", "rad s2/m", "known bending of the boom: error of alpha per normal acceleration; as above"),
]
AIRFRAME = structured(AIRFRAME_FIELDS)
OPTIONAL = ("CL_flap", "CD_flap", "Cm_flap", "induced_drag", "vane_lag", "boom_gain")  # 0 where they are not stated


def published_airframe(aircraft: str | Path = "twin_otter") -> np.ndarray:
    """The clean airframe as `configs/aircraft` states it, with the sources there (`AIRFRAME` array of one row)."""
    return airframe_from(_stated(aircraft))


def _stated(aircraft: str | Path) -> dict[str, float]:
    """Every number of an aircraft file; a file with `base = "..."` starts from that one."""
    data = read_toml("aircraft", aircraft)
    numbers = _stated(data["base"]) if "base" in data else {}
    sections = [entries for entries in data.values() if isinstance(entries, dict)]
    return numbers | {name: float(entry["value"]) for entries in sections for name, entry in entries.items()}


def airframe_from(parameters: np.ndarray | Mapping[str, float]) -> np.ndarray:
    """Copy the fields of `AIRFRAME` out of a structured array of any length, or out of a mapping (one aircraft).

    Returns an `AIRFRAME` array with as many rows. Raises InputError naming the first field that is missing.
    """
    names = AIRFRAME.names or ()
    if isinstance(parameters, np.ndarray):
        rows, present = parameters.size, parameters.dtype.names or ()
    else:
        rows, present = 1, tuple(parameters)
    missing = [name for name in names if name not in (*present, *OPTIONAL)]
    if missing:
        raise InputError(f"airframe: field '{missing[0]}' is missing; needed: {', '.join(names)}")
    airframe = np.zeros(rows, AIRFRAME)
    for name in names:
        if name in present:
            airframe[name] = parameters[name]
    return airframe
