"""A surface that answers whole and late is no lag, and a lag, of whatever order, is not merely late."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from icing_env import effects, scenario
from icing_env.record import FlightRecord
from sim2real.actuators.lateness import late_squares, lateness
from sim2real.actuators.paths import follow
from sim2real.diagnosis import diagnose
from sim2real.posterior.any_delay import late_fits
from sim2real.posterior.form import FORGIVEN
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import reconstruct
from sim2real.words import sentences
from testbed.commands.diagnose import answer, show
from testbed.flight import fly
from testbed.reports.surface_answers import answer as drawn
from testbed.reports.surface_answers import by_surface, suspected

NATURAL = 8.0  # rad/s of an actuator of second order


@cache
def flown(seed: int = 4) -> FlightRecord:
    """Doublets of all three surfaces."""
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.5})
    return fly(chosen, seed=seed, observer=False, protection=False).record


def asked_early(seed: int, surface: str, samples: int) -> FlightRecord:
    """The record with a surface's command that many samples before the surface answers it: all else is as flown."""
    record = flown(seed)
    command = record.channels[f"{surface}_command"]
    early = np.concatenate([command[samples:], np.repeat(command[-1:], samples)])
    return replace(record, channels=record.channels | {f"{surface}_command": early})


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("samples", [4, 11])
def test_a_delay_is_found_as_long_as_it_is(surface: str, samples: int):
    flights = [reconstruct(asked_early(seed, surface, samples)) for seed in (4, 5)]
    found = lateness(flights, [f.parameters for f in flights])
    assert list(found) == [f"{surface}_path"]
    late = found[f"{surface}_path"]
    assert late.delay == pytest.approx(samples * flights[0].dt, abs=0.004)
    assert late.left < 0.05


@pytest.mark.parametrize(("gear", "offset"), [(0.99, 1.2e-3), (1.015, -5e-4)])
def test_a_delay_of_a_surface_that_is_rigged_a_little_off_is_all_that_there_is(gear: float, offset: float):
    flights = []
    for seed in (4, 5):
        flight = reconstruct(asked_early(seed, "elevator", 6))
        rigged = flight.positions | {"elevator": gear * flight.positions["elevator"] + offset}
        flights.append(replace(flight, positions=rigged))
    late = lateness(flights, [f.parameters for f in flights])["elevator_path"]
    assert late.delay == pytest.approx(0.12, abs=0.003)
    assert late.left < 0.02


def test_surfaces_that_answer_as_published_are_not_late():
    flights = [reconstruct(flown(seed)) for seed in (4, 5)]
    assert late_fits(lateness(flights, [f.parameters for f in flights]), 0.0, 1.0) == []


def test_a_lag_of_second_order_is_more_than_late():
    flight = reconstruct(flown())
    dt, command = flight.dt, flight.commands["elevator_command"]
    a = np.array([1.0 + NATURAL * dt * (1.4 + NATURAL * dt), -2.0 - 1.4 * NATURAL * dt, 1.0])
    position = command[0] + lfilter([(NATURAL * dt) ** 2], a, command - command[0])
    flight = replace(flight, positions=flight.positions | {"elevator": position})
    found = lateness([flight], [flight.parameters])
    assert found["elevator_path"].gain > 100.0  # a delay says much of it
    assert late_fits(found, 0.0, 1.0) == []  # and not enough


def test_a_low_pass_that_gives_way_makes_no_delay_of_what_is_smoothed():
    flight = reconstruct(flown())
    slow = flight.parameters.copy()
    slow["filter_frequency"] *= 0.1
    command, first = flight.commands["elevator_command"], flight.positions["elevator"][0]
    smooth = follow(command, first, slow, "elevator", flight.dt)[:, 0]
    late = np.concatenate([np.repeat(smooth[:1], 2), smooth[:-2]])
    flight = replace(flight, positions=flight.positions | {"elevator": late})
    assert late_squares([(flight, slow)], "elevator", np.array([0.04]))[0] < 1.0  # so smoothed, it is late and no more
    found = lateness([flight], [slow])
    assert found["elevator_path"].left > FORGIVEN**2
    assert late_fits(found, 0.0, 1.0) == []


def test_a_first_order_lag_is_more_than_late():
    flight = reconstruct(flown())
    lagging = effects.with_effects(flight.parameters, {"rudder_lag": {"extra": -0.04}})  # of the model, behind which
    found = lateness([flight], [lagging])  # the aircraft lags
    assert late_fits(found, 0.0, 1.0) == []


def test_what_is_late_where_something_known_enters_is_its_affair():
    flight = reconstruct(asked_early(4, "elevator", 8))
    found = lateness([flight], [flight.parameters])
    assert [u.component for u in late_fits(found, 0.0, 1.0)] == ["elevator_path"]
    assert late_fits(found, 0.0, 1.0, {"elevator_path"}) == []


@pytest.mark.slow
def test_an_elevator_that_answers_late_is_told_as_that_and_not_as_a_lag(capsys):
    found = diagnose([asked_early(seed, "elevator", 7) for seed in (4, 5, 6)])
    assert found.verdict == "unknown"
    assert found.unknown is not None
    assert (found.unknown["component"], found.unknown["kind"]) == ("elevator_path", "dynamic")
    (term,) = found.unknown["terms"]
    assert term["term"] == "delay"
    assert term["coefficient"] == pytest.approx(0.14, abs=0.005)
    assert "it enters at elevator_path, which answers 0.14 s late (" in sentences(found)[0]
    show(found, answer(found))
    before, after = map(float, by_surface(found, answer(found))[0][1:])
    assert after < 0.1 * before
    assert suspected(answer(found)) == ["elevator"]
    figure = drawn(found, answer(found), "elevator")
    assert figure is not None
    lines = {line.get_label(): line.get_xydata() for line in figure.axes[0].get_lines()}
    np.testing.assert_allclose(lines["record"], lines["after"], atol=0.15)  # deg
    assert np.max(np.abs(lines["record"] - lines["before"])) > 1.0
    assert re.search(r"terms of elevator_path \(dynamic\).*\ndelay +0\.1[34]\d* ", capsys.readouterr().out, re.DOTALL)
