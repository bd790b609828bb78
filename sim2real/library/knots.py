"""A free course of time along a record: a hat about each of its knots."""

from __future__ import annotations

import numpy as np

from icing_env.record import FloatArray
from sim2real.records.reconstruct import Reconstruction

KNOT = 1.0  # s between knots (assumed: manoeuvres are slower)
MOST = 100  # knots of a record: of a longer one they are further apart, or memory would go with its length's square


def spacing(flight: Reconstruction) -> float:
    """Seconds between a record's knots."""
    return max(KNOT, float(flight.time[-1] - flight.time[0]) / MOST)


def knots(flight: Reconstruction) -> FloatArray:
    """Times of a record's knots, s since its start; the last is not before its end."""
    length, apart = float(flight.time[-1] - flight.time[0]), spacing(flight)
    return apart * np.arange(np.ceil(length / apart - 1e-9) + 1.0)


def hat(flight: Reconstruction, knot: FloatArray | float) -> FloatArray:
    """One at a knot (s since the start), none from one knot away on [N, or N x knots]."""
    passed = (flight.time - flight.time[0]).reshape(-1, *[1] * np.ndim(knot))
    return np.asarray(np.maximum(1.0 - np.abs(passed - knot) / spacing(flight), 0.0))


def hats(flight: Reconstruction) -> FloatArray:
    """The hats about every knot [N, knots]."""
    return hat(flight, knots(flight))
