"""How the size of an effect went: the same everywhere, by record, or changing in time; and regimes by ice."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import effects, scenario
from icing_env.record import FlightRecord
from sim2real.by_stretch import BY_RECORD, SHARED, cut_up, random_walk, responses, ways_of
from sim2real.candidates import bank
from sim2real.diagnosis import Diagnosis, diagnose
from sim2real.evidence import gather
from sim2real.reconstruct import reconstruct
from sim2real.where import _variable
from testbed.flight import fly


@cache
def flown(seed: int, **values: float) -> FlightRecord:
    """52 s of the aircraft, with a lift slope that is off."""
    chosen = {"lift_slope": {"change": values["lift"]}} if values else {}
    return fly(scenario.load("clear_air", duration=52.0, effects=chosen), seed=seed, observer=False,
               protection=False).record  # fmt: skip


def with_alpha(record: FlightRecord, offset: np.ndarray | float, flight: str = "") -> FlightRecord:
    """The record with an angle of attack that reads wrong."""
    channels = dict(record.channels) | {"alpha": record["alpha"] + offset}
    return replace(record, channels=channels, meta=replace(record.meta, flight=flight))


def told(found: Diagnosis, name: str) -> dict:
    """One effect's entry of the answer."""
    return next(effect for effect in found.effects if effect["name"] == name)


def within(stretch: dict, truth: float) -> bool:
    """Whether an estimate is within three of its standard errors, and a tenth, of the truth."""
    error = (stretch["high95"] - stretch["low95"]) / 3.92
    return abs(stretch["estimate"] - truth) < 3.0 * error + 0.1 * abs(truth)


def test_one_size_in_two_records_is_shared():
    entry = told(diagnose([with_alpha(flown(3), 0.012), with_alpha(flown(4), 0.012)]), "alpha_bias")
    assert (entry["scope"], entry["history"], entry["sizes"]) == (SHARED, None, None)


def test_another_size_in_each_record_is_told_by_record():
    entry = told(diagnose([with_alpha(flown(3), 0.006), with_alpha(flown(4), 0.018)]), "alpha_bias")
    assert (entry["scope"], entry["history"]) == (BY_RECORD, None)
    assert {s["record"] for s in entry["sizes"]} == {0, 1}
    assert all(within(s, (0.006, 0.018)[s["record"]]) for s in entry["sizes"])


def test_a_bias_that_grows_has_a_history():
    record = flown(3)
    growing = 0.005 + 0.02 * (record.time - record.time[0]) / np.ptp(record.time)
    entry = told(diagnose([with_alpha(record, growing)]), "alpha_bias")
    assert entry["history"] is not None
    assert [s["estimate"] for s in entry["sizes"]] == [size for _, size in entry["history"]]
    for (at, _), stretch in zip(entry["history"], entry["sizes"], strict=True):
        assert stretch["start"] < at < stretch["end"]
        assert within(stretch, float(np.interp(at, record.time, growing)))


def test_a_lift_slope_that_does_not_change_has_none():
    entry = told(diagnose([flown(3, lift=-0.3)]), "lift_slope")
    assert (entry["scope"], entry["history"]) == (SHARED, None)


@pytest.mark.parametrize("name, parameter, size", [
    ("lift_slope", "change", 0.01), ("alpha_bias", "offset", 1e-4), ("mass_error", "fraction", 1e-3)])
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
    assert not _variable(flight, "ice").any() or "lwc" in record.channels
    water = np.where(record.time > record.time[0] + 10.0, 5e-4, 0.0)
    wet = replace(record, channels=dict(record.channels) | {"lwc": water})
    met = _variable(reconstruct(wet), "ice")
    assert met[round(9.0 / flight.dt)] == pytest.approx(0.0, abs=1e-9)
    way = np.sum(flight.channel("airspeed")[flight.time > 10.0]) * flight.dt
    assert met[-1] == pytest.approx(5e-4 * way, rel=0.01)
