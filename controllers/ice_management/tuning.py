"""Thresholds of the ice management, from configs/controllers/ice_management.toml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

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
    ("boots_temperature", "K", "static temperature below which boots are cycled"),
    ("heat_temperature", "K", "static temperature below which propellers are heated"),
    ("alpha_shift", "rad", "loss of stall angle at severity 1"),
    ("alpha_margin", "rad", "distance of the limit from the stall angle"),
    ("alpha_flap", "1", "change of the stall angle per flap angle"),
    ("CL_max_loss", "1", "relative loss of maximum lift at severity 1"),
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
]
IMS_TUNING = structured(IMS_TUNING_FIELDS)


def load_tuning(name: str | Path = "ice_management") -> NDArray[Any]:
    """Thresholds of the ice management, one row of IMS_TUNING. Raises InputError for a file that does not fit."""
    return read_parameters(name, IMS_TUNING_FIELDS)
