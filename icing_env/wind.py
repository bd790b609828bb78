"""Steady wind with a linear shear in altitude; the velocity of the air over the ground."""

from __future__ import annotations

from typing import Any

from icing_env.jit import kernel
from icing_env.types import Field

WIND_PARAMETERS: list[Field] = [
    ("wind_north", "m/s", "velocity of the air towards north at wind_reference_altitude"),
    ("wind_east", "m/s", "velocity of the air towards east at wind_reference_altitude"),
    ("wind_down", "m/s", "velocity of the air downwards, at every altitude"),
    ("wind_north_shear", "1/s", "growth of the northward wind with altitude"),
    ("wind_east_shear", "1/s", "growth of the eastward wind with altitude"),
    ("wind_reference_altitude", "m", "altitude at which wind_north and wind_east hold"),
]


@kernel
def wind(altitude: float, p: Any) -> tuple[float, float, float]:
    """Velocity of the air.

    Args:
        altitude: m.
        p: WIND_PARAMETERS.

    Returns:
        North, east, down components, m/s.
    """
    above = altitude - p.wind_reference_altitude
    return p.wind_north + p.wind_north_shear * above, p.wind_east + p.wind_east_shear * above, p.wind_down
