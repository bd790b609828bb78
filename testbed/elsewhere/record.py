"""Writes one record as CSV and the TOML beside it, as `icing_env.record` reads them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.aircraft import Loading

ALWAYS = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "psi", "ax", "ay", "az", "elevator", "aileron",
          "rudder", "throttle_left", "throttle_right", "thrust_left", "thrust_right", "altitude", "temperature",
          "pressure")
COMMANDS = ("elevator_command", "aileron_command", "rudder_command")
ENGINE = ("torque_left", "torque_right", "rpm_left", "rpm_right")
SATELLITE = ("ground_speed", "track")
SLOW = ("altitude", "temperature", "pressure", *ENGINE, "throttle_left", "throttle_right", "thrust_left",
        "thrust_right")
VANE = """[sensors.{name}]
position = [{boom}, 0.0, 0.0]
lag = 0.0
filter_hz = {cut}
corrected_to_cg = true
corrected_for_upwash = true
"""


def columns(outfit: Mapping[str, Any]) -> list[str]:
    """Names of the channels that this case's recorder has."""
    names = [*ALWAYS[:15], "flap"]
    names += COMMANDS if outfit["commands"] else ()
    names += ALWAYS[15:]
    names += ENGINE if outfit["engine"] else ()
    names += SATELLITE if outfit["satellite"] else ()
    return names


def write_csv(path: Path, samples: Mapping[str, NDArray], outfit: Mapping[str, Any]) -> None:
    """`samples` name -> (n,); slow channels are blank but for every `outfit["slow_every"]`-th row, GPS at 5 Hz."""
    names, rate = columns(outfit), outfit["rate"]
    n = samples["airspeed"].size
    table = [[f"{k / rate:.3f}" for k in range(n)]]
    for name in names:
        values = samples.get(name, np.zeros(n))
        every = outfit["slow_every"] if name in SLOW else rate // 5 if name in SATELLITE else 1
        table.append([f"{v:.7g}" if k % every == 0 else "" for k, v in enumerate(values)])
    with open(path, "w", encoding="utf-8") as file:
        file.write(",".join(["time", *names]) + "\n")
        file.writelines(",".join(row) + "\n" for row in zip(*table, strict=True))


def write_toml(path: Path, role: str, flight: str, loading: Loading, outfit: Mapping[str, Any]) -> None:
    """The record's description; every case says the same but for numbers."""
    xx, yy, zz, xz = (round(float(v), 1) for v in loading.inertia)
    cut = outfit["filter_hz"]
    vanes = "\n".join(VANE.format(name=name, boom=outfit["boom"], cut=cut) for name in ("alpha", "beta"))
    text = f'''aircraft = "DHC-6 Twin Otter"
flight = "{flight}"
mass = {loading.mass:.1f}
inertia = {{xx = {xx}, yy = {yy}, zz = {zz}, xz = {xz}}}
cg = [5.23, 0.0, 0.31]
role = "{role}"
notes = "Flap 0. Second-order Butterworth anti-alias filter on flow angles, rates, accelerations and surface positions."

{vanes}
[sensors.accelerometer]
position = [0.0, 0.0, 0.0]
filter_hz = {cut}
corrected_to_cg = true

[sensors.airspeed]
source = "noseboom pitot-static"
lag = 0.08

[sensors.attitude]
source = "inertial"
lag = 0.02
'''
    path.write_text(text, encoding="utf-8")
