"""Flight records: one type for simulated and recorded flight (`flight`), and its files (`files`)."""

from icing_env.record.flight import (
    COLUMNS,
    OWNER,
    OWNER_COLUMNS,
    ROLES,
    DataProblem,
    FlightRecord,
    FloatArray,
    Geometry,
    RecordMeta,
)

from icing_env.record.files import read, write  # isort: skip  # after the types that the readers use

__all__ = ["COLUMNS", "OWNER", "OWNER_COLUMNS", "ROLES", "DataProblem", "FlightRecord", "FloatArray", "Geometry",
           "RecordMeta", "read", "write"]
