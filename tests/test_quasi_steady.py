"""Aircraft whose downwash does not lag, as a set of derivatives that is quasi-steady has it when taken by itself."""

from __future__ import annotations

from functools import cache

import pytest

from icing_env import scenario
from icing_env.aircraft import load
from icing_env.effects import with_effects
from icing_env.record import FlightRecord
from sim2real.baseline.quasi_steady import NOTE
from sim2real.diagnosis import diagnose
from testbed.flight import fly


@cache
def flown(sigma: float, lag: float, trim: float = 0.0) -> FlightRecord:
    """Doublets of all surfaces by an aircraft with so much of the published lag."""
    numbers = {"turbulence_sigma_w": sigma, "Cm_alphadot": lag * float(load()["Cm_alphadot"][0])}
    chosen = scenario.load("clear_air", duration=52.0, parameters=numbers,
                           effects={"pitch_trim": {"delta_Cm_0": trim}} if trim else {})
    return fly(chosen, seed=2, observer=False, protection=False).record


def noted(found) -> bool:
    return NOTE in found.provenance["records"][0]["notes"]


@pytest.mark.parametrize("sigma", [0.0, 0.5])
def test_an_aircraft_without_the_lag_has_no_gap_and_the_records_say_so(sigma):
    found = diagnose([flown(sigma, 0.0)])
    assert found.verdict == "no_gap" and noted(found)


def test_what_else_it_has_is_told_alone_and_the_command_flies_both():
    found = diagnose([flown(0.5, 0.0, 0.02)])
    assert found.hypotheses[0]["effects"] == ["pitch_trim"] and noted(found)
    assert " --effect derivatives:" in found.resimulate["command"] and "Cm_alphadot=-1" in found.resimulate["command"]
    flies = with_effects(load(), {"derivatives": {"Cm_alphadot": -1.0}})
    assert flies["Cm_alphadot"][0] == 0.0 and flies["Cm_q"][0] == load()["Cm_q"][0]


def test_half_a_lag_is_a_gap_as_before():
    found = diagnose([flown(0.5, 0.5)])
    assert found.hypotheses[0]["effects"] == ["downwash_lag"] and not noted(found)
