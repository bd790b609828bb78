"""The way in and out of files, by their suffix."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from icing_env.errors import InputError
from icing_env.record import csv_file, parquet_file, sidpac
from icing_env.record.flight import DataProblem, FlightRecord


def without_empty_thrust(record: FlightRecord) -> FlightRecord:
    """A column of zeros for thrust means that thrust was not recorded: drop it and say so (interface, section 2)."""
    zero = [n for n in ("thrust_left", "thrust_right") if n in record.channels and not np.nan_to_num(record[n]).any()]
    if not zero or len(record) == 0:
        return record
    span = float(record.time[0]), float(record.time[-1])
    found = [DataProblem(name, "zeros, taken as absent", *span, True) for name in zero]
    kept = {n: v for n, v in record.channels.items() if n not in zero}
    return replace(record, channels=kept).with_problems(found)


def read(path: str | Path) -> FlightRecord:
    """Read a flight record: `.csv`, `.parquet` (each with an optional `.toml` beside it) or SIDPAC's `.mat`.

    Raises:
        InputError: in one line, what is wrong with the file, where, and what would be right.
    """
    path = Path(path)
    readers = {".csv": csv_file.read_csv, ".parquet": parquet_file.read_parquet, ".mat": sidpac.read_mat}
    if path.suffix.lower() not in readers:
        raise InputError(f"{path}: '{path.suffix}' is no flight record; valid are: {', '.join(readers)}")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    return without_empty_thrust(readers[path.suffix.lower()](path))


def write(record: FlightRecord, path: str | Path) -> None:
    """Write `record` to `.csv` or `.parquet`, with what `meta` knows in a `.toml` beside it; whole or not at all.

    Of the owner's columns only angular accelerations have a place in the file; the rest is not written.

    Raises:
        InputError: for another suffix.
    """
    path = Path(path)
    writers = {".csv": csv_file.write_csv, ".parquet": parquet_file.write_parquet}
    if path.suffix.lower() not in writers:
        raise InputError(f"{path}: cannot write '{path.suffix}'; valid are: {', '.join(writers)}")
    writers[path.suffix.lower()](record, path)
