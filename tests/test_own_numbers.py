"""The model's own numbers beside a diagnosed effect: an aircraft whose derivatives are off, and its gap closes."""

from functools import cache

import numpy as np
import pytest

from icing_env import scenario
from icing_env.aircraft import load
from icing_env.effects import DESCRIPTIONS, LIBRARY, parse, with_effects
from icing_env.effects.derivatives import NUMBERS, OFFSETS
from icing_env.record import FlightRecord
from sim2real.baseline.loading import of_published
from sim2real.closing.own_numbers import own_numbers, with_own_numbers
from sim2real.closing.remedy import Remedy
from sim2real.diagnosis import Diagnosis, diagnose
from sim2real.library.candidates import nuisances, shifted
from sim2real.posterior.hypotheses import Hypothesis, Settled
from sim2real.posterior.sets import SetFit
from sim2real.posterior.widened import OWN_NUMBERS
from sim2real.words import sentences
from testbed.flight import fly

OFF = {"CX_0": 0.08, "CX_alpha": -0.06, "CZ_alpha": -0.04, "CZ_elevator": 0.07, "Cm_q": 0.08, "Cl_p": -0.06,
       "Cl_beta": 0.07, "Cn_beta": -0.05, "Cn_rudder": 0.05}  # fmt: skip


def test_numbers_change_each_by_its_share_and_neutral_ones_not_a_bit():
    effect, row = DESCRIPTIONS["derivatives"], load()
    assert "derivatives" not in LIBRARY
    assert with_effects(row, {"derivatives": effect.neutral()}).tobytes() == row.tobytes()
    changed = with_effects(row, {"derivatives": {"Cm_q": 0.1, "mass": -0.02}})
    assert {n for n in row.dtype.names if changed[n][0] != row[n][0]} == {"Cm_q", "mass"}
    assert changed["Cm_q"][0] == pytest.approx(1.1 * row["Cm_q"][0])


def test_what_settled_is_flown_as_the_diagnosis_flew_it():
    moves = nuisances()
    sizes = np.random.default_rng(0).normal(size=len(moves))
    found = own_numbers(Settled(sizes, np.diag(np.full(len(moves), 0.25))), moves)
    row = load()
    there = shifted(row, moves, sizes, "torque")
    for name in (*NUMBERS, *OFFSETS):
        assert found(row)[name][0] == pytest.approx(there[name][0])
    assert found.own["Cm_q"][1] == pytest.approx(OWN_NUMBERS * 0.5 * 0.05)


def test_nothing_settles_beside_what_is_not_flown():
    moves = nuisances()
    settled = Settled(np.ones(len(moves)), np.eye(len(moves)))
    flown, not_flown = (Hypothesis(SetFit(), None, 0.0, 0.0, settled=at) for at in (settled, None))
    effect = Remedy({"pitch_trim": {"delta_Cm_0": 0.01}})
    assert with_own_numbers(effect, flown, None, moves).values["pitch_trim"] == {"delta_Cm_0": 0.01}
    assert with_own_numbers(effect, not_flown, None, moves) is effect
    assert not with_own_numbers(Remedy(), flown, None, moves).values
    assert not with_own_numbers(Remedy(), None, None, moves).values


@cache
def flown(seed: int) -> FlightRecord:
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.5},
                           effects={"derivatives": OFF, "pitch_trim": {"delta_Cm_0": 0.02}})  # fmt: skip
    return fly(chosen, seed=seed, observer=False, protection=False).record


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnose([flown(3)], [flown(13)], climb=True)


def test_an_effect_in_an_aircraft_of_its_own_is_named_and_its_gap_closes(found):
    held = found.gap["held_out"]
    assert found.hypotheses[0]["effects"] == ["pitch_trim"]
    assert held["closure"] > 0.85
    assert held["closure"] > held["closure_effects_alone"] + 0.1
    assert held["after_effects_alone"] > held["after"]
    assert "by the effects alone" in sentences(found)[1]


def test_the_numbers_are_told_with_errors_that_hold_the_truth(found):
    told = found.resimulate["model"]
    assert set(told) == {*NUMBERS, *OFFSETS}
    off = [(one["change"] - OFF.get(name, 0.0)) / one["std_error"] for name, one in told.items()]
    assert np.sqrt(np.mean(np.square(off))) < 1.8
    moves = nuisances()
    before = np.sqrt(np.diag(np.linalg.inv(of_published(moves).precision)))
    spread = {move.name: move.factor * sd for move, sd in zip(moves, before, strict=True)}
    assert all(0.0 < one["std_error"] < 1.1 * OWN_NUMBERS * spread[name] for name, one in told.items())


def test_the_command_flies_what_was_diagnosed(found):
    effects = found.resimulate["command"].split(" --effect ")[1:]
    values = dict(parse(text) for text in effects)
    assert list(values) == ["derivatives", "pitch_trim"]
    again, row = Remedy(values)(load()), found.details.change(load())
    assert all(again[n][0] == pytest.approx(row[n][0], rel=1e-4) for n in row.dtype.names)


def test_the_ladder_tells_numbers_from_effects(found):
    rungs = {r["name"]: r for r in found.gap["ladder"]["rungs"]}
    assert rungs["diagnosed"]["closure"] == found.gap["held_out"]["closure"]
    assert rungs["effects alone"]["closure"] == found.gap["held_out"]["closure_effects_alone"]
    assert 0.0 < rungs["numbers alone"]["closure"] < rungs["diagnosed"]["closure"]  # a trim is a number, too
