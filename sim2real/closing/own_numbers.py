"""The model's own numbers, where they settled beside what was found: the records' word on this aircraft's derivatives.

An effect alone leaves the gap that these make: they are off by some 5 % in any aircraft, and no effect takes that away.
The records that show the effect show them too; they are fitted with it in any case, and here they are flown with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from icing_env.effects.derivatives import NUMBERS, OFFSETS
from sim2real.closing.discrepancy import Description
from sim2real.closing.flyable import COEFFICIENT
from sim2real.closing.remedy import OWN, Remedy
from sim2real.library.candidates import LEAST, Nuisance
from sim2real.posterior.hypotheses import Hypothesis, Settled
from sim2real.posterior.widened import OWN_NUMBERS

FARTHEST = 3.5  # prior deviations that none of some thirty numbers is off by, but for one aircraft in seventy


def with_own_numbers(alone: Remedy, explained: Hypothesis | None, described: Description | None,
                     moves: Sequence[Nuisance]) -> Remedy:  # fmt: skip
    """What an explanation changes, in an aircraft with derivatives and mass as they settled beside it.

    Args:
        alone: of `remedy`; where nothing can be flown of an explanation, what settled beside it is not believed.
        explained: the explanation; without a flight of it nothing settled.
        described: its terms, if they are flown, and the numbers that settled beside these. Of an explanation that the
            search did not fly they count where all are some aircraft's: one so far off would be the explanation.
        moves: the nuisances.
    """
    settled, beside = None if explained is None else explained.settled, None if described is None else described.settled
    if beside is not None and (settled is not None or float(np.max(np.abs(beside.nuisances))) < FARTHEST):
        settled = beside
    if not alone.values or settled is None:
        return alone
    numbers = own_numbers(settled, moves)
    return replace(alone, values=numbers.values | alone.values, own=numbers.own)


def of_component(change: Remedy, component: str) -> Remedy:
    """The change with those of the model's own numbers alone that are derivatives at a component."""
    own = COEFFICIENT.get(component, "none") + "_"
    kept = {name: value for name, value in change.values.get(OWN, {}).items() if name.startswith(own)}
    return replace(change, values={OWN: kept} | {n: v for n, v in change.values.items() if n != OWN})


def own_numbers(settled: Settled, moves: Sequence[Nuisance]) -> Remedy:
    """The aircraft with derivatives, mass, thrust line and offsets as they settled, and nothing else changed."""
    own = {move.parameter: (_change(move, float(size)), OWN_NUMBERS * move.factor * float(error))
           for move, size, error in zip(moves, settled.nuisances, settled.error, strict=True)
           if move.parameter in (*NUMBERS, *OFFSETS)}  # fmt: skip
    return Remedy({OWN: {name: change for name, (change, _) in own.items()}}, own=own)


def _change(move: Nuisance, size: float) -> float:
    """What part of its own a number changes by; an offset by so much."""
    least = -np.inf if move.absolute or move.about is not None else LEAST - 1.0
    return max(move.factor * size, least)
