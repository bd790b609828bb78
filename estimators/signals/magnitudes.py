"""Units and signs that magnitudes alone betray: temperatures, speeds, masses, engines, clouds.

Each of these has one sign, and a size that no other unit of it shares in flight, or is told by another channel: the
atmosphere ties altitude to pressure (US Standard Atmosphere 1976), the wind parts ground speed from airspeed by no
ratio of units. Bounds are assumed.
"""

from __future__ import annotations

import math

import numpy as np

from estimators.signals.consistency import nearest_unit
from icing_env.atmosphere import pressure as pressure_at
from icing_env.errors import InputError
from icing_env.record import FlightRecord
from icing_env.record.table import check_radians

SPEEDS = {"knots": 1.9438, "ft/s": 3.2808, "mph": 2.2369, "km/h": 3.6}
POUNDS = {"pounds": 2.2046, "slugs": 0.068522}
POSITIVE = ("airspeed", "ground_speed", "mass", "temperature", "pressure", "rpm_left", "rpm_right", "throttle_left",
            "throttle_right", "lwc", "mvd")  # fmt: skip
LEAST = {"temperature": (150.0, "Celsius", "K"), "pressure": (2000.0, "hPa", "Pa")}
MOST = {"lwc": (0.01, "g/m3", "kg/m3"), "mvd": (0.003, "micrometres", "m"), "track": (7.0, "degrees", "rad"),
        "throttle_left": (1.5, "per cent", "0..1"), "throttle_right": (1.5, "per cent", "0..1")}  # fmt: skip
USUAL = 95.0  # per cent of samples below what counts as largest: a spike is no unit


def check_magnitudes(record: FlightRecord) -> None:
    """Refuse degrees, g, Celsius, hPa, g/m3, pounds and negative amounts where magnitudes betray them.

    Raises:
        InputError: names the channel and what it looks like.
    """
    where = f"record '{record.meta.name}'"
    check_radians(record.channels, where)
    median = {name: float(np.nanmedian(record[name])) for name in record.channels if record.has(name)}
    _check_az(where, median)
    for name in POSITIVE:
        if median.get(name, 0.0) < 0.0:
            raise InputError(f"{where}: column '{name}' has its sign reversed: median {median[name]:.4g}")
    for name, (least, unit, right) in LEAST.items():
        if median.get(name, least) < least:
            value = median[name]
            raise InputError(f"{where}: column '{name}' looks like {unit}: median {value:.4g}; {right} is required")
    for name, (most, unit, right) in MOST.items():
        large = float(np.nanpercentile(np.abs(record[name]), USUAL)) if record.has(name) else 0.0
        if large > most:
            raise InputError(f"{where}: column '{name}' looks like {unit}: it reaches {large:.4g}; {right} is required")
    _check_altitude(where, median)
    _check_speeds(where, median)
    if "mass" in median and record.meta.mass:
        ratio = median["mass"] / record.meta.mass
        unit = nearest_unit(ratio, POUNDS)
        if unit:
            raise InputError(f"{where}: column 'mass' looks like {unit}: {ratio:.3g} times the mass that is stated")


def _check_az(where: str, median: dict[str, float]) -> None:
    az = median.get("az", -9.8)
    if abs(az) < 2.0:
        raise InputError(f"{where}: column 'az' looks like g: median {az:.3g}; level flight reads -9.8 m/s2")
    if abs(az) > 20.0:
        unit = "looks like ft/s2" if 28.0 < abs(az) < 36.0 else "is not in m/s2"
        raise InputError(f"{where}: column 'az' {unit}: median {az:.3g}; level flight reads -9.8 m/s2")
    if az > 0:
        raise InputError(f"{where}: column 'az' has its sign reversed: median {az:.3g}; level flight reads -9.8")


def _check_altitude(where: str, median: dict[str, float]) -> None:
    """Altitude and static pressure (or the owner's density) belong together to 15 %: 1,200 m."""
    if "altitude" not in median:
        return
    height = median["altitude"]
    if height < -500.0:
        raise InputError(f"{where}: column 'altitude' has its sign reversed: median {height:.4g} m")
    ratio = median["pressure"] / pressure_at(height) if "pressure" in median else 1.0
    if abs(math.log(ratio)) > 0.15:
        feet = median["pressure"] / pressure_at(0.3048 * height)
        unit = "looks like feet" if abs(math.log(feet)) < 0.15 else "is not in m"
        raise InputError(f"{where}: column 'altitude' {unit}: {height:.4g} against a pressure of "
                         f"{median['pressure']:.5g} Pa")  # fmt: skip


def _check_speeds(where: str, median: dict[str, float]) -> None:
    """Airspeed and ground speed differ by the wind, not by a ratio of units."""
    if not all(name in median for name in ("airspeed", "ground_speed")):
        return
    ratio = median["airspeed"] / max(median["ground_speed"], 1.0)
    for name, value in (("airspeed", ratio), ("ground_speed", 1.0 / ratio)):
        unit = nearest_unit(value, SPEEDS)
        if unit:
            other = "ground speed" if name == "airspeed" else "airspeed"
            raise InputError(f"{where}: column '{name}' looks like {unit}: it is {value:.2f} times the {other}")
