"""Flight records as Parquet, with the columns of the CSV; needs the extra `parquet`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from icing_env.errors import InputError
from icing_env.record.flight import FlightRecord
from icing_env.record.table import check_header, record_from_table, table_of, write_whole


def _pyarrow() -> tuple[Any, Any]:
    """The modules pyarrow and pyarrow.parquet, imported only here because they are large and optional."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise InputError("Parquet records need pyarrow: install the extra 'parquet', or use CSV") from error
    return pyarrow, pyarrow.parquet


def read_parquet(path: Path) -> FlightRecord:
    """Read `path` and the TOML beside it; raises InputError as the CSV reader does."""
    pyarrow, parquet = _pyarrow()
    try:
        data = parquet.read_table(path)
    except (pyarrow.ArrowException, OSError) as error:
        raise InputError(f"{path}: not a Parquet file: {str(error).splitlines()[0]}") from error
    check_header(data.column_names, str(path))
    table = {}
    for name in data.column_names:
        kind = data.schema.field(name).type
        if not (pyarrow.types.is_floating(kind) or pyarrow.types.is_integer(kind)):
            raise InputError(f"{path}: column '{name}' holds {kind}; numbers are required")
        table[name] = np.array(data[name].cast(pyarrow.float64()).to_numpy(zero_copy_only=False), dtype=np.float64)
    return record_from_table(table, path, first_row=1)


def write_parquet(record: FlightRecord, path: Path) -> None:
    """Write `path` and, where metadata is known, the TOML beside it; a sample that was not taken is null."""
    pyarrow, parquet = _pyarrow()
    table = pyarrow.table({n: pyarrow.array(v, from_pandas=True) for n, v in table_of(record).items()})
    write_whole(path, record.meta, lambda target: parquet.write_table(table, target))
