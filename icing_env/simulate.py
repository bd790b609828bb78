"""The only loop over aircraft: one environment step of every row, and the arrays it works on.

Order of one step (docs/model.md): once a second cloud and accretion; ice protection; coefficients with ice; gusts at
the end of the step; Runge-Kutta substeps with commands held and gusts in straight lines; instruments. A row sees
nothing of other rows, so one aircraft flies bit for bit the same alone and in a batch, on one thread or several.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.accretion import advance_accretion
from icing_env.atmosphere import GAS_CONSTANT, pressure, static_air
from icing_env.blocks import (
    AT_COMMAND,
    AT_CURRENT,
    AT_GUSTS,
    AT_PARAMETERS,
    GUSTS_AFTER,
    GUSTS_BEFORE,
    NOW,
    ROWS,
    feel_block,
    fill,
    recall_loads,
    rk4_block,
)
from icing_env.cloud import advance_cloud
from icing_env.dynamics import air_data, denser, forces, present_aircraft
from icing_env.frames import direction_cosines
from icing_env.ice_protection import advance_protection
from icing_env.integrate import AFTER, BEFORE, GUST_RECORDS, GUSTS, RECORDS, TRIAL, copy, copy_gusts, rk4
from icing_env.jit import entry, kernel
from icing_env.lanes import LANES, lane
from icing_env.memory import call_at, matrix, rows
from icing_env.parameters import N_IN_MOTION, PARAMETERS
from icing_env.sensors import hold_filter_constants, read_instruments, start_instruments
from icing_env.turbulence import advance_turbulence, start_turbulence
from icing_env.types import COMMAND, CONTINUOUS, CURRENT, MEASUREMENT, OUTCOME, STATE

CLOCK = np.dtype([("dt", "f8"), ("substeps", "i8"), ("ten_hertz", "i8"), ("one_hertz", "i8")])  # s, steps per sample
NUMBER = np.dtype(np.float64)
N_CURRENT, N_COMMAND, N_PARAMETERS = len(CURRENT.names or ()), len(COMMAND.names or ()), len(PARAMETERS.names or ())
DUE = np.bool_(True)  # for a plain True numba would compile the instruments once more


@kernel
def advance_weather_and_ice(s: Any, p: Any, airspeed: float, dt: float) -> None:
    """The slow clock: cloud along the track and ice on every surface."""
    advance_cloud(s, p, airspeed, dt)
    density = denser(s.altitude, p)*pressure(s.altitude)/(GAS_CONSTANT*s.temperature)
    advance_accretion(s, p, airspeed, density, dt)


@kernel
def prepare(s: Any, c: Any, p: Any, u: Any, o: Any, dt: float, one_hertz: int) -> None:
    """Weather and ice (once a second), ice protection, coefficients, all held over the step; gusts at its end."""
    if s.step % one_hertz == 0:
        advance_weather_and_ice(s, p, o.airspeed, dt*one_hertz)
        hold_filter_constants(s, p, dt)
    advance_protection(s, p, u, dt)
    present_aircraft(s, p, c)
    c.elapsed = s.step*dt
    advance_turbulence(s, p, o.airspeed, dt)


@kernel
def finish(felt: tuple, s: Any, m: Any, c: Any, p: Any, u: Any, o: Any, dt: float, ten_hertz: int,
           one_hertz: int) -> None:
    """Clock and instruments at the end of the step; `felt`: of `dynamics.loads`."""
    one = s.step % one_hertz == 0
    s.step += 1
    m.time = s.step*dt
    read_instruments(s, felt, s, m, c, p, u, o, s.step % ten_hertz == 0, one)


@kernel
def arrays_of(table: Any) -> tuple:
    """The arrays that `Fleet` puts into the table of a slice, in its order."""
    return (rows(table, 0, STATE), rows(table, 1, MEASUREMENT), rows(table, 2, CURRENT), rows(table, 3, PARAMETERS),
            rows(table, 4, COMMAND), rows(table, 5, OUTCOME), rows(table, 6, CLOCK))


@entry
def advance(table: Any) -> None:
    """One environment step of every row, one after another; there is a PARAMETERS row per aircraft or one for all."""
    state, measurement, current, parameters, command, outcome, clocks = arrays_of(table)
    stage, numbers = rows(table, 7, CONTINUOUS), rows(table, 8, NUMBER)
    gusts, airs = rows(table, 9, GUSTS), rows(table, 10, NUMBER)
    clock, shared = clocks[0], len(parameters) == 1
    dt, step = clock.dt, clock.dt/clock.substeps
    for i in range(len(state)):
        s, c, p, u, x = state[i], current[i], parameters[0 if shared else i], command[i], stage[TRIAL]
        copy_gusts(gusts[BEFORE], s)
        prepare(s, c, p, u, outcome[i], dt, clock.one_hertz)
        copy_gusts(gusts[AFTER], s)
        copy(x, s)
        for k in range(clock.substeps):
            rk4(stage, numbers, gusts, airs, c, p, u, step, k, clock.substeps)
        copy(s, x)
        felt = forces(x, direction_cosines(x.e0, x.e1, x.e2, x.e3), s, c, p)
        finish(felt, s, measurement[i], c, p, u, outcome[i], dt, clock.ten_hertz, clock.one_hertz)


@entry
def advance_blocks(table: Any) -> None:
    """`advance` in blocks of aircraft side by side."""
    state, measurement, current, parameters, command, outcome, clocks = arrays_of(table)
    block, currents = rows(table, 7, NUMBER), matrix(table, 2, N_CURRENT, NUMBER)
    settings, commands = matrix(table, 3, N_PARAMETERS, NUMBER), matrix(table, 4, N_COMMAND, NUMBER)
    clock, shared = clocks[0], len(parameters) == 1
    dt, step = clock.dt, clock.dt/clock.substeps
    for j in range(LANES if shared else 0):
        fill(block, AT_PARAMETERS, j, settings[0][:N_IN_MOTION])
    for first in range(0, len(state), LANES):
        count = min(LANES, len(state) - first)
        for j in range(count):
            i = first + j
            copy_gusts(lane(block, GUSTS_BEFORE, j, GUSTS), state[i])
            prepare(state[i], current[i], parameters[0 if shared else i], command[i], outcome[i], dt,
                    clock.one_hertz)
            copy(lane(block, NOW, j, CONTINUOUS), state[i])
            copy_gusts(lane(block, GUSTS_AFTER, j, GUSTS), state[i])
            fill(block, AT_CURRENT, j, currents[i])
            fill(block, AT_COMMAND, j, commands[i])
            if not shared:
                fill(block, AT_PARAMETERS, j, settings[i][:N_IN_MOTION])
        for k in range(clock.substeps):
            rk4_block(block, count, step, k, clock.substeps)
        for j in range(count):
            copy_gusts(lane(block, AT_GUSTS, j, GUSTS), state[first + j])
        feel_block(block, count)
        for j in range(count):
            i = first + j
            copy(state[i], lane(block, NOW, j, CONTINUOUS))
            finish(recall_loads(block, j), state[i], measurement[i], current[i], parameters[0 if shared else i],
                   command[i], outcome[i], dt, clock.ten_hertz, clock.one_hertz)


@entry
def start(state: Any, measurement: Any, current: Any, parameters: Any, command: Any, outcome: Any, dt: float) -> None:
    """After the continuous state was set: settle gusts and instruments and take a first sample."""
    shared = len(parameters) == 1
    for i in range(len(state)):
        s, c, p = state[i], current[i], parameters[0 if shared else i]
        if s.temperature <= 0.0:  # not prescribed
            s.temperature = static_air(s.altitude)[0] + p.temperature_offset
        present_aircraft(s, p, c)
        c.elapsed = s.step*dt
        attitude = direction_cosines(s.e0, s.e1, s.e2, s.e3)
        start_turbulence(s, p, air_data(s, attitude, s, p)[0])
        felt = forces(s, attitude, s, c, p)
        start_instruments(s, felt, s, c, p, dt)
        measurement[i].time = 0.0
        measurement[i].psi = 0.0
        read_instruments(s, felt, s, measurement[i], c, p, command[i], outcome[i], DUE, DUE)


class Fleet:
    """Arrays of `n` aircraft and the step over them.

    Args:
        parameters: PARAMETERS array, one row for all or one per aircraft.
        n: number of aircraft.
        dt: environment step [s].
        substeps: Runge-Kutta steps per environment step.
        threads: slices of the batch that run side by side; 1 runs in the caller.

    Attributes:
        state, measurement, current, command, outcome: structured arrays of length `n`.
    """

    def __init__(self, parameters: NDArray, n: int = 1, dt: float = 0.02, substeps: int = 2, threads: int = 1) -> None:
        if parameters.dtype != PARAMETERS or len(parameters) not in (1, n):
            raise ValueError(f"parameters must be a PARAMETERS array of 1 or {n} rows")
        self.parameters, self.n, self.dt, self.substeps = parameters, n, dt, substeps
        self.clock = np.array([(dt, substeps, max(1, round(0.1/dt)), max(1, round(1.0/dt)))], CLOCK)
        self.state = np.zeros(n, STATE)
        self.measurement = np.zeros(n, MEASUREMENT)
        self.current = np.zeros(n, CURRENT)
        self.command = np.zeros(n, COMMAND)
        self.outcome = np.zeros(n, OUTCOME)
        bounds = np.linspace(0, n, min(threads, n) + 1).astype(int)
        self._slices = [slice(a, b) for a, b in zip(bounds[:-1], bounds[1:], strict=True)]
        self._pool = ThreadPoolExecutor(len(self._slices)) if len(self._slices) > 1 else None
        self._calls: list[Callable[[], None]] = []

    def bind(self) -> Callable[[], None]:
        """Compile the step and write down its arguments: building views costs more than the flight.

        Returns the step. Done at the first one if not before.
        """
        self._calls = [self._bound(k) for k in self._slices]
        return self._calls[0] if self._pool is None else self.step

    def table(self) -> NDArray[np.int64]:
        """Addresses of all arrays of a fleet that is not sliced, as `advance` and `advance_blocks` take them."""
        if not self._calls:
            self.bind()
        (call,) = self._calls
        return call.table  # type: ignore[attr-defined, no-any-return]

    def _bound(self, k: slice) -> Callable[[], None]:
        parameters = self.parameters if len(self.parameters) == 1 else self.parameters[k]
        arrays = (self.state[k], self.measurement[k], self.current[k], parameters, self.command[k], self.outcome[k],
                  self.clock)
        if len(arrays[0]) >= LANES:
            return call_at(advance_blocks, *arrays, np.zeros(ROWS*LANES))
        stage, gusts = np.zeros(RECORDS, CONTINUOUS), np.zeros(GUST_RECORDS, GUSTS)
        return call_at(advance, *arrays, stage, stage.view(np.float64), gusts, gusts.view(np.float64))

    def start(self, rows: slice | NDArray = slice(None)) -> None:
        """Settle gusts, coefficients and instruments of the given rows on their continuous state."""
        state, measurement, current, outcome = (
            self.state[rows], self.measurement[rows], self.current[rows], self.outcome[rows])
        start(state, measurement, current,
              self.parameters if len(self.parameters) == 1 else self.parameters[rows],
              self.command[rows], outcome, self.dt)
        if not isinstance(rows, slice):  # fancy indexing made copies
            self.state[rows], self.measurement[rows], self.current[rows] = state, measurement, current
            self.outcome[rows] = outcome

    def step(self) -> None:
        """Advance every aircraft by one environment step under its command."""
        if not self._calls:
            self.bind()
        if self._pool is None:
            self._calls[0]()
        else:
            list(self._pool.map(lambda call: call(), self._calls))

    def memory(self) -> int:
        """Bytes held by the arrays."""
        return sum(a.nbytes for a in (self.state, self.measurement, self.current, self.command, self.outcome,
                                      self.parameters))


def processors() -> int:
    """Processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
