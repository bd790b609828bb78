"""What a generic coefficient of one stands for, in the units of what it acts on."""

from __future__ import annotations

from collections.abc import Mapping

from sim2real.library.terms import (
    AIR_SIZE,
    DEVIATION,
    GENERIC,
    GENERIC_SIZE,
    PATH_SIZE,
    THRUST_SIZE,
    WIND,
    WIND_CHANGE,
    WIND_SIZE,
)
from sim2real.records.channels import TOLERANCE


def unit_of(term: str, component: str, reach: Mapping[str, float] | None = None) -> float:
    """What a generic coefficient of one stands for: of a force's or moment's coefficient, or a reading, per regressor.

    Deviations are in the units of their channels; CT is thrust over dynamic pressure and wing area.

    Args:
        reach: of the records.
    """
    course = term.removeprefix("slow_")
    if component == "propulsion":
        course = course.partition("*")[2]
    own = component == f"sensor:{course}"  # a scale error is no course
    return _unit(term, component) / (1.0 if own or reach is None else reach.get(course, 1.0))


def _unit(term: str, component: str) -> float:
    if component.endswith("_path"):
        return PATH_SIZE[term] if term in PATH_SIZE else PATH_SIZE["1"] / DEVIATION.get(term, 1.0)
    if component == WIND and term == "height":
        return AIR_SIZE / DEVIATION[term]
    if component == WIND:
        return WIND_SIZE if term.endswith("time") else WIND_CHANGE
    if component == "propulsion":
        return float(THRUST_SIZE / DEVIATION["airspeed"] ** term.count("airspeed"))
    target = next(target for where, target, _ in GENERIC if where == component)
    if component.startswith("sensor:"):
        if term.startswith("rings") or (term not in ("1", "time") and term.removesuffix("_dot") == target):
            return 0.1
        size = TOLERANCE[target]
    else:
        size = GENERIC_SIZE[target]
    for factor in term.removeprefix("slow_").split("*"):
        size /= DEVIATION.get(factor, 1.0)
    return size
