"""Which channels were read when: slow ones between their readings, and those that were absent for a while."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimators.signals.resample import gaps
from icing_env.record import FloatArray
from sim2real.records.channels import FED_BACK, MEASURED
from sim2real.records.reconstruct import Reconstruction

GAP = 0.3  # s that a channel that is absent, and not slow, has not been read (assumed)
ALTITUDE = MEASURED.index("altitude")


def read_share(flight: Reconstruction) -> FloatArray:
    """Share of the samples at which every fed-back channel was read [FED_BACK], of those where it was not absent."""
    def make() -> FloatArray:
        read, there = np.isfinite(flight.measured[:, :FED_BACK]), ~absent(flight)
        return np.sum(read, axis=0) / np.maximum(np.sum(there, axis=0), 1)

    return flight.once("read", make)


def unread(flight: Reconstruction) -> NDArray[np.bool_]:
    """Where a fed-back channel was not read: absent, or slow and between two readings [N, FED_BACK].

    The altitude hardly moves meanwhile, and counts as read at every step with so much more noise.
    """
    read = np.isfinite(flight.measured[:, :FED_BACK])
    between = ~read & read.any(axis=0)
    between[:, ALTITUDE] = False
    return absent(flight) | between


def apart(flight: Reconstruction) -> list[int]:
    """Steps from one reading of a fed-back channel to the next; one of the altitude, which no gust makes rough."""
    return [round(1.0 / share) if share > 0.0 and c != ALTITUDE else 1 for c, share in enumerate(read_share(flight))]


def slow(flight: Reconstruction) -> bool:
    """Whether a fed-back channel other than the altitude is read at every second step at the most."""
    return max(apart(flight)) > 1


def absent(flight: Reconstruction) -> NDArray[np.bool_]:
    """Where a fed-back channel is absent for longer than the time between its readings tells [N, FED_BACK].

    One that was never read is absent nowhere.
    """
    def lost(values: FloatArray) -> NDArray[np.bool_]:
        read = np.isfinite(values)
        return gaps(flight.time, flight.time[read], GAP) if read.any() else read

    return flight.once("absent", lambda: np.column_stack([lost(v) for v in flight.measured[:, :FED_BACK].T]))
