"""How the size of an effect went: the same everywhere, by record, or changing in time; and regimes by ice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from flown_again import flown_again
from numpy.typing import NDArray

from icing_env import effects, scenario
from icing_env.record import FlightRecord
from sim2real.actuators.paths import path_residuals
from sim2real.diagnosis import Diagnosis, diagnose
from sim2real.library.candidates import bank
from sim2real.over_time.by_stretch import (
    BY_RECORD,
    SHARED,
    cut_up,
    inwards,
    random_walk,
    responses,
    turned,
    ways_of,
)
from sim2real.over_time.varying import _or_any
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.posterior.sets import SetFit
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.signatures.evidence import gather
from sim2real.where import _variable
from sim2real.words import sentences
from testbed.flight import fly


@cache
def flown(seed: int) -> FlightRecord:
    """52 s of the aircraft."""
    return fly(scenario.load("clear_air", duration=52.0), seed=seed, observer=False, protection=False).record


def with_alpha(record: FlightRecord, offset: np.ndarray | float, flight: str = "") -> FlightRecord:
    """The record with an angle of attack that reads wrong."""
    channels = dict(record.channels) | {"alpha": record["alpha"] + offset}
    return replace(record, channels=channels, meta=replace(record.meta, flight=flight))


def grown(name: str, parameter: str, size: Callable[[float], float]) -> FlightRecord:
    """The aircraft under the recorded controls with an effect of changing size, set anew every second."""
    def rows(flight: Reconstruction, t: float) -> NDArray:
        return effects.with_effects(flight.parameters, {name: {parameter: size(t)}})

    return flown_again(flown(3), rows, 1.0)


def told(found: Diagnosis, name: str) -> dict:
    """One effect's entry of the answer."""
    return next(effect for effect in found.effects if effect["name"] == name)


def test_another_size_in_each_record_is_told_by_record():
    records = [with_alpha(flown(seed).slice(0.0, 32.0), bias) for seed, bias in ((3, 0.006), (4, 0.018))]
    entry = told(diagnose(records), "alpha_bias")
    assert (entry["scope"], entry["history"]) == (BY_RECORD, None)
    assert {s["record"] for s in entry["sizes"]} == {0, 1}
    assert all(s["low95"] - 1e-3 < (0.006, 0.018)[s["record"]] < s["high95"] + 1e-3 for s in entry["sizes"])


@pytest.mark.slow
def test_ice_that_grows_is_told_as_it_grew():
    """No one size of it explains the record, and something unknown that drifts would follow it."""
    def eta(time: float) -> float:
        return 0.02 + 0.2 * float(np.clip((time - 10.0) / 25.0, 0.0, 1.0))

    found = diagnose([grown("wing_ice", "eta", eta)])
    assert found.hypotheses[0] == {"effects": ["wing_ice"], "unknown": False,
                                   "probability": pytest.approx(0.96, abs=0.03)}
    entry = told(found, "wing_ice")
    assert entry["scope"] == SHARED
    assert [s["estimate"] for s in entry["sizes"]] == [size for _, size in entry["history"]]
    for (at, size), stretch in zip(entry["history"], entry["sizes"], strict=True):
        assert stretch["start"] < at < stretch["end"]
        assert size == pytest.approx(eta(at), abs=0.04)
    assert "changing in time: 0.0" in sentences(found)[0]


@pytest.mark.slow
def test_a_moment_that_varies_is_unknown_where_many_effects_would_say_it():
    """Of varying size, a trim, a centre of gravity and the power's moment all follow it."""
    found = diagnose([grown("pitch_trim", "delta_Cm_0", lambda time: 0.0012 + 0.0008 * np.sin(0.3 * time))])
    assert found.verdict == "unknown"
    assert found.unknown is not None and found.unknown["component"] == "pitching_moment"


@pytest.mark.parametrize("worth, expected", [([], 7.0), ([50.0], 7.0), ([50.0, 3.0], 7.0), ([50.0, 49.0, 2.0], 49.0)])
def test_an_effect_that_varies_has_to_beat_the_next_before_the_unknown_gives_way(worth, expected):
    told = _or_any(Hypothesis(SetFit(), None, -3.5, 6.0, regained=1.0), worth)
    assert told.log_evidence + told.regained == pytest.approx(expected)


@pytest.mark.parametrize("name, parameter, size", [
    ("lift_slope", "change", 0.01), ("alpha_bias", "offset", 1e-4), ("mass_error", "change", 1e-3)])
