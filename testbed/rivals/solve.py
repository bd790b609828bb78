"""What a rival answers to records of one aircraft."""

from __future__ import annotations

import time
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from icing_env.errors import InputError, nearest
from icing_env.record import FlightRecord
from testbed.rivals import RIVALS
from testbed.rivals.opinion import Opinion, answer


def consider(name: str, records: Sequence[FlightRecord]) -> Opinion:
    """What a rival thinks of records of one aircraft in one condition.

    Raises:
        InputError: no such rival, no records, or one that cannot be used.
    """
    if name not in RIVALS:
        raise InputError(f"no rival '{name}': {nearest(name, list(RIVALS))}")
    if not records:
        raise InputError("no record to diagnose: give at least one flight record")
    found: Opinion = import_module(f"testbed.rivals.{name}").consider(records)
    return found


def diagnose(name: str, records: Sequence[FlightRecord]) -> dict[str, Any]:
    """The same as JSON of the form that `icing diagnose --json` has; errors as there."""
    began = time.perf_counter()
    told = consider(name, records)
    return answer(told, import_module(f"testbed.rivals.{name}").SCALE, time.perf_counter() - began)
