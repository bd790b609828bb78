"""A changed aircraft along the published one's flight: what it would do otherwise in every single sample.

Two aircraft that fly the same commands drift apart, until they fly different manoeuvres and what they differ by is no
longer small: a bank that has come to 40 degrees makes everything else look changed. What a filter that follows the
record sees is smaller and simpler: from the published aircraft's state at one sample, the changed one arrives at the
next with an error (its own surfaces, spools and lags running on). Those errors, passed through the linearised motion,
are departures of the same innovations, and small as long as the change is. A wind of its own carries the aircraft
along: it flies through its air as the published one does, since what follows the record reads the airspeed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from testbed.withheld import distance, instruments
from testbed.withheld import plant as pl
from testbed.withheld.compiled import compiled
from testbed.withheld.flights import Aircraft, Flown
from testbed.withheld.trim import ALTITUDE

MOTION = np.array([pl.H, pl.U, pl.V, pl.W, pl.PHI, pl.THETA, pl.PSI, pl.P, pl.Q, pl.R, pl.ADW])
SETTLE = 500  # samples that surfaces and spools get to settle at the first command


@compiled
def _along(row: Any, Y: Any, C: Any, motion: Any, settle: int) -> tuple[Any, Any, Any]:
    """States [N, 27] with `motion` from Y and the rest its own, outputs [N, 9] there, errors of arrival [N, 27].

    Velocities are those of Y through the changed aircraft's own air.
    """
    p = row[0]
    n, h, delay, still = len(Y), pl.DT / pl.SUB, round(row[0].elevator_delay / pl.DT), np.zeros(pl.GUSTS)
    states, out, error = Y.copy(), np.zeros((n, pl.OUTPUTS)), np.zeros((n, pl.STATES))
    d1, d2, d3, o = np.zeros(pl.STATES), np.zeros(pl.STATES), np.zeros(pl.STATES), np.zeros(pl.OUTPUTS)
    y, u, carried = Y[0].copy(), C[0].copy(), np.zeros(pl.STATES)
    for k in range(-settle, n):
        at = max(k, 0)
        u[:] = C[at]
        u[0] = C[max(k - delay, 0), 0]
        for s in range(pl.SUB):
            t = max((at - 1) * pl.SUB + s, 0) * h
            pl.glide(y, p, u, t, h, d1, d2, d3, o)
        carried[pl.U], carried[pl.V], carried[pl.W] = pl.wind(Y[at], p, at * pl.DT)
        for i in motion:
            if k > 0:
                error[k, i] = y[i] - Y[k, i] - carried[i]
            y[i] = Y[at, i] + carried[i]
        if k >= 0:
            pl.rates(y, p, u, still, k * pl.DT, d1, o)
            states[k], out[k] = y, o
    return states, out, error


def shadow(aircraft: Aircraft, still: Flown, speed: float) -> tuple[NDArray, NDArray, Flown]:
    """Departures of an aircraft from the published one's flight `still` that began at `speed` [m/s].

    Returns:
        Departures of the channels of `distance.MOTION` [N, 12] and of `distance.INPUTS` [N, 5]; and the flight along
        `still`, its surfaces, engines and instruments its own, for `distance.paths`.
    """
    row, wrong = aircraft.row(), aircraft.instruments()
    row["altitude_start"] = ALTITUDE
    states, seen, error = _along(row, still.states, still.commands, MOTION, SETTLE)
    along = Flown(states, seen, still.commands, instruments.exact(states, seen, wrong))
    A, C = distance.linear(speed)
    F, x = expm(A[:, :10] * pl.DT), np.zeros((len(states), 10))
    for k in range(1, len(x)):
        x[k] = F @ x[k - 1] + error[k, list(distance.X)]
    moved, read = states.copy(), seen.copy()
    moved[:, list(distance.X)] += x
    read[:, list(distance.SEEN)] += x @ C[:, :10].T
    channels = instruments.exact(moved, read, wrong)
    y = np.column_stack([channels[c] - still.channels[c] for c in distance.MOTION])
    return y, states[:, list(distance.INPUTS)] - still.states[:, list(distance.INPUTS)], along
