"""The only loop over aircraft: one environment step of every row, and the arrays it works on.

Order of one step (docs/model.md): once a second cloud and accretion; ice protection; coefficients with ice; gusts,
then held; Runge-Kutta substeps with commands held; instruments. A row sees nothing of other rows, so one aircraft
flies bit for bit the same alone and in a batch, on one thread or several.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.accretion import advance_accretion
from icing_env.atmosphere import GAS_CONSTANT, pressure, static_air
from icing_env.cloud import advance_cloud
from icing_env.dynamics import air_data, present_aircraft
from icing_env.frames import direction_cosines
from icing_env.ice_protection import advance_protection
from icing_env.integrate import RECORDS, TOGETHER, TRIAL, copy, numbers_of, rk4
from icing_env.jit import bound, entry, kernel
from icing_env.parameters import PARAMETERS
from icing_env.sensors import hold_filter_constants, read_instruments, start_instruments
from icing_env.turbulence import advance_turbulence, start_turbulence
from icing_env.types import COMMAND, CONTINUOUS, CURRENT, MEASUREMENT, OUTCOME, STATE

DUE = np.bool_(True)  # for a plain True numba would compile the instruments once more


@kernel
def advance_weather_and_ice(s: Any, p: Any, airspeed: float, dt: float) -> None:
    """The slow clock: cloud along the track and ice on every surface."""
    advance_cloud(s, p, airspeed, dt)
    density = p.density_factor*pressure(s.altitude)/(GAS_CONSTANT*s.temperature)
    advance_accretion(s, p, airspeed, density, dt)


@kernel
def prepare(s: Any, c: Any, p: Any, u: Any, o: Any, dt: float, one_hertz: int) -> None:
    """What is held over the step: weather and ice (once a second), ice protection, coefficients, gusts."""
    if s.step % one_hertz == 0:
        advance_weather_and_ice(s, p, o.airspeed, dt*one_hertz)
        hold_filter_constants(s, p, dt)
    advance_protection(s, p, u, dt)
    present_aircraft(s, p, c)
    advance_turbulence(s, p, o.airspeed, dt)


@kernel
def finish(x: Any, s: Any, m: Any, c: Any, p: Any, u: Any, o: Any, dt: float, ten_hertz: int, one_hertz: int) -> None:
    """Clock and instruments at the end of the step."""
    one = s.step % one_hertz == 0
    s.step += 1
    m.time = s.step*dt
    read_instruments(x, s, m, c, p, u, o, s.step % ten_hertz == 0, one)


@entry
def advance(state: Any, stage: Any, numbers: Any, measurement: Any, current: Any, parameters: Any, command: Any,
            outcome: Any, substeps: int, dt: float, ten_hertz: int, one_hertz: int) -> None:
    """One environment step of every row; `parameters` has a row per aircraft or one for all."""
    shared = len(parameters) == 1
    for first in range(0, len(state), TOGETHER):
        count = min(TOGETHER, len(state) - first)
        for j in range(count):
            i = first + j
            prepare(state[i], current[i], parameters[0 if shared else i], command[i], outcome[i], dt, one_hertz)
            copy(stage[j, TRIAL], state[i])
        for _ in range(substeps):
            rk4(stage, numbers, first, count, state, current, parameters, shared, command, dt/substeps)
        for j in range(count):
            i = first + j
            copy(state[i], stage[j, TRIAL])
            finish(stage[j, TRIAL], state[i], measurement[i], current[i], parameters[0 if shared else i], command[i],
                   outcome[i], dt, ten_hertz, one_hertz)


@entry
def start(state: Any, stage: Any, measurement: Any, current: Any, parameters: Any, command: Any, outcome: Any,
          dt: float) -> None:
    """After the continuous state was set: settle gusts and instruments and take a first sample."""
    shared = len(parameters) == 1
    for i in range(len(state)):
        s, c, p = state[i], current[i], parameters[0 if shared else i]
        x = stage[0, TRIAL]
        copy(x, s)
        if s.temperature <= 0.0:  # not prescribed
            s.temperature = static_air(s.altitude)[0] + p.temperature_offset
        present_aircraft(s, p, c)
        start_turbulence(s, p, air_data(x, direction_cosines(x.e0, x.e1, x.e2, x.e3), s, p)[0])
        start_instruments(x, s, c, p, dt)
        measurement[i].time = 0.0
        measurement[i].psi = 0.0
        read_instruments(x, s, measurement[i], c, p, command[i], outcome[i], DUE, DUE)


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
        self.clocks = max(1, round(0.1/dt)), max(1, round(1.0/dt))  # steps per sample at 10 Hz and 1 Hz
        self.state = np.zeros(n, STATE)
        self.measurement = np.zeros(n, MEASUREMENT)
        self.current = np.zeros(n, CURRENT)
        self.command = np.zeros(n, COMMAND)
        self.outcome = np.zeros(n, OUTCOME)
        bounds = np.linspace(0, n, min(threads, n) + 1).astype(int)
        self._slices = [slice(a, b) for a, b in zip(bounds[:-1], bounds[1:], strict=True)]
        self._stages = [np.zeros((TOGETHER, RECORDS), CONTINUOUS) for _ in self._slices]
        self._pool = ThreadPoolExecutor(len(self._slices)) if len(self._slices) > 1 else None
        self._bind()

    def _bind(self) -> None:
        """Arguments of each slice, made once: building views costs more than the flight."""
        shared = len(self.parameters) == 1
        self._calls = [
            bound(advance, self.state[k], stage, numbers_of(stage), self.measurement[k], self.current[k],
             self.parameters if shared else self.parameters[k], self.command[k], self.outcome[k],
                  self.substeps, self.dt, *self.clocks)
            for k, stage in zip(self._slices, self._stages, strict=True)
        ]

    def start(self, rows: slice | NDArray = slice(None)) -> None:
        """Settle gusts, coefficients and instruments of the given rows on their continuous state."""
        state, measurement, current, outcome = (
            self.state[rows], self.measurement[rows], self.current[rows], self.outcome[rows])
        start(state, self._stages[0], measurement, current,
              self.parameters if len(self.parameters) == 1 else self.parameters[rows],
              self.command[rows], outcome, self.dt)
        if not isinstance(rows, slice):  # fancy indexing made copies
            self.state[rows], self.measurement[rows], self.current[rows] = state, measurement, current
            self.outcome[rows] = outcome

    def step(self) -> None:
        """Advance every aircraft by one environment step under its command."""
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
