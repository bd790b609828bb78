"""A record flown once more under its own controls by an aircraft that changes on the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FlightRecord
from sim2real.prediction.predictor import Predictor, held
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction, reconstruct


def flown_again(record: FlightRecord, rows: Callable[[Reconstruction, float], NDArray], each: float,
                seed: int = 3) -> FlightRecord:  # fmt: skip
    """The record as the plant would fly it, with its own noise.

    Args:
        record: whose controls are flown.
        rows: PARAMETERS at a time [s] of the record.
        each: s for which they are held.
        seed: of the noise.
    """
    flight = reconstruct(record)
    plant, rng, steps = Predictor(flight, flight.parameters), np.random.default_rng(seed), round(each / flight.dt)
    plant.place(0)
    read = flight.measured.copy()
    for k in range(0, len(flight.time) - 1, steps):
        plant.fleet.parameters[:] = held(rows(flight, float(flight.time[k])), flight.dt)
        there = min(steps, len(flight.time) - 1 - k)
        read[k + 1 : k + 1 + there] = plant.fly(there, k)[:, 0]
    noisy = {c: np.where(np.isfinite(record[c]), read[:, j] + flight.noise[j] * rng.standard_normal(len(read)), np.nan)
             for j, c in enumerate(MEASURED) if c in record.channels}
    return replace(record, channels=dict(record.channels) | noisy)
