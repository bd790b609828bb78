"""Flies all records of a case at once: with the effect, without it, in still air, and by the book.

Columns come in four groups of n records:
(0) what is recorded;
(1) the same aircraft, gusts and surface positions without the effect, set back to group 0 every WINDOW seconds: a
    reader's free simulation by somebody who knows all but the effect;
(2) as (1) in still air, which tells how much the gusts alone move the aircraft;
(3) as (1) with the published derivatives and the told loading: a reader who starts from the book.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere import actuators
from testbed.elsewhere.hooks import GROUPS, Channels, Flow
from testbed.elsewhere.pilot import Pilot
from testbed.elsewhere.plant import Plant
from testbed.elsewhere.trim import level

DT = 0.01  # s
PREROLL = 10.0  # s flown before the record starts
WINDOW = 10.0  # s
LOGGED = ("speed", "alpha", "beta", "rates", "specific", "turn", "cg_move", "deck", "power", "density",
          "temperature", "pressure", "air", "CT", "thrust", "qbar", "wind")


@dataclass
class Weather:
    """Gust (n, 6, steps) in body axes and slow wind (n, 3, steps) north-east-down."""

    gust: NDArray
    wind: NDArray


def time_axis(duration: float) -> NDArray:
    """Times in s, negative before the record starts."""
    return np.arange(round((duration + PREROLL) / DT) + 1) * DT - PREROLL


def initial(plant: Plant, speeds: Sequence[float] | NDArray, altitudes: Sequence[float] | NDArray,
            headings: Sequence[float] | NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Trim of every record, as states (15, n), surfaces (3, n), throttle (n,)."""
    trims = [level(plant, i, *z) for i, z in enumerate(zip(speeds, altitudes, headings, strict=True))]
    return np.stack([t[0] for t in trims], 1), np.stack([t[1] for t in trims], 1), np.array([t[2] for t in trims])


class Log:
    """Arrays by name, time along the last axis."""

    def __init__(self) -> None:
        """Start empty."""
        self.rows: list[dict[str, NDArray]] = []

    def add(self, flow: Flow, position: NDArray, command: NDArray) -> None:
        """Keep one instant."""
        row = {name: getattr(flow, name) for name in LOGGED}
        row |= {"x": flow.x, "position": position, "command": command, "throttle": flow.throttle}
        self.rows.append(row)

    def arrays(self) -> Channels:
        """Everything kept."""
        return {name: np.stack([row[name] for row in self.rows], axis=-1) for name in self.rows[0]}


def _demand(plant: Plant, command: NDArray, dt: float) -> NDArray:
    """What the servos are asked in all columns: the pilot's command, changed by effects in the columns that have it."""
    demand = np.tile(command, GROUPS)
    for hook in plant.hooks:
        if hook.command is not None:
            demand = hook.command(demand, plant.on, dt)
    return demand


def fly(plant: Plant, pilot: Pilot, weather: Weather, x: NDArray, surfaces: NDArray, time: NDArray) -> Channels:
    """Log of the whole flight in all groups; `x` (15, n) and `surfaces` (3, n) are the trim."""
    n = surfaces.shape[1]
    follows = not any(hook.by_command for hook in plant.hooks)
    state = np.zeros((plant.size, GROUPS * n))
    state[: x.shape[0]] = np.tile(x, GROUPS)
    position, log = np.tile(surfaces, GROUPS), Log()
    flow: Flow | None = None
    calm = np.concatenate([np.ones(2 * n), np.zeros(n), np.ones(n)])
    gust = np.tile(weather.gust.transpose(2, 1, 0), GROUPS) * calm
    wind = np.tile(weather.wind.transpose(2, 1, 0), GROUPS) * calm
    every = round(WINDOW / DT)
    start = round(PREROLL / DT)
    throttle = np.tile(pilot.lever, GROUPS)
    for k in range(time.size):
        if k < start or (k - start) % every == 0:
            state, position = np.tile(state[:, :n], GROUPS), np.tile(position[:, :n], GROUPS)
        command, levers = pilot.act(k, state[:, :n], flow)
        then = actuators.advance(position, _demand(plant, command, DT), DT)
        if follows:
            then = np.tile(then[:, :n], GROUPS)
        following = min(k + 1, time.size - 1)
        now = (position, throttle, gust[k], wind[k])
        throttle = np.tile(levers, GROUPS)
        new, flow = plant.step(time[k], state, DT, now, (then, throttle, gust[following], wind[following]))
        flow.climb = (flow.matrix[2] * state[:3]).sum(0)
        log.add(flow, position, np.tile(command, GROUPS))
        state, position = new, then
    return log.arrays()
