"""Where an effect may reach into the flight: a set of optional functions, each called at one place of the plant.

Every function gets the `Flow` of this instant (columns = flights side by side) and changes it in place, multiplied
by `flow.on`, which is 1 in the columns that carry the effect and 0 in those that do not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

from numpy.typing import NDArray

GROUPS = 4  # copies of every record flown side by side, see flight.py


class Flow(SimpleNamespace):
    """What the plant knows at one instant; see `plant.Plant.rates` for the fields."""


Act = Callable[[Flow], None]
Channels = dict[str, NDArray]
Remember = Callable[[Flow, NDArray], NDArray]
Ask = Callable[[NDArray, NDArray, float], NDArray]
Sense = Callable[[Channels, Channels, NDArray, float], None]


@dataclass
class Hooks:
    """One effect at one size. `parameters` is what the key tells; `states` is how many memory states it has."""

    parameters: dict[str, Any]
    wind: Act | None = None  # flow.wind, flow.spin: air velocity m/s and rotation rad/s, body axes
    surface: Act | None = None  # flow.surfaces: true deflections, rad
    thrust: Act | None = None  # flow.thrust: (2, n) N
    coefficients: Act | None = None  # flow.C: CX CY CZ Cl Cm Cn
    mass: Act | None = None  # flow.mass kg, flow.inertia kg m2, flow.cg_move m
    loads: Act | None = None  # flow.force N, flow.moment N m, in body axes at the c.g.
    memory: Remember | None = None  # returns the rates of the effect's own states, (states, n)
    command: Ask | None = None  # (demand, on, dt) -> demand, once a step: what the servo is asked
    sense: Sense | None = None  # (channels, log, on, dt): changes readings without noise in place
    states: int = 0
    by_command: bool = False  # the gap lies between command and measured position
    slot: slice = field(default_factory=lambda: slice(0, 0))
