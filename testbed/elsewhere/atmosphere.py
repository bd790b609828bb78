"""Standard atmosphere of the troposphere with a temperature offset (ISO 2533)."""

from __future__ import annotations

from typing import Any

import numpy as np

GAS = 287.05287  # J/(kg K)
LAPSE = 0.0065  # K/m
SEA_TEMPERATURE, SEA_PRESSURE = 288.15, 101325.0
EXPONENT = 9.80665 / (LAPSE * GAS)


def atmosphere(altitude: Any, offset: float = 0.0) -> tuple[Any, Any, Any]:
    """Static temperature in K, pressure in Pa and density in kg/m3 at pressure `altitude` in m; `offset` in K."""
    standard = SEA_TEMPERATURE - LAPSE * altitude
    pressure = SEA_PRESSURE * np.power(standard / SEA_TEMPERATURE, EXPONENT)
    temperature = standard + offset
    return temperature, pressure, pressure / (GAS * temperature)
