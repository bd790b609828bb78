"""What an observer may know of its aircraft beforehand: mass, size and the clean derivatives, nothing of the ice."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from icing_env.errors import InputError
from icing_env.types import DERIVATIVE_NAMES, Field, structured

AIRFRAME_FIELDS: list[Field] = [
    ("wing_area", "m2", "reference area"),
    ("span", "m", "reference span"),
    ("chord", "m", "reference chord"),
    ("mass", "kg", "mass assumed by the observer"),
    ("inertia_xx", "kg m2", "about body x"),
    ("inertia_yy", "kg m2", "about body y"),
    ("inertia_zz", "kg m2", "about body z"),
    ("inertia_xz", "kg m2", "+ integral of x z dm"),
    *((name, "1" if name.endswith("_0") else "1/rad", "clean aircraft") for name in DERIVATIVE_NAMES),
]
AIRFRAME = structured(AIRFRAME_FIELDS)

# Published clean set (UIUC/FDC: FGDATA Aircraft-uiuc/TwinOtter/aircraft.dat), per rad; geometry, mass and
# inertia as the NASA record 020214f1 states them (422.4835 ft2, 64.9934 ft, 6.4961 ft, 339.3 slug, ...).
TWIN_OTTER: dict[str, float] = {
    "wing_area": 39.25, "span": 19.81, "chord": 1.98, "mass": 4952.0,
    "inertia_xx": 28345.0, "inertia_yy": 32900.0, "inertia_zz": 52165.0, "inertia_xz": 1528.0,
    "CX_0": -0.0488, "CX_alpha": 0.223, "CX_alpha2": 1.659,
    "CZ_0": -0.360, "CZ_alpha": -5.660, "CZ_q": -19.97, "CZ_elevator": -0.608,
    "Cm_0": 0.040, "Cm_alpha": -1.310, "Cm_q": -34.2, "Cm_elevator": -1.740,
    "CY_beta": -0.6, "CY_p": -0.2, "CY_r": 0.4, "CY_rudder": 0.15,
    "Cl_beta": -0.08, "Cl_p": -0.5, "Cl_r": 0.06, "Cl_aileron": -0.15, "Cl_rudder": 0.015,
    "Cn_beta": 0.1, "Cn_p": -0.06, "Cn_r": -0.18, "Cn_aileron": -0.001, "Cn_rudder": -0.125,
}  # fmt: skip


def airframe_from(parameters: np.ndarray | Mapping[str, float]) -> np.ndarray:
    """Copy the fields of `AIRFRAME` out of a structured array of any length, or out of a mapping (one aircraft).

    Returns an `AIRFRAME` array with as many rows. Raises InputError naming the first field that is missing.
    """
    is_array = isinstance(parameters, np.ndarray)
    present = (parameters.dtype.names or ()) if is_array else parameters.keys()
    missing = [name for name in AIRFRAME.names or () if name not in present]
    if missing:
        raise InputError(f"airframe: field {missing[0]!r} is missing; an observer needs {', '.join(AIRFRAME.names or ())}")
    rows = np.atleast_1d(parameters).shape[0] if is_array else 1
    airframe = np.zeros(rows, AIRFRAME)
    for name in AIRFRAME.names or ():
        airframe[name] = parameters[name]
    return airframe