def test_stretches_together_are_the_whole(name, parameter, size):
    """A step during each stretch alone adds up to the same step all along, but for the first seconds."""
    flight = reconstruct(flown(3))
    evidence = gather(flight, replace(bank(), families=(), terms=(), size=1, nuisances=()))
    rows = effects.with_effects(np.repeat(flight.parameters, 2), {name: {parameter: np.array([0.0, size])}})
    cut = cut_up(flight)
    channels, _, _ = responses(evidence, np.tile(rows, (len(cut) - 1, 1)), cut)
    whole = responses(evidence, rows[None], cut[[0, -1]])[0][:, 1]
    assert np.linalg.norm(channels[:, 1:].sum(axis=1) - whole) < 0.02 * np.linalg.norm(whole)
    assert np.linalg.norm(whole) > 0.0


def test_a_path_is_judged_to_its_last_sample_by_the_stretch_that_it_was_read_in():
    flight = reconstruct(flown(3))
    evidence = gather(flight, replace(bank(), families=(), terms=(), size=1, nuisances=()))
    rows = effects.with_effects(np.repeat(flight.parameters, 2), {"elevator_offset": {"angle": np.array([0.0, 0.01])}})
    cut, n = cut_up(flight), len(flight.time)
    _, paths, _ = responses(evidence, np.tile(rows, (len(cut) - 1, 1)), cut)
    assert next(name for name, _, _ in path_residuals(flight, rows)) == "elevator_path"
    moved = paths[:n, 1:] != 0.0
    assert np.array_equal(moved.sum(axis=1), (np.arange(n) > cut[0]).astype(int))
    for stretch, (start, end) in enumerate(pairwise(cut)):
        assert moved[start + 1 : end + 1, stretch].all()


def test_a_step_at_the_end_of_a_range_is_taken_inwards_and_means_the_same():
    sizes = np.array([[0.98, 0.1], [0.5, 0.0]])
    signs = inwards(sizes, np.array([0.04, -0.02]), 0.0, 1.0)
    assert signs.tolist() == [[-1.0, 1.0], [1.0, -1.0]]
    forwards = np.random.default_rng(2).standard_normal((30, 7))  # what is left, two nuisances, four steps
    flown = forwards * np.r_[np.ones(3), signs.ravel()]
    np.testing.assert_allclose(turned(flown.T @ flown, signs), forwards.T @ forwards)


def test_a_random_walk_departs_from_its_mean():
    walk = random_walk(9)
    assert walk.shape == (9, 8)
    assert np.allclose(walk.mean(axis=0), 0.0)
    assert np.allclose(np.sum((walk[-1] - walk[0]) ** 2), 1.0)  # from end to end as far as one unit
    assert random_walk(1).shape == (1, 0)


def test_ways_to_depart_are_those_that_the_records_allow():
    owner = np.array([0, 0, 0, 1, 1, 2])
    told = [(way.scope, way.in_time) for way in ways_of(owner, ["a", "a", "b"])]
    assert told == [("shared", False), ("shared", True), ("per_flight", False), ("per_record", False),
                    ("per_record", True)]  # fmt: skip
    assert [(way.scope, way.in_time) for way in ways_of(np.zeros(1, int), ["a"])] == [("shared", False)]


def test_ice_is_the_water_met():
    record = flown(3)
    flight = reconstruct(record)
    dry = {name: values for name, values in record.channels.items() if name != "lwc"}
    assert not _variable(reconstruct(replace(record, channels=dry)), "ice").any()
    water = np.where(record.time > record.time[0] + 10.0, 5e-4, 0.0)
    wet = replace(record, channels=dict(record.channels) | {"lwc": water})
    met = _variable(reconstruct(wet), "ice")
    assert met[round(9.0 / flight.dt)] == pytest.approx(0.0, abs=1e-9)
    way = np.sum(flight.channel("airspeed")[flight.time > 10.0]) * flight.dt
    assert met[-1] == pytest.approx(5e-4 * way, rel=0.01)


@pytest.mark.slow
def test_one_short_record_has_no_stretches_to_differ():
    record = flown(3).slice(0.0, 9.0)
    found = diagnose([with_alpha(record, 0.02 * np.sin(record.time))])
    assert found.verdict == "unknown"
    assert all(effect["sizes"] is None for effect in found.effects)


def test_a_drag_that_steps_is_no_instrument_though_a_course_of_ax_says_about_as_much():
    found = diagnose([grown("ice_drag", "delta_CD_0", lambda t: 0.015 * (t > 26.0))])
    assert found.where["components"]["x_force"] > 0.8 > 0.2 > found.where["components"]["sensor:ax"]
