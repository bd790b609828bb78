"""Which effects are told as one, and how many of them are named."""

from __future__ import annotations

import numpy as np
import pytest

from sim2real.library.candidates import bank
from sim2real.posterior.singles import INDISTINGUISHABLE, EffectFit, ambiguity
from sim2real.words import listed

NAMES = ("elevator_power", "pitch_trim", "roll_trim")


def classes(size: float, cosine: float) -> dict[str, tuple[str, ...]]:
    """Of the first, of whitened size `size`, a second at an angle to it, and a third that has nothing of either."""
    signature = dict(zip(NAMES, ((size, 0.0), (cosine, np.sqrt(1.0 - cosine**2)), (0.0, 1.0)), strict=True))
    families = {f.effect.name: f for f in bank().families if f.effect.name in NAMES}
    rows = np.array([(0.0, 0.0), *signature.values()])
    fits = {name: EffectFit(families[name], 0.0, 0.0, 0.0, 0.0, float(np.hypot(*signature[name])), None, {i: 1.0}, 0.0)
            for i, name in enumerate(NAMES, 1)}  # fmt: skip
    return ambiguity(rows @ rows.T, fits, dict.fromkeys(NAMES, 1.0))


@pytest.mark.parametrize("size", [1.0, 3.0])
def test_an_effect_that_hardly_shows_is_told_as_one_only_with_what_says_the_like_of_it(size: float) -> None:
    assert classes(size, 0.9)[NAMES[0]] == NAMES[1:2]
    assert classes(size, 0.5)[NAMES[0]] == ()  # none would do as well, and is not in the class either


def test_an_effect_that_shows_is_told_as_one_with_what_is_near() -> None:
    apart = np.sqrt(1.0 - 0.9**2)
    assert classes(0.99 * INDISTINGUISHABLE / apart, 0.9)[NAMES[0]] == NAMES[1:2]
    assert classes(1.01 * INDISTINGUISHABLE / apart, 0.9)[NAMES[0]] == ()


def test_three_names_are_told_and_how_many_more() -> None:
    assert listed([]) == ""
    assert listed(["a", "b", "c"]) == "a, b, c"
    assert listed([*"abcde"]) == "a, b, c and 2 more"
