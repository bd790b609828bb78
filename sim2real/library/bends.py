"""Derivatives that bend: what an effect that changes a derivative may do with powers of that derivative's regressor.

A fin that saturates with sideslip, or roll power that fades as the aileron goes out, is a derivative that is lower and
a cube beside it. The lower derivative may lie within the model's own uncertainty; the cube never does. Where an effect
changes several derivatives (ice), each may also be changed by more or less than the library has it.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from icing_env import aircraft
from icing_env.effects import Effect, Parameter
from icing_env.types import DERIVATIVE_NAMES
from sim2real.library.terms import WANDERING

ALWAYS = {"1", "time"}
COMMON = {*ALWAYS, "airspeed", "alpha", "CT"}  # what any force or moment may be a function of
THRUST = ("thrust_factor_left", "thrust_factor_right")
COMPONENTS = {"CX": "x_force", "CY": "y_force", "CZ": "z_force", "Cl": "rolling_moment", "Cm": "pitching_moment",
              "Cn": "yawing_moment"}  # fmt: skip


# What grows where the library has a constant: generic terms of the one number that an effect changes. Air is seldom the
# standard one at every height, and what rises does not rise evenly.
GROWS = {"density_factor": ("wind", ("height",)),
         "wind_down": ("sensor:altitude", ("1", "time", *WANDERING))}  # fmt: skip

DRAG = {"CD_parasite", "CD_alpha2"}  # of one effect: one of these is fitted, and drag does not only lie or only grow


@cache
def changes(effect: Effect) -> frozenset[str]:
    """Numbers of the aircraft (of PARAMETERS) that an effect changes."""
    row = changed(effect)
    return frozenset(name for name in row.dtype.names or () if np.any(row[name] != plain()[name]))


@cache
def bends(effect: Effect) -> frozenset[tuple[str, str]]:
    """Generic terms (component, name) that are powers of the regressors of the derivatives that an effect changes.

    Or of the reading that it scales: no instrument's calibration is quite a line. An offset may go with time as far as
    it goes, one of a moment or force with speed as well. Thrust goes with speed; of two engines that are not alike it
    may be one alone that is not as published. No gear is quite a line, either.
    """
    if channel := scales(effect):
        return frozenset({(f"sensor:{channel}", f"{channel}*{channel}")})
    if channel := shifts(effect):
        return frozenset((f"sensor:{channel}", term) for term in ("time", *WANDERING))
    if terms := grows(effect):
        return terms
    if changes(effect) == DRAG:
        return frozenset(("x_force", term) for term in ("1", "alpha", "alpha*alpha"))
    if surface := _alone(effect, "", "_gearing"):
        return frozenset({(f"{surface}_path", "position"), (f"{surface}_path", "position*position*position")})
    if changes(effect) and changes(effect) <= set(THRUST):
        return frozenset(("propulsion", term) for term in _of_thrust(effect))
    if len(changes(effect)) == 1 and (component := COMPONENTS.get(next(iter(changes(effect))).removesuffix("_0"))):
        return frozenset({(component, "airspeed"), (component, "time")})
    changed = [name for name in DERIVATIVE_NAMES if name in changes(effect)]
    pairs = [(COMPONENTS[name[:2]], name[3:].rstrip("2")) for name in changed if not name.endswith("_0")]
    powers = (2, 3) if len(pairs) == 1 else (1, 2, 3)
    return frozenset((component, "*".join([by] * power)) for component, by in pairs for power in powers)


def _of_thrust(effect: Effect) -> list[str]:
    """Terms of thrust that another form of an effect on it may have."""
    both = ["both*airspeed", "both*airspeed*airspeed"]
    return both if _of_both_engines(effect) else ["both", *both, "left", "left*airspeed", "left*airspeed*airspeed"]


@cache
def grows(effect: Effect) -> frozenset[tuple[str, str]]:
    """Generic terms (component, name) of an effect that is a constant in the library and seldom one in flight."""
    component, terms = GROWS.get(_alone(effect, "", ""), ("", ()))
    return frozenset((component, term) for term in terms)


@cache
def _of_both_engines(effect: Effect) -> bool:
    """Whether an effect changes the thrust of both engines alike, and nothing else."""
    left, right = (changed(effect)[factor] for factor in THRUST)
    return changes(effect) == set(THRUST) and bool(np.all(left == right))


@cache
def scales(effect: Effect) -> str:
    """The channel whose reading an effect scales, where it does nothing else; empty if there is none."""
    return _alone(effect, "scale_", "")


@cache
def shifts(effect: Effect) -> str:
    """The channel whose reading an effect adds to, where it does nothing else; empty if there is none."""
    return _alone(effect, "bias_", "")


def _alone(effect: Effect, begins: str, ends: str) -> str:
    """What the one number of a kind is of that an effect changes, if it changes no other; else empty."""
    number = next(iter(changes(effect))) if len(changes(effect)) == 1 else ""
    return number[len(begins) : len(number) - len(ends)] if number.startswith(begins) and number.endswith(ends) else ""


@cache
def of_own(effect: Effect, component: str, term: str) -> bool:
    """Whether a generic term is natural to an effect, and made of the regressors of what it changes alone."""
    own = _regressors(effect, component)
    return natural(effect, component, term) and (not own or set(term.split("*")) <= own | ALWAYS)


@cache
def purely_own(effect: Effect, component: str, term: str) -> bool:
    """Whether a generic term of a force or moment is made of the regressors of the derivatives that an effect changes.

    Or a constant, which is what is left of any function; of an effect that changes anything else no term is.
    """
    own = _regressors(effect, component)
    return bool(own) and set(term.split("*")) <= {*own, "1"}


def _regressors(effect: Effect, component: str) -> set[str]:
    """Of the derivatives that an effect changes, where it changes nothing else but constants; else none.

    None either for a component that is no force or moment.
    """
    if component not in COMPONENTS.values() or not _of_coefficients(effect):
        return set()
    return {name[3:].rstrip("2") for name in changes(effect)} - {"0"}


@cache
def powerless(effect: Effect) -> bool:
    """Whether an effect changes the airframe alone: coefficients, none of them one of thrust, or how it is loaded."""
    loading = all(name == "mass" or name.startswith(("inertia_", "cg_shift_")) for name in changes(effect))
    return loading or (_of_coefficients(effect) and not any("CT" in name for name in changes(effect)))


def _of_coefficients(effect: Effect) -> bool:
    """Whether all that an effect changes are coefficients of forces and moments."""
    return all(name[:2] in (*COMPONENTS, "CD") for name in changes(effect))


@cache
def natural(effect: Effect, component: str, term: str) -> bool:
    """Whether a generic term may belong to another form of an effect.

    Where an effect changes derivatives alone, its form is a function of their regressors, of speed, flow and power; a
    rudder's moment is no form of ice on a wing, though both yaw. A constant is what is left of any function, so that
    an effect that changes nothing else may have any form. An instrument's scale is a function of its own reading, its
    bias of time at most; an error of airspeed with the angle of attack is neither. What one engine does is no form of
    what both do alike. Other effects may have any form.
    """
    if (channel := scales(effect)) and component == f"sensor:{channel}":
        return set(term.split("*")) <= {"1", "time", channel}
    if (channel := shifts(effect)) and component == f"sensor:{channel}":
        return set(term.split("*")) <= ALWAYS
    if _of_both_engines(effect) and component == "propulsion":
        return not term.startswith("left")
    if not (own := _regressors(effect, component)):
        return True
    own |= COMMON
    if "alphadot" in own:  # in flight hardly another thing than a rate of pitch
        own |= {"q", "alpha_dot"}
    return all(factor in own for factor in term.split("*"))


@cache
def plain() -> NDArray:
    """The published aircraft."""
    return aircraft.load()


def changed(effect: Effect) -> NDArray:
    """The published aircraft with an effect of sizes that are not neutral."""
    row = plain().copy()
    effect.apply(row, effect.neutral() | {p.name: some(p) for p in effect.parameters})
    return row


def some(parameter: Parameter) -> float:
    """A size that is not neutral."""
    return parameter.typical or 0.5 * (parameter.neutral + max(parameter.low, parameter.high, key=abs))
