"""Thresholds of the ice management, from configs/controllers/ice_management.toml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.ice_management.operate import OPERATE_FIELDS
from controllers.ice_management.power import POWER_FIELDS
from controllers.parameters import read_parameters
from icing_env.types import Field, structured

IMS_TUNING_FIELDS: list[Field] = [
    ("drag_severe", "1", "excess drag coefficient at severity 1"),
    ("drag_scatter", "1", "standard deviation of the drag coefficient between aircraft of the type"),
    ("derivative_loss_severe", "1", "relative loss of CL_alpha, Cm_alpha and Cm_elevator at severity 1"),
    ("derivative_scatter", "1", "relative standard deviation of these derivatives between aircraft of the type"),
    ("excitation_low", "1", "excitation below which derivatives do not count"),
    ("excitation_high", "1", "excitation above which they count fully"),
    ("severity_time", "s", "time constant of the severity"),
    ("confidence_half", "1", "standard deviation of the severity at which the confidence is one half"),
    ("confidence_min", "1", "confidence below which nothing is newly detected"),
    ("detect_severity", "1", "severity above which ice is believed"),
    ("clear_severity", "1", "severity below which it is no longer believed"),
    ("detect_time", "s", "time above the threshold until ice is detected"),
    ("clear_time", "s", "time below the lower threshold until it is no longer"),
    ("alpha_shift", "rad", "loss of stall angle at severity 1"),
    ("alpha_margin", "rad", "distance of the limit from the stall angle, ice detected"),
    ("alpha_margin_clean", "rad", "the same, clean"),
    ("alpha_flap", "1", "change of the stall angle per flap angle"),
    ("CL_max_flap", "1/rad", "maximum lift coefficient gained per flap angle"),
    ("stall_factor_clean", "1", "airspeed limit over stall speed, clean"),
    ("stall_factor_iced", "1", "airspeed limit over stall speed, ice detected"),
    ("bank_factor_clean", "1", "airspeed over stall speed at which no bank is left, clean"),
    ("bank_factor_iced", "1", "the same, ice detected"),
    ("bank_min", "rad", "bank that is always allowed"),
    ("bank_max", "rad", "bank that is never exceeded"),
    ("flap_full", "rad", "flap allowed without tail ice"),
    ("flap_tail_ice", "rad", "flap allowed with tail ice suspected"),
    ("tail_loss", "1", "relative loss of Cm_elevator that makes tail ice suspected"),
    ("tail_severity", "1", "severity above which tail ice is suspected whatever the derivatives say"),
    ("eta_severe", "1", "severity eta of a surface that counts as severity 1"),
    ("derivative_loss_max", "1", "largest loss of lift slope that is believed of an estimate"),
    ("doubt_share", "1", "standard errors of severity and lift slope that limits allow for"),
    ("doubt_max", "1", "largest standard error of the severity that limits allow for"),
    ("alpha_slow_time", "s", "time constant of the slow part of alpha"),
    ("gust_time", "s", "time over which the fluctuation of alpha is averaged"),
    ("gust_share", "1", "standard deviations of alpha that the limit of an iced aircraft keeps for gusts"),
    ("gust_max", "rad", "most that it keeps"),
    ("alpha_unload", "rad", "alpha given up in a roll upset"),
    ("climb_time", "s", "time constant of the climb angle that full power would sustain"),
    ("lever_known", "0..1", "lever below which thrust says nothing about full power"),
    ("load_max", "1", "limit load factor of the structure"),
    ("tail_alpha", "rad", "lowest angle of attack of an approach with flap"),
    ("tail_stall_loss", "1", "relative loss of the tailplane's stall angle per saturated eta"),
    ("tail_margin", "rad", "tail angle kept from its stall by the flap limit"),
    ("tail_near", "rad", "tail angle from its stall at which the crew is told"),
    ("flap_step", "rad", "flap taken off ahead of its present position while the tailplane stalls"),
    ("upset_time", "s", "time constant of hinge-moment signs and roll acceleration"),
    ("upset_share", "1", "separated share, by hinge moment, that counts as an upset"),
    ("roll_unlike", "1", "difference of the half wings' eta from which strange roll counts"),
    ("roll_strange", "rad/s2", "roll acceleration beyond that of the controls that counts as an upset"),
]
PROTECTION_TUNING_FIELDS = [*OPERATE_FIELDS, *POWER_FIELDS]
IMS_TUNING = structured([*IMS_TUNING_FIELDS, *PROTECTION_TUNING_FIELDS])


def load_tuning(name: str | Path = "ice_management", protection: str | Path = "ice_protection") -> NDArray[Any]:
    """Thresholds of the ice management, and when it operates the ice protection, one row of IMS_TUNING.

    Raises InputError for a file that does not fit.
    """
    row = np.zeros(1, IMS_TUNING)
    for part in (read_parameters(name, IMS_TUNING_FIELDS), read_parameters(protection, PROTECTION_TUNING_FIELDS)):
        for field in part.dtype.names or ():
            row[field] = part[field]
    return row
