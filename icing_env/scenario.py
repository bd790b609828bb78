"""A scenario: which aircraft, in which weather, what it is to fly, and what is drawn anew in each episode.

One TOML file under configs/scenarios/, checked key by key; everything has a default but the name.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field as Limited
from pydantic import field_validator

from icing_env import aircraft, effects
from icing_env.configuration import Strict, available, read_toml, validate
from icing_env.errors import InputError, nearest
from icing_env.manoeuvres import Doublet, doublet_set
from icing_env.tasks import REWARD_TERMS, TASKS, WEIGHTS
from icing_env.types import SURFACES


class Range(Strict):
    """A number drawn uniformly in each episode."""

    low: float
    high: float


class Initial(Strict):
    """The steady condition an episode starts from."""

    airspeed: float = Limited(72.0, gt=20.0, lt=110.0)  # m/s
    altitude: float = Limited(2200.0, gt=0.0, lt=9000.0)  # m
    heading: float = 0.0  # rad
    flap: float = Limited(0.0, ge=0.0, le=0.7)  # rad
    eta: dict[str, float] = {}  # ice severity by surface

    @field_validator("eta")
    @classmethod
    def _surfaces(cls, value: dict[str, float]) -> dict[str, float]:
        for name in value:
            if name not in SURFACES:
                raise ValueError(f"no surface '{name}', {nearest(name, list(SURFACES))}")
        return value


class Task(Strict):
    """What is to be flown."""

    kind: Literal["hold", "climb", "holding_pattern", "approach", "doublets", "steps"] = "hold"
    climb_rate: float = 3.0  # m/s
    glide_angle: float = math.radians(3.0)  # rad
    slow_to: float = 45.0  # m/s, end of the approach
    full_flap: float = 0.6545  # rad, end of the approach
    leg_time: float = Limited(60.0, gt=5.0)  # s
    reward: dict[str, float] = {}  # weights that differ from the defaults

    @field_validator("reward")
    @classmethod
    def _terms(cls, value: dict[str, float]) -> dict[str, float]:
        for name in value:
            if name not in REWARD_TERMS:
                raise ValueError(f"no reward term '{name}', {nearest(name, list(REWARD_TERMS))}")
        return value


class CloudPoint(Strict):
    """The cloud from this time on, until the next point."""

    time: float  # s
    lwc: float  # kg/m3
    mvd: float  # m
    temperature: float  # K, static


class Event(Strict):
    """Ice protection switched, or a set of doublets flown, at a time."""

    time: float  # s
    name: str = ""  # by which a result can refer to it
    boots: tuple[Literal["wing", "tail", "vtail_struts"], ...] = ()  # one shot each
    prop_heat: bool | None = None  # switched on or off from here
    doublets: bool = False
    note: str = ""


class Randomise(Strict):
    """What is drawn anew in each episode."""

    initial: dict[Literal["airspeed", "altitude", "heading"], Range] = {}
    eta: dict[str, Range] = {}
    parameters: dict[str, Range] = {}
    effects: dict[str, dict[str, Range]] = {}


class Scenario(Strict):
    """One scenario, as its file says."""

    name: str
    description: str = ""
    aircraft: str = "twin_otter"
    instruments: str = "nasa_2002"
    weather: str = "clear"
    ice: str = "dhc6"
    duration: float = Limited(120.0, gt=0.0)  # s
    ice_protection: Literal["management", "schedule", "off"] = "management"
    initial: Initial = Initial()
    task: Task = Task()
    parameters: dict[str, float] = {}
    effects: dict[str, dict[str, float]] = {}
    cloud: tuple[CloudPoint, ...] = ()
    events: tuple[Event, ...] = ()
    doublets_at: tuple[float, ...] = ()  # s, starts of doublet sets
    doublet_scale: float = Limited(1.0, gt=0.0, le=3.0)  # 1: 0.32 g at 72 m/s
    randomise: Randomise = Randomise()

    def clean_parameters(self) -> NDArray:
        """PARAMETERS row of the aircraft as everybody believes it to be: no effects, but the scenario's instruments."""
        return aircraft.load(self.aircraft, instruments=self.instruments, weather=self.weather, ice=self.ice)

    def true_parameters(self) -> NDArray:
        """PARAMETERS row of the aircraft that flies: the scenario's own numbers and effects in it."""
        aircraft.check_names(self.parameters)
        row = effects.with_effects(aircraft.changed(self.clean_parameters(), **self.parameters), self.effects)
        if self.cloud:
            row["cloud_mode"] = PRESCRIBED
        return row

    def doublets(self) -> tuple[Doublet, ...]:
        """Every test input of the flight."""
        starts = [*self.doublets_at, *(e.time for e in self.events if e.doublets)]
        if self.task.kind == "doublets" and not starts:
            starts = [10.0, 60.0]
        return tuple(d for start in starts for d in doublet_set(start, scale=self.doublet_scale))

    def weights(self) -> NDArray:
        """Reward weights, one row."""
        row = np.zeros(1, WEIGHTS)
        for name, value in {**WEIGHTS_OF[self.task.kind], **self.task.reward}.items():
            row[name] = value
        return row


