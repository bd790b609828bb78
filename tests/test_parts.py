"""Which parts of what was found are flown: what makes the diagnosed records worse in free flight is told, not flown."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import scenario
from sim2real.change import flown_freely
from sim2real.closing import gap
from sim2real.closing.discrepancy import Description
from sim2real.closing.own_numbers import with_own_numbers
from sim2real.closing.parts import Flown, flown_parts
from sim2real.closing.remedy import remedy
from sim2real.library.candidates import bank, nuisances
from sim2real.posterior.hypotheses import Hypothesis, Settled
from sim2real.posterior.sets import SetFit
from sim2real.prediction.gusts import Gusts
from sim2real.records.reconstruct import Reconstruction, reconstruct
from testbed.flight import fly

TRIM, SLOPE = 0.012, 0.06  # delta_Cm_0, and of Cm_alpha, which the aircraft has beside it
MOVES = nuisances()


@cache
def flight() -> Reconstruction:
    there = {"pitch_trim": {"delta_Cm_0": TRIM}, "derivatives": {"Cm_alpha": SLOPE}}
    chosen = scenario.load("clear_air", duration=32.0, parameters={"turbulence_sigma_w": 0.0}, effects=there)
    return reconstruct(fly(chosen, seed=5, observer=False, protection=False).record)


def ways(term: dict[str, float] | None, slope: float) -> tuple[Flown, Flown]:
    """All of an explanation, flown, and what is chosen of it.

    Args:
        term: of the effect `discrepancy` beside the trim.
        slope: of Cm_alpha, as it settled.
    """
    family = next(f for f in bank().families if f.effect.name == "pitch_trim")
    settled = np.array([slope / m.factor if m.parameter == "Cm_alpha" else 0.0 for m in MOVES])
    explained = Hypothesis(SetFit((family,), estimate=(TRIM,), covariance=np.eye(1)), None, 0.0, 0.0,
                           settled=Settled(settled, np.eye(len(MOVES))))  # fmt: skip
    described = None if term is None else Description("pitching_moment", (), term, np.eye(len(term)))
    flights, alone = [flight()], remedy(explained, described)
    before = flown_freely(flights, [Gusts(0.003)], alone, 0)
    change = with_own_numbers(alone, explained, described, MOVES)
    whole = Flown(alone, before, change, replace(before, after=gap.of_all(flights, change, change.paths)))
    return whole, flown_parts(flights, before, explained, described, MOVES)


def test_what_is_right_is_flown_with_all_of_it():
    whole, chosen = ways(None, SLOPE)
    assert chosen.change.values == whole.change.values and chosen.left == whole.left
    assert whole.left < 0.5 * gap.g(whole.effects_alone.after, whole.effects_alone.alone)


def test_a_term_that_makes_the_records_worse_is_not_flown():
    whole, chosen = ways({"Cm_alpha": 0.5}, SLOPE)
    assert chosen.left < 0.5 * whole.left
    assert "discrepancy" in whole.change.values and "discrepancy" not in chosen.change.values
    assert chosen.change.values["pitch_trim"]["delta_Cm_0"] == TRIM
    assert chosen.change.own["Cm_alpha"][0] == pytest.approx(SLOPE)


def test_numbers_that_make_the_records_worse_are_not_flown():
    whole, chosen = ways(None, -5.0 * SLOPE)
    assert chosen.left < whole.left
    assert chosen.change is chosen.alone and chosen.change.values == whole.alone.values and not chosen.change.own


def test_the_surfaces_that_follow_their_commands_stay_what_they_were():
    """Else the gap before would be another, and what is not flown would seem to have closed it."""
    whole, chosen = ways({"elevator_of_alpha": 0.8}, SLOPE)
    assert "discrepancy" not in chosen.change.values
    assert chosen.change.paths == chosen.alone.paths == whole.alone.paths == ("elevator",)
    assert np.array_equal(chosen.training.before, whole.training.before)
