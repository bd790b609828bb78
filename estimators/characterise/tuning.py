"""The few numbers of the characteriser that are chosen, not fitted: `configs/estimators/characterise/tuning.toml`."""

from __future__ import annotations

from functools import cache

from pydantic import Field as Limited

from icing_env.configuration import Strict, read_toml, validate


class Tuning(Strict):
    """Times and levels; the file says why each has its value."""

    memory: float = Limited(gt=0.0)  # s, of the regressions
    shift_memory: float = Limited(gt=0.0)  # s, of the shifts
    period: float = Limited(gt=0.0)  # s between judgements in flight
    start: float = Limited(ge=0.0)  # s of evidence before the first
    confirm: float = Limited(ge=0.0)  # s that the score must stay above its threshold
    release: float = Limited(ge=0.0)  # s that it must stay below half of it
    warmest: float  # K, static: no new ice above
    boot_before: float = Limited(gt=0.0)  # s before an inflation that its severity is taken from
    boot_after: float = Limited(gt=0.0)  # s after it
    boot_cycle: float = Limited(gt=0.0)  # s between inflations of a boot that is held on


@cache
def load_tuning(name: str = "characterise/tuning") -> Tuning:
    """The tuning; InputError names a key that is unknown or missing."""
    return validate(Tuning, read_toml("estimators", name), f"estimators '{name}'")
