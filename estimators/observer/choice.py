"""Every identifier that can be the observer in flight, by name."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from icing_env.errors import InputError, nearest

OBSERVERS: dict[str, str] = {  # name: module
    "hinf": "estimators.hinf",
    "rls": "estimators.recursive.rls",
    "real_time_frequency": "estimators.recursive.real_time_frequency",
    "ekf": "estimators.recursive.ekf",
    "ukf": "estimators.recursive.ukf",
}


def observer(name: str) -> ModuleType:
    """The module of an observer: `init`, `step` and `default_tuning`.

    Raises:
        InputError: no such observer.
    """
    if name not in OBSERVERS:
        raise InputError(f"observer '{name}' is unknown; {nearest(name, list(OBSERVERS))}")
    return import_module(OBSERVERS[name])
