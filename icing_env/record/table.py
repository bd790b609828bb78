"""What CSV and Parquet records share: checks of a table of columns, the side file, writing whole or not at all."""

from __future__ import annotations

import hashlib
import os
import tempfile
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from icing_env.errors import InputError, nearest
from icing_env.record.flight import (
    COLUMNS,
    OWNER_COLUMNS,
    ROLES,
    DataProblem,
    FlightRecord,
    FloatArray,
    Geometry,
    RecordMeta,
)
from icing_env.record.sensors import understood

# Largest magnitude (rad) that a column in radians can reach; beyond it the column is in degrees.
RADIAN_LIMITS = {
    "alpha": 1.6, "beta": 1.6, "theta": 1.6, "phi": 3.3, "elevator": 1.0, "aileron": 1.0, "rudder": 1.0, "flap": 1.2,
    "elevator_command": 1.0, "aileron_command": 1.0, "rudder_command": 1.0, "p": 7.0, "q": 7.0, "r": 7.0, "psi": 60.0,
}  # fmt: skip
VALID = [*COLUMNS, *OWNER_COLUMNS]
SIDE_KEYS = ["aircraft", "flight", "mass", "inertia", "cg", "role", "sensors", "notes", "geometry"]


def check_header(names: list[str], where: str) -> None:
    """Refuse unknown, repeated or missing columns."""
    for name in names:
        if name not in VALID:
            raise InputError(f"{where}: unknown column '{name}'; {nearest(name, VALID)}")
        if names.count(name) > 1:
            raise InputError(f"{where}: column '{name}' stands twice in the header")
    if "time" not in names:
        raise InputError(f"{where}: column 'time' (s, increasing) is missing")


def record_from_table(table: Mapping[str, FloatArray], path: Path, first_row: int) -> FlightRecord:
    """Check the values of a table and make it a record. `first_row` is the number of its first row in messages."""
    time = table["time"]
    if len(time) == 0:
        raise InputError(f"{path}: no rows below the header")
    for name, values in table.items():
        if np.isinf(values).any():
            row = int(np.flatnonzero(np.isinf(values))[0]) + first_row
            raise InputError(f"{path}: row {row}, column '{name}' is infinite; leave the cell blank if not sampled")
    if np.isnan(time).any():
        raise InputError(f"{path}: row {int(np.flatnonzero(np.isnan(time))[0]) + first_row}, column 'time' is blank")
    bad = np.flatnonzero(np.diff(time) <= 0)
    if len(bad):
        i = int(bad[0]) + 1
        raise InputError(
            f"{path}: row {i + first_row}, column 'time' does not increase: {time[i]:g} after {time[i - 1]:g}"
        )
    check_radians(table, str(path))
    channels = {name: values for name, values in table.items() if name in COLUMNS}
    owner = {name: values for name, values in table.items() if name in OWNER_COLUMNS}
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    meta, unread = read_side(path.with_suffix(".toml"), path.stem, digest)
    told = f"not read of the side file: {', '.join(unread)}"
    problems = (DataProblem("sensors", told, float(time[0]), float(time[-1]), False),) if unread else ()
    return FlightRecord(channels, meta, owner, problems)


def check_radians(table: Mapping[str, FloatArray], where: str) -> None:
    """Refuse an angle or rate too large to be in radians."""
    for name, limit in RADIAN_LIMITS.items():
        if name in table and np.isfinite(table[name]).any():
            largest = float(np.nanmax(np.abs(table[name])))
            if largest > limit:
                raise InputError(
                    f"{where}: column '{name}' looks like degrees: largest {largest:.3g}; {COLUMNS[name]} is required"
                )


