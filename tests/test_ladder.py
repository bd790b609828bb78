"""The evidence ladder, what a regression without physics can do, and paths flown from commands."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import scenario
from icing_env.aircraft import load
from icing_env.effects import with_effects
from icing_env.record import FlightRecord
from sim2real.actuators.paths import driven, follow
from sim2real.closing import black_box, gap
from sim2real.closing.remedy import Remedy
from sim2real.diagnosis import Diagnosis, diagnose
from sim2real.ladder import synthetic
from sim2real.prediction.gusts import Gusts
from sim2real.records.reconstruct import reconstruct
from testbed.flight import fly


@cache
def flown(name: str, parameter: str, size: float, seed: int) -> FlightRecord:
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.5},
                           effects={name: {parameter: size}} if name else {})  # fmt: skip
    return fly(chosen, seed=seed, observer=False, protection=False).record


@pytest.fixture(scope="module")
def climbed() -> Diagnosis:
    records = [flown("lift_slope", "change", -0.25, seed) for seed in (3, 13)]
    return diagnose(records[:1], records[1:], climb=True)


def test_the_diagnosed_effect_stands_above_its_rival_and_beside_the_ceiling(climbed):
    rungs = {r["name"]: r for r in climbed.gap["ladder"]["rungs"]}
    assert list(rungs) == ["nothing", "numbers alone", "runner-up", "effects alone", "diagnosed", "black box"]
    assert rungs["nothing"]["closure"] == 0.0
    assert rungs["nothing"]["gap"] == climbed.gap["held_out"]["before"]
    assert rungs["diagnosed"]["closure"] == climbed.gap["held_out"]["closure"] > rungs["runner-up"]["closure"] + 0.3
    assert rungs["diagnosed"]["closure"] > rungs["black box"]["closure"] - 0.1
    assert "lift_slope" in rungs["diagnosed"]["effects"]
    assert not set(rungs["runner-up"]["effects"]) & set(rungs["diagnosed"]["effects"])


def test_the_search_closes_nothing_where_there_is_no_gap(climbed):
    none = climbed.gap["ladder"]["no_gap"]
    assert none["effects"]
    assert none["closure"] <= 0.02
    assert none["before"] > 0.0


def test_a_model_that_flies_to_no_numbers_agrees_with_nothing():
    flight = reconstruct(flown("", "", 0.0, 3))

    def wild(row):
        row = row.copy()
        row["Cm_q"] *= -5.0
        return row

    left, sound = (gap.squares(flight, change) for change in (wild, Remedy()))
    assert np.array_equal(np.isfinite(left), np.isfinite(sound)) and np.isfinite(left).any()
    assert np.nanmin(left.max(axis=1)) > 1e3 > np.nanmax(sound)


def test_synthetic_pieces_keep_what_is_known_of_their_own_time():
    flight = reconstruct(flown("", "", 0.0, 3))
    known = np.arange(len(flight.time))[:, None] * np.ones(6)
    pieces = synthetic(replace(flight, known=known), Gusts(0.5), 1)
    assert len(pieces) > 1
    for piece in pieces:
        assert piece.known is not None and piece.known.shape == (len(piece.time), 6)
        start = int(piece.known[0, 0])
        np.testing.assert_array_equal(piece.altitude, flight.altitude[start : start + len(piece.time)])


def test_without_being_asked_no_ladder_is_climbed():
    record = flown("", "", 0.0, 5).slice(0.0, 20.0)
    assert set(diagnose([record], [record]).gap) == {"training", "held_out"}


def test_a_regression_learns_what_a_changed_plant_adds():
    """Trained on a record of an aircraft with a pitching moment that the model lacks, it finds its size."""
    flight = reconstruct(flown("", "", 0.0, 3))
    found = {}
    for name, values in {"none": {}, "trim": {"pitch_trim": {"delta_Cm_0": 0.01}}}.items():
        record = flight if not values else reconstruct(flown("pitch_trim", "delta_Cm_0", 0.01, 3))
        box = black_box.train([record])
        features, _ = black_box._samples(record)
        found[name] = np.mean(box(features[0], features[1:]), axis=0)
    p = flight.parameters[0]
    rho_v2 = 0.5 * 0.98 * float(np.median(flight.channel("airspeed"))) ** 2
    wanted = 0.01 * rho_v2 * p["wing_area"] * p["chord"] / p["inertia_yy"]
    assert found["trim"][4] - found["none"][4] == pytest.approx(wanted, rel=0.25)
    assert np.abs(found["trim"][:3] - found["none"][:3]).max() < 0.05


@pytest.mark.parametrize(("name", "parameter", "size"), [("elevator_offset", "angle", 0.015)])
def test_a_gap_in_a_path_shows_and_closes_once_the_path_is_flown(name, parameter, size):
    flight, change = reconstruct(flown(name, parameter, size, 13)), Remedy({name: {parameter: size}})
    assert change.paths == ("elevator",)
    hidden = gap.held_out(gap.energies(flight, change, Gusts(0.5), 1), 0)
    shown = gap.held_out(gap.energies(flight, change, Gusts(0.5), 1, change.paths), 0)
    assert hidden["before"] == pytest.approx(hidden["after"], abs=1e-9)  # positions are as recorded either way
    assert shown["before"] > 3.0 * hidden["before"]
    assert shown["closure"] > 0.85


def test_a_driven_surface_is_where_the_actuator_takes_it():
    flight = reconstruct(flown("elevator_offset", "angle", 0.015, 13))
    row = with_effects(flight.parameters, {"elevator_offset": {"angle": 0.015}})
    there = driven(flight, row, ("elevator",)).controls["elevator"]
    later = slice(round(2.0 / flight.dt), None)
    assert np.sqrt(np.mean((there - flight.controls["elevator"])[later] ** 2)) < 1.5e-3  # noise of the recorded one
    wrong = driven(flight, flight.parameters, ("elevator",)).controls["elevator"]
    assert np.mean((flight.controls["elevator"] - wrong)[later]) == pytest.approx(0.015, abs=1e-3)
    assert driven(flight, row, ()).controls["elevator"] is flight.controls["elevator"]
    assert np.array_equal(driven(flight, row, ("elevator",)).controls["rudder"], flight.controls["rudder"])


def test_following_without_a_low_pass_is_the_position_itself():
    row = load()
    command, dt = np.where(np.arange(200) < 100, 0.0, 0.1), 0.02
    row["filter_frequency"] = 1e6
    there = follow(command, 0.0, row, "elevator", dt)[:, 0]
    assert there[-1] == pytest.approx(0.1, abs=1e-3)
    assert np.max(np.diff(there)) <= row["elevator_rate"][0] * dt + 1e-12
