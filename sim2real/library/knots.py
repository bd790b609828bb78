"""A free course of time along a record: a hat about each of its knots."""

from __future__ import annotations

import numpy as np

from icing_env.record import FloatArray
from sim2real.records.reconstruct import Reconstruction

KNOT = 1.0  # s between knots (assumed: manoeuvres are slower)


def knots(flight: Reconstruction) -> FloatArray:
    """Times of a record's knots, s since its start; the last is not before its end."""
    return np.arange(0.0, flight.time[-1] - flight.time[0] + KNOT, KNOT)


def hat(passed: FloatArray, knot: FloatArray | float) -> FloatArray:
    """One at a knot, none from one knot away on; both s since the start."""
    return np.asarray(np.maximum(1.0 - np.abs(passed - knot) / KNOT, 0.0))


def hats(flight: Reconstruction) -> FloatArray:
    """The hats about every knot [N, knots]."""
    return hat((flight.time - flight.time[0])[:, None], knots(flight))
