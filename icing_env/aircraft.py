"""Aircraft, instruments and weather from their files into one PARAMETERS row."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.configuration import Sourced, read_toml, validate
from icing_env.errors import InputError, nearest
from icing_env.parameters import GROUPS, PARAMETERS, UNITS, ZERO_UNLESS_GIVEN


def load(
    aircraft: str | Path = "twin_otter",
    *,
    instruments: str | Path = "nasa_2002",
    weather: str | Path = "clear",
    ice: str | Path = "dhc6",
) -> NDArray:
    """One row of PARAMETERS.

    Args:
        aircraft, instruments, weather, ice: names of files under configs/, or paths to files of the same form.

    Raises:
        InputError: unknown file, key or unit; a number missing.
    """
    numbers: dict[str, Sourced] = {}
    for kind, name in (("ice", ice), ("instruments", instruments), ("weather", weather), ("aircraft", aircraft)):
        numbers |= read_numbers(kind, name)
    silent = {name for group in ZERO_UNLESS_GIVEN for name, _, _ in GROUPS[group]}
    missing = sorted(set(UNITS) - silent - set(numbers))
    if missing:
        raise InputError(f"aircraft '{aircraft}': no value for {', '.join(missing[:5])}" + ", ..."*(len(missing) > 5))
    row = np.zeros(1, PARAMETERS)
    for name, number in numbers.items():
        row[name] = number.value
    return row


def read_numbers(kind: str, name: str | Path) -> dict[str, Sourced]:
    """The numbers of one file; a file with `base = "..."` starts from that one."""
    data = read_toml(kind, name)
    numbers = read_numbers(kind, data["base"]) if "base" in data else {}
    for group, entries in data.items():
        if not isinstance(entries, dict):
            continue
        if group not in GROUPS:
            raise InputError(f"{kind} '{name}': unknown section [{group}]: {nearest(group, list(GROUPS))}")
        valid = [field for field, _, _ in GROUPS[group]]
        for key, value in entries.items():
            if key not in valid:
                raise InputError(f"{kind} '{name}' [{group}]: unknown key '{key}': {nearest(key, valid)}")
            numbers[key] = validate(Sourced, value, f"{kind} '{name}' {group}.{key}")
    return numbers


def changed(row: NDArray, **values: Any) -> NDArray:
    """Copy of a PARAMETERS array with some numbers replaced (a number, or one per row)."""
    check_names(values)
    out = row.copy()
    for key, value in values.items():
        out[key] = value
    return out


def check_names(names: Iterable[str]) -> None:
    """Raise an InputError that names the nearest parameter if one of `names` is none."""
    for name in names:
        if name not in UNITS:
            raise InputError(f"no parameter '{name}': {nearest(name, list(UNITS))}")


def broadcast(row: NDArray, n: int) -> NDArray:
    """`n` independent copies of a one-row PARAMETERS array."""
    return np.repeat(row, n) if len(row) == 1 else row.copy()
