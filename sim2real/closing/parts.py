"""Which parts of what was found are flown: those that leave least of the gap on the diagnosed records.

Effects, the terms beside them and the model's own numbers are fitted to what a filter leaves from one sample to the
next. In free flight an error grows: a term that is right a step ahead, and stands for another that no simulator has,
may feed back on itself there, and own numbers that were right beside an actuator's form are not beside the actuator.
Records that were held out have no part in the choice.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from sim2real.closing import gap
from sim2real.closing.discrepancy import Description
from sim2real.closing.own_numbers import with_own_numbers
from sim2real.closing.remedy import Remedy, remedy
from sim2real.library.candidates import Nuisance
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.records.reconstruct import Reconstruction

CLOSER = 0.9  # of the gap that all of it leaves: parts that leave less are flown instead (assumed)


@dataclass(frozen=True)
class Flown:
    """What is changed in the model, and what that leaves of the gap on the diagnosed records.

    Attributes:
        alone, effects_alone: effects and terms, the model's own numbers as they were, and what they leave.
        change, training: the same with the own numbers, if these are flown, and what that leaves.
    """

    alone: Remedy
    effects_alone: gap.Energy
    change: Remedy
    training: gap.Energy

    @property
    def left(self) -> float:
        """The gap after it all [tolerances]."""
        return gap.g(self.training.after, self.training.alone)


def flown_parts(flights: Sequence[Reconstruction], before: gap.Energy, explained: Hypothesis | None,
                described: Description | None, moves: Sequence[Nuisance], paths: gap.Paths = ()) -> Flown:  # fmt: skip
    """All of an explanation, or the parts of it that leave less than CLOSER of what all of it leaves.

    Args:
        flights: the diagnosed records.
        before: theirs, with the surfaces' commands followed that it enters.
        explained, described: of `remedy`.
        moves: the nuisances.
        paths: further surfaces that follow their commands.
    """
    whole, *parts = _ways(flights, before, explained, described, moves, paths)
    if whole.left <= gap.null_quantile(before.alone):
        return whole
    return min((part for part in parts if part.left < CLOSER * whole.left), key=lambda part: part.left, default=whole)


def _ways(flights: Sequence[Reconstruction], before: gap.Energy, explained: Hypothesis | None,
          described: Description | None, moves: Sequence[Nuisance], paths: gap.Paths) -> Iterator[Flown]:  # fmt: skip
    """With the terms and without, with the own numbers and without; all of it first."""
    def leaves(change: Remedy) -> gap.Energy:
        return replace(before, after=gap.of_all(flights, change, change.paths))

    through = (*paths, *remedy(explained, described).paths)  # else what is not flown would seem to leave nothing
    for terms in (described, None) if described is not None and described.values else (described,):
        alone = replace(remedy(explained, terms), through=through)
        change, left = with_own_numbers(alone, explained, terms, moves), leaves(alone)
        if change is not alone:
            yield Flown(alone, left, change, leaves(change))
        yield Flown(alone, left, alone, left)