PRESCRIBED = 4.0  # cloud_mode: lwc, mvd and temperature are set from outside
COMMON = {"alive": 1.0, "smoothness": 0.1, "envelope": 1.0, "terminal": 100.0, "airspeed": 0.3}
WEIGHTS_OF: dict[str, dict[str, float]] = {
    "hold": {**COMMON, "altitude": 0.5, "heading": 0.3},
    "climb": {**COMMON, "climb_rate": 0.5, "heading": 0.3},
    "holding_pattern": {**COMMON, "altitude": 0.5, "heading": 0.3},
    "approach": {**COMMON, "altitude": 0.5, "climb_rate": 0.2, "heading": 0.3},
    "doublets": {**COMMON, "altitude": 0.5, "heading": 0.3},
    "steps": {**COMMON, "altitude": 0.5, "heading": 0.3},
}
assert set(WEIGHTS_OF) == set(TASKS)


def load(name: str | Path | Scenario, **changes: Any) -> Scenario:
    """A scenario by name or path, with top-level keys replaced by `changes`.

    Raises:
        InputError: no such scenario, or a key or value in it is wrong (the nearest valid one is named).
    """
    if isinstance(name, Scenario):
        data = name.model_dump()
    else:
        data = read_toml("scenarios", name)
        data.setdefault("name", Path(str(name)).stem)
        if "base" in data:
            data = _merged(read_toml("scenarios", data.pop("base")), data)
    scenario = validate(Scenario, _merged(data, changes), f"scenario '{data['name']}'")
    _check(scenario)
    return scenario


def names() -> list[str]:
    """Every scenario that comes with the project."""
    return available("scenarios")


def _merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    out = dict(base)
    for key, value in over.items():
        both = isinstance(value, dict) and isinstance(out.get(key), dict)
        out[key] = _merged(out[key], value) if both else value
    return out


def _check(scenario: Scenario) -> None:
    where = f"scenario '{scenario.name}'"
    aircraft.check_names([*scenario.parameters, *scenario.randomise.parameters])
    changed: dict[str, Iterable[str]] = {**scenario.effects, **scenario.randomise.effects}
    for name, values in changed.items():
        valid = [p.name for p in effects.get(name).parameters]
        for key in values:
            if key not in valid:
                raise InputError(f"{where}: effect '{name}' has no parameter '{key}': {nearest(key, valid)}")
    for surface in scenario.randomise.eta:
        if surface not in SURFACES:
            raise InputError(f"{where}: no surface '{surface}': {nearest(surface, list(SURFACES))}")
    if list(scenario.cloud) != sorted(scenario.cloud, key=lambda point: point.time):
        raise InputError(f"{where}: cloud points must be in order of time")
