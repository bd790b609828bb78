"""Published numbers of the aircraft, read from `configs/`, and the knobs by which an effect changes a flight.

Numbers are facts that both sides may read; no code is shared with the simulator that is diagnosed.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from testbed.withheld.described import DESCRIBED

HERE = Path(__file__).resolve()
FILES = ("aircraft/twin_otter.toml", "instruments/nasa_2002.toml", "ice/dhc6.toml")
DERIVATIVES = (
    "CX_0", "CX_alpha", "CX_alpha2", "CZ_0", "CZ_alpha", "CZ_q", "CZ_elevator", "Cm_0", "Cm_alpha", "Cm_q",
    "Cm_elevator", "CY_beta", "CY_p", "CY_r", "CY_rudder", "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder",
    "Cn_beta", "Cn_p", "Cn_r", "Cn_aileron", "Cn_rudder")  # fmt: skip
# What the aircraft file does not have, neutral at 0: changes of shape that effects make. "at 72" means at 72 m/s,
# from where they grow or fall with speed.
KNOBS = (
    "CZ_alpha_right", "CX_0_right",  # right half wing less the left one [1/rad, 1]
    # a loss or gain that saturates: value [1/rad] at small angles, limited as tanh
    "CZ_alpha_soft", "Cm_alpha_soft", "Cm_q_soft", "Cm_elevator_soft", "Cl_p_soft", "Cl_beta_soft", "Cl_aileron_soft",
    "Cn_beta_soft", "Cn_rudder_soft", "CY_beta_soft",
    "CD_alpha", "CD_lift",  # drag that grows with (alpha/0.06 rad)^2, with lift coefficient squared
    "Cm_at_72", "Cl_at_72",  # constant moments that grow with speed
    "Cm_downwash2",  # moment of a downwash that lags twice
    "Cm_ct2", "thrust_at_72", "thrust_right_at_72",
    "spool_second",  # s, a second lag of the engines in series
    "elevator_frequency", "aileron_frequency", "rudder_frequency",  # rad/s, second-order actuators (damping 0.7)
    "elevator_cubic", "aileron_cubic", "rudder_cubic",  # gearing that grows with (command/0.1 rad)^2
    "elevator_float", "elevator_soft_rate",  # rad at 72; 0/1: rate limit as tanh
    "wind_up", "wind_wave", "shear", "shear_bounded", "density_lapse", "altitude_start",
    # effects that are in no library
    "Cm_aileron", "Cm_beta2", "Cm_hump", "fin_ct", "slosh_mass", "elevator_play", "Cn_betadot", "Cl_torque",
    "Cn_pfactor", "blowback", "Cn_alpha_aileron", "gyroscopic", "CZ_alphadot", "aileron_dead", "elevator_delay",
    "Cm_rotor_wake", "CY_alpha_rudder", "brake_drag",
    # strangers, in no list until a solver was done (`strangers.py`)
    "CD_beta2", "CZ_beta2", "Cm_alpha_q", "Cl_alpha_p", "CZ_ct_alpha", "Cl_wave", "loose_load", "rudder_one_sided",
    "rudder_of_aileron", "flap_creep", "door", "fuel_shift", "aileron_brake", "surge", "elevator_up_lag", "front",
    "yaw_damper", "CZ_hysteresis", "CZ_aileron_abs", "fuel_surge", "Cl_beta_load", "wake", "thermal", "elevator_hunt",
    "aileron_friction", "left_of_alpha", "Cm_p", "elevator_drag", "CY_aileron", "trim_runs", "spoiler", "load_dropped",
    "rudder_floats", "spool_down", "side_wind_wave", "Cl_ct_aileron")  # fmt: skip
SENSOR_KNOBS = (
    "bias_alpha", "bias_beta", "bias_q", "bias_theta", "bias_ax", "bias_az", "bias_airspeed", "bias_p", "bias_r",
    "bias_phi", "bias_ay",
    "wander_alpha", "wander_beta", "wander_q", "wander_theta", "wander_ax", "wander_az",  # bias that changes in time
    "scale_alpha", "scale_alpha2", "scale_airspeed", "pressure_airspeed", "vane_extra", "vane_second",
    "vane_error", "vane_cross", "boom_extra", "boom_other",
    # in no library
    "flexible_az", "gyro_g", "gyro_cross", "attitude_cross", "airspeed_alpha",
    # strangers
    "stuck_alpha", "square_az", "scale_p", "scale_phi", "scale_beta", "sideslip_airspeed", "power_alpha",
    "stuck_theta", "static_alpha", "tilt", "vane_aside", "warm_p", "pitot_water", "static_lag",
    "power_beta", "arm_az", "lag_r", "square_phi")  # fmt: skip


def folder() -> Path:
    """Where `configs` lies: beside the packages in a checkout, within `icing_env` where installed."""
    for candidate in (HERE.parents[2] / "configs", HERE.parents[2] / "icing_env" / "configs"):
        if candidate.is_dir():
            return candidate
    raise FileNotFoundError(f"no configs folder beside {HERE.parents[1]}")


def published() -> dict[str, float]:
    """Every number of the aircraft, its instruments and its ice, by name, SI."""
    numbers: dict[str, float] = {}
    for name in FILES:
        tree = tomllib.loads((folder() / name).read_text(encoding="utf-8"))
        for section in tree.values():
            if isinstance(section, dict):
                numbers |= {key: float(entry["value"]) for key, entry in section.items()}
    return numbers


def digest() -> str:
    """SHA-256 of the files that the numbers come from."""
    total = hashlib.sha256()
    for name in FILES:
        total.update((folder() / name).read_bytes())
    return total.hexdigest()


PUBLISHED = published()
_ICE = ("k_", "edge_", "frontal_", "eta_", "shed_", "boot_", "glaze_", "rime_", "melt_", "sublimation_", "prop_heat",
        "noise_", "bias_", "scale_")  # fmt: skip
AIRFRAME = tuple(n for n in PUBLISHED if not n.startswith(_ICE))
DTYPE = np.dtype([(n, np.float64) for n in (*AIRFRAME, *KNOBS, *DESCRIBED)])


def airframe(changes: Mapping[str, float] | None = None) -> NDArray:
    """One row of DTYPE: the published aircraft with `changes` (values by name).

    Raises:
        KeyError: a name that no field has.
    """
    row = np.zeros(1, DTYPE)
    for name in AIRFRAME:
        row[name] = PUBLISHED[name]
    for name, value in (changes or {}).items():
        if name not in (DTYPE.names or ()):
            raise KeyError(name)
        row[name] = value
    return row
