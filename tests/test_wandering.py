"""A surface that is elsewhere than its command puts it is told as that, whatever moves it; one that is not, is not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import scenario
from icing_env.record import FlightRecord
from sim2real.actuators.paths import answered, believed
from sim2real.actuators.wandering import Wander, wandering
from sim2real.diagnosis import diagnose
from sim2real.library.knots import hats
from sim2real.library.terms import PATH_SIZE
from sim2real.posterior.any_course import wander_fits
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import reconstruct
from testbed.flight import fly


@cache
def flown(seed: int) -> FlightRecord:
    """Doublets of all three surfaces."""
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.5})
    return fly(chosen, seed=seed, observer=False, protection=False).record


def with_channel(record: FlightRecord, name: str, change: np.ndarray) -> FlightRecord:
    return replace(record, channels=record.channels | {name: record[name] + change})


def evidence(records: list[FlightRecord]) -> dict[str, float]:
    flights = [reconstruct(record) for record in records]
    fits = wander_fits(wandering(flights, [f.parameters for f in flights]), 0.0, 1.0)
    return {fit.component: fit.log_evidence for fit in fits}


def test_surfaces_that_answer_as_published_wander_nowhere():
    found = evidence([flown(4), flown(5)])
    assert set(found) == {f"{surface}_path" for surface in SURFACES}
    assert max(found.values()) < 0.0


@pytest.mark.parametrize("surface", SURFACES)
def test_a_position_that_drifts_is_found_on_its_path_alone(surface: str):
    record = flown(4)
    found = evidence([with_channel(record, surface, 0.004 * np.sin(2.0 * np.pi * record.time / 20.0))])
    assert found.pop(f"{surface}_path") > 20.0
    assert max(found.values()) < 0.0


def off_by(course: np.ndarray) -> tuple[Wander, float]:
    """The elevator's free course where it is so far from where its command puts it [N], and the square of that."""
    flight = reconstruct(flown(4))
    there = answered(flight, "elevator", flight.parameters)[:, 0] + course
    off = replace(flight, positions=flight.positions | {"elevator": there})
    left = believed(off, "elevator", answered(off, "elevator", flight.parameters))
    return wandering([off], [flight.parameters])["elevator_path"], float(np.sum(left**2))


def test_heights_of_a_course_come_back():
    along = hats(reconstruct(flown(4)))
    heights = 2e-3 * np.random.default_rng(1).standard_normal(along.shape[1])
    wander, whole = off_by(along @ heights)
    found = np.linalg.solve(wander.inner, wander.onto)
    assert found @ wander.onto > 0.99 * whole
    np.testing.assert_allclose(PATH_SIZE["1"] * found[1:-1], heights[1:-1], atol=1e-4)


def test_a_lag_is_over_within_a_hat():
    flight = reconstruct(flown(4))
    slow = flight.parameters.copy()
    slow["elevator_lag"] += 0.1
    lag = answered(flight, "elevator", slow) - answered(flight, "elevator", flight.parameters)
    wander, whole = off_by(lag[:, 0])
    assert np.linalg.solve(wander.inner, wander.onto) @ wander.onto < 0.3 * whole


def test_a_hidden_interconnection_is_unknown_and_said_to_go_with_the_other_surface():
    """The rudder goes with the ailerons; its command, as recorded, knows nothing of that."""
    records = [with_channel(flown(seed), "rudder_command", -0.15 * flown(seed)["aileron_command"]) for seed in (4, 5)]
    found = diagnose(records)
    assert found.verdict == "unknown" and found.unknown is not None
    assert found.unknown["component"] == "rudder_path"
    told = {term["term"]: term["coefficient"] for term in found.unknown["terms"]}
    assert told["aileron"] == pytest.approx(0.15, abs=0.03)


@pytest.mark.slow
def test_a_gearing_of_one_side_is_told_by_the_magnitude():
    """A rudder that answers a fifth less to the right alone: half of that is a gearing, in another form or unknown."""
    records = []
    for seed in (4, 5):
        command = flown(seed)["rudder_command"]
        records.append(with_channel(flown(seed), "rudder_command", 0.25 * np.maximum(command, 0.0)))
    found = diagnose(records)
    if found.verdict == "unknown":
        assert found.unknown is not None and found.unknown["component"] == "rudder_path"
        terms = found.unknown["terms"]
    else:
        (named,) = [effect for effect in found.effects if effect["probability"] > 0.5]
        assert named["name"] == "rudder_gearing"
        terms = named["other_form"]["terms"]
    told = {term["term"]: term["coefficient"] for term in terms}
    assert told["magnitude"] == pytest.approx(-0.1, abs=0.03)


@pytest.mark.slow
def test_a_surface_that_moves_as_no_term_has_it_is_unknown_and_said_to_go_with_time():
    """A pick-up's course of its own, in what was recorded and nowhere in flight: its command knows nothing of it."""
    records = []
    for seed in (4, 5):
        record = flown(seed)
        apart = 0.01 * np.sin(2.0 * np.pi * record.time / 9.0) * np.sin(2.0 * np.pi * record.time / 31.0)
        records.append(with_channel(record, "rudder_command", apart))
    found = diagnose(records)
    assert found.verdict == "unknown" and found.unknown is not None
    assert (found.unknown["component"], found.unknown["kind"]) == ("rudder_path", "time_varying")
    assert [term["term"] for term in found.unknown["terms"]] == ["course"]
