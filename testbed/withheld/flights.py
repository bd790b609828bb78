"""One aircraft flown through one manoeuvre: published numbers, baseline spread, effects, gusts, instruments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from testbed.withheld import effects, gusts, instruments, manoeuvres, strangers, trim, unknown
from testbed.withheld import plant as pl
from testbed.withheld.conditions import Conditions
from testbed.withheld.published import DTYPE, KNOBS, PUBLISHED, SENSOR_KNOBS, airframe

CATALOGUE = {**effects.BY_NAME, **unknown.BY_NAME, **strangers.BY_NAME}


@dataclass(frozen=True)
class Aircraft:
    """What is flown: `baseline` and `parts` (effect, form, size).

    `baseline`: factors by number (spread of derivatives, mass), and what instruments and what is zero are off by.
    `terms`: what is added to numbers of the airframe and of the instruments beside, by name.
    """

    baseline: Mapping[str, float] = field(default_factory=dict)
    parts: Sequence[tuple[str, str, float]] = ()
    terms: Mapping[str, float] = field(default_factory=dict)

    def row(self) -> NDArray:
        """Numbers of this aircraft: published, changed by the effects, then by the baseline's factors."""
        row = airframe()
        for name, form, size in self.parts:
            for key, value in getattr(CATALOGUE[name], form)(size)[0].items():
                neutral = PUBLISHED.get(key, 0.0)
                # several effects at once: factors multiply, knobs and constants add
                if key in KNOBS or neutral == 0.0:
                    own = self.baseline.get(effects.PART_OF.get((name, key), ""), 1.0)
                    row[key] += (value - neutral) * own
                elif (name, key) in effects.ADDED:
                    row[key] += (value - neutral) / self.baseline.get(key, 1.0)
                else:
                    row[key] *= value / neutral
        for key, factor in self.baseline.items():
            if key in SENSOR_KNOBS:
                continue
            if offset(key):
                row[key] += factor
                continue
            row[key] *= factor
            if f"{key}_soft" in (DTYPE.names or ()):
                row[f"{key}_soft"] *= factor
        for key, value in self.terms.items():
            if key not in SENSOR_KNOBS:
                row[key] += value
        return row

    def instruments(self) -> dict[str, float]:
        """Errors of the instruments by name."""
        wrong: dict[str, float] = {}
        for name, form, size in self.parts:
            for key, value in getattr(CATALOGUE[name], form)(size)[1].items():
                wrong[key] = wrong.get(key, 0.0) + value
        for own in (self.baseline, self.terms):
            for key in set(own) & set(SENSOR_KNOBS):
                wrong[key] = wrong.get(key, 0.0) + own[key]
        return wrong


def offset(name: str) -> bool:
    """Whether a number of the aircraft's own is an offset, no part of what is published."""
    return name in SENSOR_KNOBS or PUBLISHED.get(name) == 0.0


@dataclass(frozen=True)
class Flown:
    """States [N, 27], outputs [N, 9], commands [N, 5] and every exact channel."""

    states: NDArray
    outputs: NDArray
    commands: NDArray
    channels: dict[str, NDArray]


def fly(aircraft: Aircraft, manoeuvre: manoeuvres.Manoeuvre, gain: float = 1.0, gust: NDArray | None = None) -> Flown:
    """Trim and fly; still air if no gusts are given.

    Raises:
        ArithmeticError: the aircraft cannot be trimmed, or did not come back from the manoeuvre.
    """
    row = aircraft.row()
    y, u = trim.trimmed(row, manoeuvre.speed)
    plan = manoeuvres.inputs(manoeuvre, gain)
    air = np.zeros(((len(plan) - 1) * pl.SUB + 1, pl.GUSTS)) if gust is None else gust
    Y, seen, C = pl.fly(row, y, u, plan, manoeuvres.HOLD, air)
    if not np.isfinite(Y).all() or np.max(np.abs(Y[:, [pl.PHI, pl.THETA]])) > 1.2:
        raise ArithmeticError("the aircraft departed")
    return Flown(Y, seen, C, instruments.exact(Y, seen, aircraft.instruments()))


def turbulence(manoeuvre: manoeuvres.Manoeuvre, given: Conditions, rng: np.random.Generator) -> NDArray:
    """Gusts for a manoeuvre at its speed."""
    samples = len(manoeuvres.inputs(manoeuvre)) - 1
    return gusts.draw(samples, given.sigma, given.scale, manoeuvre.speed, rng, given.gusts)


def recorded(aircraft: Aircraft, manoeuvre: manoeuvres.Manoeuvre, gain: float, given: Conditions,
             rng: np.random.Generator) -> tuple[Flown, dict[str, NDArray]]:
    """Fly and read a manoeuvre.

    Raises:
        ArithmeticError: the aircraft cannot be flown.
    """
    flown = fly(aircraft, manoeuvre, gain, turbulence(manoeuvre, given, rng))
    return flown, instruments.read(flown.channels, given.level, rng)
