"""The tuning of the H-infinity identifier: read from `configs/estimators/hinf.toml`, one set used everywhere."""

from __future__ import annotations

from estimators.observer.tuning import Tuning

TUNING = Tuning("hinf", ("gamma",), ("d", "n", "q0", "k0"))
tuning_from = TUNING.read
default_tuning = TUNING.default
