"""What one H-infinity observer remembers, and how it starts."""

from __future__ import annotations

import numpy as np

from estimators.observer.layout import DIAGONAL, SEEN, seat

OBSERVER = np.dtype([
    *SEEN,
    ("b3", "f8", (78,)),  # covariance of the estimates: lower triangles of the six channels
    ("gain", "f8", (6,)),  # scratch
])  # fmt: skip


def init(parameters: np.ndarray, tuning: np.ndarray, n: int, start: float = 1.0) -> np.ndarray:
    """Memory of `n` observers that start at `start` times the clean aircraft (`OBSERVER` array).

    parameters: structured array with the fields of AIRFRAME, one row or n rows. tuning: `TUNING` array of one row.
    The matched filters have the bandwidth d/n of the tuning given here.
    """
    observer = np.zeros(n, OBSERVER)
    spread = seat(observer, parameters, tuning, tuning["d"][0] / tuning["n"][0], start)
    observer["b3"][:, DIAGONAL] = spread**2
    return observer
