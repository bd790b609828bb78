"""Test inputs: doublets and their sets, added to whatever the controls do.

A doublet set is two elevator doublets, one aileron and one rudder doublet (founding paper). Amplitudes give about
0.3 g (elevator), 20 deg/s of roll and 6 deg of sideslip at 72 m/s, as in the flight records.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.jit import entry

SURFACES = ("elevator", "aileron", "rudder")


@dataclass(frozen=True)
class Doublet:
    """One doublet: `amplitude` [rad] for `half` seconds, then the opposite."""

    surface: str
    start: float
    amplitude: float
    half: float


def doublet_set(start: float, spacing: float = 10.0, scale: float = 1.0) -> tuple[Doublet, ...]:
    """Two elevator doublets, one aileron, one rudder, `spacing` seconds apart from `start` [s]."""
    deg = math.pi/180.0
    return (
        Doublet("elevator", start, scale*2.0*deg, 0.8),
        Doublet("elevator", start + spacing, scale*2.0*deg, 0.8),
        Doublet("aileron", start + 2.0*spacing, scale*6.0*deg, 0.8),
        Doublet("rudder", start + 3.0*spacing, scale*3.0*deg, 1.2),
    )


def schedule(doublets: tuple[Doublet, ...]) -> NDArray[np.float64]:
    """Rows (surface index, start, amplitude, half) for `excite`."""
    rows = [(SURFACES.index(d.surface), d.start, d.amplitude, d.half) for d in doublets]
    return np.array(rows, dtype=np.float64).reshape(len(rows), 4)


@entry
def excite(command: Any, measurement: Any, rows: Any) -> None:
    """Add the doublets that are due now to the surface commands of every row."""
    for i in range(len(command)):
        for k in range(rows.shape[0]):
            since = measurement[i].time - rows[k, 1]
            if 0.0 <= since < 2.0*rows[k, 3]:
                value = rows[k, 2] if since < rows[k, 3] else -rows[k, 2]
                if rows[k, 0] == 0.0:
                    command[i].elevator += value
                elif rows[k, 0] == 1.0:
                    command[i].aileron += value
                else:
                    command[i].rudder += value
