"""Every method that estimates derivatives from one record, by the name that the command line knows it under.

A method is a module with `identify(record, ...) -> {name: Estimate}`: only the record is needed, whatever else it takes
has a default. It carries a derivative that the record cannot show with `identifiable` false and the reason, and raises
`InputError` for a record that it cannot use.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from estimators.estimate import Estimate
from icing_env.errors import InputError, nearest

Identify = Callable[..., dict[str, Estimate]]
METHODS: dict[str, str] = {  # name: module
    "stepwise": "estimators.regression.equation_error",
    "orthogonal": "estimators.regression.orthogonal",
    "output_error": "estimators.likelihood.output_error",
    "frequency_domain": "estimators.likelihood.frequency_domain",
    "filter_error": "estimators.likelihood.filter_error",
    "hinf": "estimators.hinf.record",
    "rls": "estimators.recursive.rls",
    "real_time_frequency": "estimators.recursive.real_time_frequency",
    "ekf": "estimators.recursive.ekf",
    "ukf": "estimators.recursive.ukf",
}


def method(name: str) -> Identify:
    """The `identify` of a method.

    Raises:
        InputError: no such method.
    """
    if name not in METHODS:
        raise InputError(f"identify: method '{name}' is unknown; {nearest(name, list(METHODS))}")
    identify: Identify = import_module(METHODS[name]).identify
    return identify
