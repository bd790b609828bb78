"""All effects, by registration: importing this package fills `registry.KNOWN` and `registry.UNKNOWN`, in this order."""

from __future__ import annotations

from testbed.elsewhere.effects import (
    known_air,
    known_controls,
    known_ice,
    known_mass,
    known_power,
    known_sensors,
    unknown_aero,
    unknown_air,
    unknown_controls,
    unknown_mass,
    unknown_power,
    unknown_sensors,
)
from testbed.elsewhere.effects.registry import KNOWN, UNKNOWN, Effect

__all__ = [
    "KNOWN", "UNKNOWN", "Effect", "known_air", "known_controls", "known_ice", "known_mass", "known_power",
    "known_sensors", "unknown_aero", "unknown_air", "unknown_controls", "unknown_mass", "unknown_power",
    "unknown_sensors",
]  # fmt: skip
