"""Tables of gains over airspeed and flap: read from the file that a design wrote, interpolated in the kernel.

The grid is even in equivalent airspeed (the airspeed of the same dynamic pressure at sea level) and in flap, so that
the place in it costs a division instead of a search. Rugh & Shamma, Research on gain scheduling, Automatica 36 (2000).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load_file

from controllers.kernels import air_density, airspeed_of, clip
from icing_env.configuration import folder
from icing_env.errors import InputError
from icing_env.jit import block, kernel

DENSITY_0 = 1.225  # kg/m3, US Standard Atmosphere 1976 at sea level
# First value, step and number of the equivalent airspeeds [m/s] and flaps [rad] of the grid.
GRID_FIELDS = ("speed_first", "speed_step", "speeds", "flap_first", "flap_step", "flaps")


def read_tables(name: str | Path, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, NDArray[np.float64]]:
    """Tables that `python -m controllers.design` wrote.

    Args:
        name: file within configs/controllers/ without its ending, or a path to a .safetensors file.
        shapes: of every table, by name.

    Raises:
        InputError: no such file, or a table that is missing, of another shape or not finite.
    """
    path = Path(name) if str(name).endswith(".safetensors") else folder() / "controllers" / f"{name}.safetensors"
    try:
        tables = load_file(path)
    except (OSError, SafetensorError) as problem:
        raise InputError(f"gains '{path}' cannot be read: {problem}; python -m controllers.design makes them") from None
    for key, shape in shapes.items():
        if key not in tables or tables[key].shape != shape or not np.all(np.isfinite(tables[key])):
            found = tables[key].shape if key in tables else "nothing"
            raise InputError(f"gains '{path}': table '{key}' must be finite and {shape}, found {found}")
    return {key: tables[key].astype(np.float64) for key in shapes}


def with_tables(row: NDArray[Any], tables: dict[str, NDArray[np.float64]]) -> NDArray[Any]:
    """A row of gains with tables before its numbers: one field of each table's shape, then the fields of `row`.

    Tables come first: a type that merely went on after that of `row` would pass for it in numba.
    """
    types: list[Any] = [*((key, "f8", value.shape) for key, value in tables.items()), *row.dtype.descr]
    out = np.zeros(1, types)
    for field in row.dtype.names or ():
        out[field] = row[field]
    for key, value in tables.items():
        out[key] = value
    return out


def scheduled(row: NDArray[Any], name: str | Path, sizes: dict[str, tuple[int, int]]) -> NDArray[Any]:
    """A row of gains with the grid and tables [speeds, flaps, rows, columns] of a file beside its numbers.

    Args:
        row: numbers that do not depend on the grid.
        name: as in `read_tables`.
        sizes: rows and columns of every table, by name.
    """
    grid = read_tables(name, {"grid": (len(GRID_FIELDS),)})["grid"]
    shapes = {key: (int(grid[2]), int(grid[5]), *size) for key, size in sizes.items()}
    single = {field: np.asarray(value) for field, value in zip(GRID_FIELDS, grid, strict=True)}
    return with_tables(row, read_tables(name, shapes) | single)


@kernel
def equivalent_airspeed(m: Any) -> float:
    """Airspeed [m/s] that has the same dynamic pressure at sea level."""
    return airspeed_of(m)*math.sqrt(air_density(m)/DENSITY_0)


@kernel
def place(m: Any, g: Any) -> tuple[int, int, float, float]:
    """Cell of the grid that the aircraft is in, and how far within it (0..1) along airspeed and flap; held outside."""
    x = clip((equivalent_airspeed(m) - g.speed_first)/g.speed_step, 0.0, g.speeds - 1.0)
    y = clip((m.flap - g.flap_first)/g.flap_step, 0.0, g.flaps - 1.0)
    i, j = int(min(x, g.speeds - 2.0)), int(min(y, g.flaps - 2.0))
    return i, j, x - i, y - j


@block
def at(table: Any, where: tuple, row: int, column: int) -> float:
    """Element of a table [speeds, flaps, rows, columns], linear along both axes of the grid."""
    i, j, x, y = where
    near = table[i, j, row, column] + x*(table[i + 1, j, row, column] - table[i, j, row, column])
    far = table[i, j + 1, row, column] + x*(table[i + 1, j + 1, row, column] - table[i, j + 1, row, column])
    return near + y*(far - near)


@block
def product(table: Any, where: tuple, z: Any, out: Any) -> None:
    """`out` becomes the table's matrix at a place of the grid times the vector that `z` begins with."""
    i, j, x, y = where
    for row in range(table.shape[2]):
        total = 0.0
        for column in range(table.shape[3]):
            near = table[i, j, row, column] + x*(table[i + 1, j, row, column] - table[i, j, row, column])
            far = table[i, j + 1, row, column] + x*(table[i + 1, j + 1, row, column] - table[i, j + 1, row, column])
            total += (near + y*(far - near))*z[column]
        out[row] = total
