"""What the characteriser may know of the clean aircraft: the observer's airframe, tail, propellers, elevator hinge."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.airframe import AIRFRAME_FIELDS
from icing_env.configuration import read_toml
from icing_env.errors import InputError
from icing_env.types import Field, structured

CLEAN_FIELDS: list[Field] = [
    ("tail_arm", "m", "c.g. to quarter chord of the tailplane"),
    ("Cm_alphadot", "1", "part of Cm_q that is downwash lag"),
    ("Cm_alpha_tail", "1/rad", "moment of the tailplane alone per angle of attack at the tail"),
    ("CT_reference", "1", "thrust coefficient at which the derivatives were measured"),
    ("CZ_CT", "1", "lift per thrust coefficient"),
    ("Cm_elevator_CT", "1", "relative gain of elevator power per thrust coefficient"),
    ("engine_arm_y", "m", "engine to the plane of symmetry"),
    ("engine_arm_z", "m", "thrust line below the c.g."),
    ("propeller_efficiency", "1", "efficiency at speed"),
    ("propeller_static_speed", "m/s", "static thrust is efficiency times power over it"),
    ("downwash_slope", "1", "downwash angle per angle of attack"),
    ("tail_incidence", "rad", "tailplane incidence"),
    ("hinge_elevator_volume", "m3", "area times chord of the elevator"),
    ("hinge_elevator_delta", "1/rad", "hinge-moment coefficient per deflection"),
    ("hinge_elevator_alpha", "1/rad", "hinge-moment coefficient per local angle of attack"),
    *AIRFRAME_FIELDS,  # last: a type that merely went on after AIRFRAME would pass for one in numba
]
CLEAN = structured(CLEAN_FIELDS)
OPTIONAL = ("CL_flap", "CD_flap", "Cm_flap", "induced_drag", "vane_lag", "boom_gain")  # 0 where they are not stated


def clean_from(parameters: NDArray[Any] | Mapping[str, float]) -> NDArray[np.void]:
    """Fields of CLEAN out of a structured array (a row per aircraft) or a mapping (one aircraft).

    Raises:
        InputError: a field is missing (the first is named).
    """
    rows, present = 1, tuple(parameters)
    if isinstance(parameters, np.ndarray):
        rows, present = parameters.size, parameters.dtype.names or ()
    names = CLEAN.names or ()
    missing = [name for name in names if name not in (*present, *OPTIONAL)]
    if missing:
        raise InputError(f"clean aircraft: field '{missing[0]}' is missing; needed: {', '.join(names)}")
    clean = np.zeros(rows, CLEAN)
    for name in names:
        if name in present:
            clean[name] = parameters[name]
    return clean


def published_clean(aircraft: str | Path = "twin_otter") -> NDArray[np.void]:
    """The clean aircraft as `configs/aircraft` states it, with the sources there (`CLEAN` array of one row)."""
    data = read_toml("aircraft", aircraft)
    numbers = {} if "base" not in data else _numbers(read_toml("aircraft", data["base"]))
    return clean_from(numbers | _numbers(data))


def _numbers(data: Mapping[str, Any]) -> dict[str, float]:
    sections = [entries for entries in data.values() if isinstance(entries, dict)]
    return {name: entry["value"] for entries in sections for name, entry in entries.items()}