def read_side(path: Path, name: str, digest: str) -> tuple[RecordMeta, list[str]]:
    """Read the TOML beside a record; an empty RecordMeta (with name and digest) where there is none.

    Returns:
        It, and what its table `sensors` has that is not read.
    """
    if not path.is_file():
        return RecordMeta(name=name, sha256=digest), []
    try:
        side = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML: {error}") from error
    for key in side:
        if key not in SIDE_KEYS:
            raise InputError(f"{path}: unknown key '{key}'; {nearest(key, SIDE_KEYS)}")
    if side.get("role", "diagnose") not in ROLES:
        raise InputError(f"{path}: role '{side['role']}' is unknown; valid are: {', '.join(ROLES)}")
    inertia = _numbers(side, "inertia", ("xx", "yy", "zz", "xz"), path)
    geometry = _numbers(side, "geometry", ("wing_area", "span", "chord"), path)
    cg = _list_of_three(side, path)
    mass = side.get("mass")
    if mass is not None and (not isinstance(mass, int | float) or not mass > 0):
        raise InputError(f"{path}: mass must be a positive number of kg, got {mass!r}")
    if not isinstance(side.get("sensors", {}), dict):
        raise InputError(f"{path}: sensors must be a table such as [sensors] alpha = {{lag = 0.01}}")
    sensors, unread = understood(side.get("sensors", {}))
    return RecordMeta(
        aircraft=str(side.get("aircraft", "")),
        flight=str(side.get("flight", "")),
        mass=None if mass is None else float(mass),
        inertia=None if inertia is None else (inertia[0], inertia[1], inertia[2], inertia[3]),
        cg=cg,
        role=side.get("role", "diagnose"),
        sensors=sensors,
        notes=str(side.get("notes", "")),
        geometry=None if geometry is None else Geometry(*geometry),
        name=name,
        sha256=digest,
    ), unread


def _numbers(side: dict[str, Any], key: str, parts: tuple[str, ...], path: Path) -> list[float] | None:
    """Numbers of an inline table such as `inertia = {xx, yy, zz, xz}`, in the order of `parts`."""
    if key not in side:
        return None
    table = side[key]
    wanted = f"{key} = {{{', '.join(parts)}}}"
    if not isinstance(table, dict):
        raise InputError(f"{path}: {key} must be a table, {wanted}")
    for part in table:
        if part not in parts:
            raise InputError(f"{path}: unknown key '{key}.{part}'; {nearest(part, list(parts))}")
    if any(not isinstance(table.get(part), int | float) for part in parts):
        raise InputError(f"{path}: {key} must give a number for each of {wanted}")
    return [float(table[part]) for part in parts]


def _list_of_three(side: dict[str, Any], path: Path) -> tuple[float, float, float] | None:
    """The centre of gravity, `cg = [x, y, z]` in m."""
    if "cg" not in side:
        return None
    cg = side["cg"]
    if not isinstance(cg, list) or len(cg) != 3 or any(not isinstance(x, int | float) for x in cg):
        raise InputError(f"{path}: cg must be [x, y, z] in m, got {cg!r}")
    return float(cg[0]), float(cg[1]), float(cg[2])


def side_of(meta: RecordMeta) -> dict[str, Any]:
    """What the TOML beside a record would hold; empty where nothing is known."""
    side: dict[str, Any] = {key: getattr(meta, key) for key in ("aircraft", "flight", "notes") if getattr(meta, key)}
    if meta.mass is not None:
        side["mass"] = meta.mass
    if meta.inertia is not None:
        side["inertia"] = dict(zip(("xx", "yy", "zz", "xz"), meta.inertia, strict=True))
    if meta.cg is not None:
        side["cg"] = list(meta.cg)
    if meta.geometry is not None:
        side["geometry"] = vars(meta.geometry).copy()
    if meta.role != "diagnose":
        side["role"] = meta.role
    if meta.sensors:
        side["sensors"] = dict(meta.sensors)
    return side


def write_whole(path: Path, meta: RecordMeta, write_data: Callable[[Path], None]) -> None:
    """Write the data by `write_data` and the side file, each to a temporary file that then takes its place."""
    import tomli_w

    side = side_of(meta)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".record-") as folder:
        data, toml = Path(folder) / path.name, Path(folder) / path.with_suffix(".toml").name
        write_data(data)
        if side:
            toml.write_text(tomli_w.dumps(side), encoding="utf-8")
            os.replace(toml, path.with_suffix(".toml"))
        else:  # an older record's side file must not speak for this one
            path.with_suffix(".toml").unlink(missing_ok=True)
        os.replace(data, path)


def table_of(record: FlightRecord) -> dict[str, FloatArray]:
    """Columns to write, in the order of the interface."""
    return {name: record[name] for name in VALID if name in record.channels or name in record.owner}
