"""The 10 Hz low pass against the oscillation of the nose boom, on every fast channel of a record alike.

The boom of NASA's icing research aircraft oscillates at 7 Hz and reaches the flow vanes; its records are low-passed at
10 Hz (the founding paper, section on the research aircraft). A filter on some channels only would shift them against
the others and bias every derivative between them, so controls and rates pass through it as well.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from estimators.signals.differentiate import low_pass
from estimators.signals.resample import common_grid
from icing_env.record import FlightRecord

FAST = ("alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az", "elevator", "aileron", "rudder",
        "elevator_command", "aileron_command", "rudder_command")  # fmt: skip


def without_boom(record: FlightRecord, cutoff: float = 10.0, order: int = 2) -> FlightRecord:
    """The record on one time grid, every fast channel through the same zero-phase low pass; gaps stay gaps.

    Args:
        cutoff: Hz at which half the amplitude passes.
        order: of the Butterworth filter, which runs forwards and backwards.

    Raises:
        InputError: the record is not sampled at more than twice the cut-off.
    """
    grid = common_grid(record)
    channels = {"time": grid.time}
    for name in record.channels:
        if name not in grid.values:
            continue
        values = grid.values[name]
        if name in FAST:
            values = low_pass(values, grid.dt, cutoff, order)
        channels[name] = np.where(grid.missing[name], np.nan, values) if name in grid.missing else values
    owner = {name: grid.values[name] for name in record.owner if name in grid.values}
    return replace(record, channels=channels, owner=owner)
