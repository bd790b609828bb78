"""Every number that describes one aircraft, its instruments and its weather, in one structured row.

Each phenomenon lists its own numbers beside its equations; this file concatenates them. An effect changes numbers
of this row and nothing else, so that an aircraft without effects runs exactly the same instructions.
"""

from __future__ import annotations

from numpy.typing import NDArray

from icing_env.accretion import ACCRETION_PARAMETERS
from icing_env.actuators import ACTUATOR_PARAMETERS
from icing_env.aerodynamics import AERODYNAMIC_PARAMETERS
from icing_env.cloud import CLOUD_PARAMETERS
from icing_env.crosstalk import CROSSTALK_PARAMETERS
from icing_env.discrepancy import DISCREPANCY_PARAMETERS
from icing_env.ice_protection import PROTECTION_PARAMETERS
from icing_env.propulsion import PROPULSION_PARAMETERS
from icing_env.sensors import SENSOR_PARAMETERS
from icing_env.severity import SEVERITY_PARAMETERS
from icing_env.turbulence import TURBULENCE_PARAMETERS
from icing_env.types import Field, structured, units
from icing_env.wind import WIND_PARAMETERS

MASS_PARAMETERS: list[Field] = [
    ("mass", "kg", "mass without ice"),
    ("inertia_xx", "kg m2", "moment of inertia about body x"),
    ("inertia_yy", "kg m2", "moment of inertia about body y"),
    ("inertia_zz", "kg m2", "moment of inertia about body z"),
    ("inertia_xz", "kg m2", "product of inertia, + integral of x z dm"),
    ("cg_shift_x", "m", "c.g. forward of the point the coefficients refer to"),
    ("cg_shift_y", "m", "c.g. to the right of it"),
    ("cg_shift_z", "m", "c.g. below it"),
]
EARTH_PARAMETERS: list[Field] = [
    ("gravity_sea_level", "m/s2", "gravity at sea level"),
    ("earth_radius", "m", "radius in g(h)"),
    ("ground_altitude", "m", "altitude of the ground"),
    ("density_factor", "1", "air density over that of pressure and temperature"),
]
GROUPS: dict[str, list[Field]] = {
    "mass": MASS_PARAMETERS,
    "aerodynamics": AERODYNAMIC_PARAMETERS,
    "discrepancy": DISCREPANCY_PARAMETERS,
    "propulsion": PROPULSION_PARAMETERS,
    "actuators": ACTUATOR_PARAMETERS,
    "earth": EARTH_PARAMETERS,
    "wind": WIND_PARAMETERS,
    "cloud": CLOUD_PARAMETERS,
    "severity": SEVERITY_PARAMETERS,
    "accretion": ACCRETION_PARAMETERS,
    "ice_protection": PROTECTION_PARAMETERS,
    "sensors": SENSOR_PARAMETERS,
    "crosstalk": CROSSTALK_PARAMETERS,
    "turbulence": TURBULENCE_PARAMETERS,
}
# What the equations of motion read comes first: `icing_env.blocks` takes no more than that.
IN_MOTION = ("mass", "aerodynamics", "discrepancy", "propulsion", "actuators", "earth", "wind", "cloud")
ZERO_UNLESS_GIVEN = ("discrepancy", "crosstalk")  # what no file has to say
N_IN_MOTION = sum(len(GROUPS[group]) for group in IN_MOTION)
PARAMETER_FIELDS: list[Field] = [field for group in GROUPS.values() for field in group]
PARAMETERS = structured(PARAMETER_FIELDS)
UNITS = units(PARAMETER_FIELDS)


def as_bytes(rows: NDArray) -> NDArray:
    """The same memory as one opaque field a row [n]: NumPy moves hundreds of named ones one by one, slowly."""
    return rows.view(f"V{rows.dtype.itemsize}")


def copied(rows: NDArray) -> NDArray:
    """A copy of structured rows."""
    return as_bytes(rows).copy().view(rows.dtype)
