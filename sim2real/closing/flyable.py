"""The generic terms of a component as numbers of the effect `discrepancy`, and the condition that they count from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from icing_env.crosstalk import CROSSTALK
from icing_env.effects.discrepancy import AT
from sim2real.library.bends import COMPONENTS
from sim2real.library.pushes import values_of
from sim2real.library.terms import DEVIATION, FROM_ZERO, GENERIC, GENERIC_SIZE, WIND, regressor
from sim2real.library.units import unit_of
from sim2real.records.channels import TOLERANCE
from sim2real.records.reconstruct import Reconstruction

SCALE, DELAY = 0.1, 0.1  # unit of a channel's scale error, and s of its delay
SQUARE = 0.1  # of a reading, in the unit of the search: what it says is fed back, and by a whole one runs away
CUBE = 5.0  # 1/rad2: a tenth of a position of 0.14 rad
COEFFICIENT = {component: coefficient for coefficient, component in COMPONENTS.items()}
ABOUT = ("alpha", "elevator", "airspeed", "theta", "CT", "height")  # whose deviations from medians are terms


@dataclass(frozen=True)
class Choice:
    """One term: its name among the generic ones, its number of the effect, and what counts as one unit of it."""

    term: str
    number: str
    size: float


def choices(component: str, flights: Sequence[Reconstruction]) -> list[Choice]:
    """The generic terms of a component as numbers of the effect, each with its unit."""
    names = flyable(component, flights)
    if component.endswith("_path"):
        return [_of_path(component, name) for name in names]
    if component == WIND:
        return [Choice(name, f"density_{name}", unit_of(name, component)) for name in names]
    half = 0.5 * _mean([f.time[-1] for f in flights])
    if component.startswith("sensor:"):
        channel = component.removeprefix("sensor:")
        units = {"1": ("bias", TOLERANCE[channel]), channel: ("scale", SCALE), f"{channel}_dot": ("delay", DELAY),
                 "time": ("drift", TOLERANCE[channel] / half)}  # fmt: skip
        own = [Choice(name, f"{units[name][0]}_{channel}", units[name][1]) for name in names if name in units]
        return own + [Choice(regressor(of), f"{channel}_of_{of}",
                             (SQUARE if of == f"{channel}2" else 1.0) * unit_of(regressor(of), component))
                      for of in CROSSTALK.get(channel, ())]  # fmt: skip
    p = flights[0].parameters[0]
    slow = 2.0 * _mean([float(np.median(f.channel("airspeed"))) for f in flights])
    per_rate = {"p": slow / p["span"], "q": slow / p["chord"], "r": slow / p["span"], "time": 1.0 / half,
                "alpha_dot": slow / p["chord"], "beta_dot": slow / p["span"]}  # fmt: skip
    target = next(target for where, target, _ in GENERIC if where == component)
    out = []
    for name in names:
        size = GENERIC_SIZE[target]
        for factor in name.split("*"):
            size *= per_rate.get(factor, 1.0) / DEVIATION.get(factor, 1.0)
        number = "0" if name == "1" else name.replace("_dot", "dot").replace("*", "_")
        out.append(Choice(name, f"{COEFFICIENT[component]}_{number}", float(size)))
    return out


def _of_path(component: str, name: str) -> Choice:
    """A term of a surface's path: where its actuator is told to take it."""
    own = {"1": "offset", "position": "gearing", "position*position*position": "cube"}
    kept = name if name in ("direction", "side", "magnitude") else own.get(name, f"of_{name}")
    size = CUBE if kept == "cube" else unit_of(name, component) * (-1.0 if kept == "direction" else 1.0)  # as flown
    return Choice(name, f"{component.removesuffix('_path')}_{kept}", size)


def flyable(component: str, flights: Sequence[Reconstruction]) -> tuple[str, ...]:
    """Terms of a component that the effect flies; without thrust, where it is made of the record's own balance."""
    names = next((names for where, _, names in GENERIC if where == component), ())
    known = all(f.power_from != "balance" for f in flights)
    return tuple(name for name in names if known or "CT" not in name.split("*"))


def condition(component: str, flights: Sequence[Reconstruction]) -> dict[str, float]:
    """The condition that deviations are counted from: medians of the records, the middle of their time."""
    at = {"at_time": 0.5 * _mean([f.time[-1] for f in flights])}
    factors = {factor for name in flyable(component, flights) for factor in name.split("*")}
    own = component.removeprefix("sensor:")
    about = ABOUT if own == component else tuple(AT.keys() - {own} if own in FROM_ZERO else AT)
    for name in sorted(factors & {*about} - {"time"}):
        of = [f.altitude if name == "altitude" else values_of(f, name) for f in flights]
        at[f"at_{name}"] = _mean([float(np.median(values)) for values in of])
    if "at_CT" in at:
        at["at_CT"] -= float(flights[0].parameters["CT_reference"][0])
    return at


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))
