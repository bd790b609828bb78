"""Flight records as CSV: one header row, one row per instant, a blank cell where a channel was not sampled."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

import numpy as np

from icing_env.errors import InputError
from icing_env.record.flight import FlightRecord, FloatArray
from icing_env.record.table import check_header, record_from_table, table_of, write_whole


def read_csv(path: Path) -> FlightRecord:
    """Read `path` and the TOML beside it.

    Raises:
        InputError: not UTF-8, empty, unknown or missing column, a cell that is no number, a cut-off row, time that
            does not increase, an angle in degrees.
    """
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text (byte {error.start}); save the record as UTF-8") from error
    try:
        lines = [row for row in csv.reader(io.StringIO(text, newline=""), strict=True) if row]
    except csv.Error as error:
        raise InputError(f"{path}: not a CSV file: {error}") from error
    if not lines:
        raise InputError(f"{path}: the file is empty; a header row with 'time' and rows below it are needed")
    names = [name.strip() for name in lines[0]]
    check_header(names, str(path))
    rows = lines[1:]
    for i, row in enumerate(rows):
        if len(row) != len(names):
            what = "the last line is cut off: " if i == len(rows) - 1 and len(row) < len(names) else ""
            raise InputError(f"{path}: {what}row {i + 2} has {len(row)} cells, the header has {len(names)}")
    table = {name: _column(path, name, [row[j] for row in rows]) for j, name in enumerate(names)}
    return record_from_table(table, path, first_row=2)


def _column(path: Path, name: str, cells: list[str]) -> FloatArray:
    """Cells of one column as numbers; blank is nan."""
    values = np.full(len(cells), math.nan)
    for i, cell in enumerate(cells):
        cell = cell.strip()
        if cell:
            try:
                values[i] = float(cell)
            except ValueError as error:
                raise InputError(f"{path}: row {i + 2}, column '{name}': '{cell}' is not a number") from error
    return values


def write_csv(record: FlightRecord, path: Path) -> None:
    """Write `path` and, where metadata is known, the TOML beside it; numbers keep every digit."""
    table = table_of(record)

    def write_data(target: Path) -> None:
        with target.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(table)
            columns = [["" if math.isnan(x) else repr(x) for x in values.tolist()] for values in table.values()]
            writer.writerows(zip(*columns, strict=True))

    write_whole(path, record.meta, write_data)
