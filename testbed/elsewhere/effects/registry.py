"""The list of effects: what each is called, where it enters, how large it may be, and the function that builds it.

A builder takes (size, rng, n): the size, a generator for the effect's lesser parameters, and the number of records;
it returns `Hooks`. The same generator state gives the same lesser parameters at any size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from testbed.elsewhere.hooks import Hooks

Builder = Callable[[float, np.random.Generator, int], Hooks]


@dataclass(frozen=True)
class Effect:
    """`library` is the number in the list of docs/elsewhere.md, None for what is in no list."""

    name: str
    library: int | None
    components: tuple[str, ...]
    family: str
    low: float
    high: float
    unit: str
    either_sign: bool
    other_form: bool
    build: Builder


KNOWN: list[Effect] = []
UNKNOWN: list[Effect] = []


def known(name: str, library: int, components: tuple[str, ...], family: str, sizes: tuple[float, float], unit: str, *,
          either_sign: bool = False, other_form: bool = False) -> Callable[[Builder], Builder]:
    """Register a builder as an effect of the library; `other_form`: coded in another form than the obvious one."""

    def keep(build: Builder) -> Builder:
        KNOWN.append(Effect(name, library, components, family, *sizes, unit, either_sign, other_form, build))
        return build

    return keep


def unknown(name: str, components: tuple[str, ...], family: str, sizes: tuple[float, float], unit: str, *,
            either_sign: bool = False) -> Callable[[Builder], Builder]:
    """Register a builder as an effect that is in no list."""

    def keep(build: Builder) -> Builder:
        UNKNOWN.append(Effect(name, None, components, family, *sizes, unit, either_sign, False, build))
        return build

    return keep
