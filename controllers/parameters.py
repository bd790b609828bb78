"""Gains and thresholds from configs/controllers/*.toml into one structured row.

Each number is `name = { value, unit, source }`; a name that the controller does not know, a missing name, another unit
and a number without a source are errors.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.configuration import Sourced, read_toml, validate
from icing_env.errors import InputError, nearest
from icing_env.types import Field, structured


def read_parameters(name: str | Path, fields: list[Field]) -> NDArray[Any]:
    """Read one set of controller parameters.

    Args:
        name: file within configs/controllers/, or a path to a TOML file of the same form.
        fields: name, unit and meaning of every parameter that the controller has.

    Returns:
        Structured array of one row, a float64 field for each parameter.

    Raises:
        InputError: the file cannot be read, or a name, unit, source or number in it is wrong.
    """
    data = read_toml("controllers", name)
    names = [field for field, _, _ in fields]
    for key in data:
        if key not in names:
            raise InputError(f"controllers '{name}': unknown key '{key}': {nearest(key, names)}")
    row = np.zeros(1, structured(fields))
    for field, unit, meaning in fields:
        where = f"controllers '{name}': {field}"
        if field not in data:
            raise InputError(f"{where} ({meaning}, {unit}) is missing")
        number = validate(Sourced, data[field], where)
        if number.unit != unit:
            raise InputError(f"{where} is in '{number.unit}', must be in '{unit}'")
        if not number.source.strip():
            raise InputError(f"{where} names no source; say 'assumed' for a guess")
        if not math.isfinite(number.value):
            raise InputError(f"{where} is {number.value}, must be finite")
        row[field] = number.value
    return row
