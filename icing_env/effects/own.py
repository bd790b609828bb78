"""Effects of a user's own: from a Python file, an installed package, or made on the spot; checked, then registered.

A file is ordinary Python with one or more `Effect`s at its top level (examples/own_effect.py). A package announces its
own under the entry-point group `icing.effects`, each entry naming an `Effect` or a module that has some.
"""

from __future__ import annotations

import runpy
from collections.abc import Iterable
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

import numpy as np

from icing_env.aircraft import broadcast, load
from icing_env.effects import LIBRARY
from icing_env.effects.effect import ENTERS_AT, Component, Effect
from icing_env.errors import InputError, nearest

GROUP = "icing.effects"
_READ: dict[str, Path] = {}  # names of effects read from files, so that a file read again replaces what it gave


def register(effect: Effect, replace: bool = False) -> Effect:
    """Add an effect to the library: from then on it is flown, randomised, listed and searched for as any other.

    Args:
        effect: the same object twice is no error.
        replace: put it in the place of one of that name.

    Raises:
        InputError: the name is taken, or the effect is not what `Effect` says one is.
    """
    known = LIBRARY.get(effect.name)
    if known is effect:
        return effect
    if known is not None and not replace:
        raise InputError(f"effect '{effect.name}' is already in the library: choose another name")
    _check(effect)
    LIBRARY[effect.name] = effect
    return effect


def from_file(path: str | Path) -> list[str]:
    """Register every effect of a Python file (which is run); their names.

    Raises:
        InputError: the file does not run, has no effect, or one that is wrong.
        FileNotFoundError: there is no such file.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(2, "no such file of effects", str(path))
    try:
        found = runpy.run_path(str(path), run_name="effects_of_your_own")
    except InputError:
        raise
    except Exception as problem:
        raise InputError(f"effects of '{path}': the file does not run, {_told(problem)}") from problem
    again = {name for name, came_from in _READ.items() if came_from == path.resolve()}
    names = _register_all(found, f"'{path}'", again)
    _READ.update(dict.fromkeys(names, path.resolve()))
    return names


def from_packages() -> list[str]:
    """Register what installed packages announce under `icing.effects`; the names of those effects.

    Raises:
        InputError: an entry cannot be imported, or names no effect.
    """
    names: list[str] = []
    for entry in entry_points(group=GROUP):
        try:
            found = entry.load()
        except Exception as problem:
            raise InputError(f"effects of entry point '{entry.name}' ({entry.value}): not importable, "
                             f"{_told(problem)}") from problem  # fmt: skip
        members = vars(found) if isinstance(found, ModuleType) else {entry.name: found}
        names += _register_all(members, f"entry point '{entry.name}' ({entry.value})")
    return names


def _register_all(members: dict[str, Any], where: str, replaced: Iterable[str] = ()) -> list[str]:
    found = [value for value in members.values() if isinstance(value, Effect)]
    if not found:
        raise InputError(f"effects of {where}: no Effect in it; expected a line such as EFFECT = Effect(name=..., ...)")
    return [register(effect, replace=effect.name in replaced).name for effect in found]


def _check(effect: Effect) -> None:
    """Hold an effect to its contract (tests/test_effects.py holds the library to the same)."""
    say = f"effect '{effect.name}': "
    if not effect.name.isidentifier():
        raise InputError(f"{say}a name is letters, digits and underscores")
    components = list(get_args(Component))
    if effect.component not in components:
        raise InputError(f"{say}no component '{effect.component}': {nearest(effect.component, components)}")
    for place in effect.enters_at or ("",):
        if place not in ENTERS_AT:
            raise InputError(f"{say}enters_at has '{place}': {nearest(place, list(ENTERS_AT))}")
    if not any(p.typical != p.neutral for p in effect.parameters):
        raise InputError(f"{say}needs a parameter whose typical value is not its neutral one")
    for p in effect.parameters:
        if not (p.name.isidentifier() and p.low <= p.neutral <= p.high and p.low <= p.typical <= p.high
                and p.low < p.high):  # fmt: skip
            raise InputError(f"{say}parameter '{p.name}' needs low <= neutral, typical <= high and low < high")
    _try(effect, say)


def _try(effect: Effect, say: str) -> None:
    """Apply it: to nothing by its neutral values, to something by its typical ones, to two aircraft at once."""
    two = broadcast(load(), 2)
    values = {p.name: np.array([p.neutral, p.typical]) for p in effect.parameters}
    neutral, typical, both = two[:1].copy(), two[:1].copy(), two.copy()
    try:
        effect.apply(neutral, effect.neutral())
        effect.apply(typical, effect.typical())
        effect.apply(both, values)
    except Exception as problem:
        raise InputError(f"{say}apply fails on an array of two aircraft, {_told(problem)}") from problem
    if neutral.tobytes() != two[:1].tobytes():
        raise InputError(f"{say}its neutral values change the aircraft; they must leave every number as it was")
    if typical.tobytes() == two[:1].tobytes():
        raise InputError(f"{say}its typical values change nothing; apply must change the array that it is given")
    if both[:1].tobytes() != neutral.tobytes() or both[1:].tobytes() != typical.tobytes():
        raise InputError(f"{say}apply mixes up aircraft: each row must follow its own value")
    for name in both.dtype.names or ():
        if not np.isfinite(both[name]).all():
            raise InputError(f"{say}its typical values make {name} {both[name].tolist()}: expected finite numbers")


def _told(problem: Exception) -> str:
    return f"{type(problem).__name__}: {problem}"
