"""Lags of second order and gears that bend are lags and gears: told by what they are, and not as unknown."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from generated import in_still_air
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lsim
from test_lateness import flown

from icing_env import effects
from sim2real.actuators.paths import answered
from sim2real.actuators.second_order import DAMPINGS, follow, second_order
from sim2real.closing.servos import servos
from sim2real.diagnosis import diagnose
from sim2real.library.bends import bends
from sim2real.library.candidates import Family
from sim2real.posterior.forgiveness import forgive
from sim2real.posterior.form import Form, Liberty
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.posterior.likeness import bent_gear
from sim2real.posterior.sets import SetFit
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.words import sentences
from testbed.withheld.flights import Aircraft


def behind(seed: int, surface: str, frequency: float, damping: float) -> Reconstruction:
    """A flight with a surface recorded behind an actuator of second order, its noise kept."""
    flight = reconstruct(flown(seed))
    noise = flight.positions[surface] - answered(flight, surface, flight.parameters)[:, 0]
    there = follow(flight, surface, flight.parameters, np.array([[frequency, damping]]))[:, 0]
    return replace(flight, positions=flight.positions | {surface: there + noise})


@settings(max_examples=25, deadline=None)
@given(frequency=st.floats(3.0, 40.0), damping=st.floats(*DAMPINGS))
def test_an_actuator_of_second_order_answers_as_its_equation_says(frequency: float, damping: float):
    flight = reconstruct(flown())
    free = flight.parameters.copy()
    free["filter_frequency"], free["elevator_rate"] = 1e6, 1e6
    free["elevator_min"], free["elevator_max"] = -10.0, 10.0
    command = flight.commands["elevator_command"]
    got = follow(flight, "elevator", free, np.array([[frequency, damping]]))[:, 0]
    held = np.append(command[1:], command[-1])  # the command of sample k acts during the step that ends there
    system = ([frequency**2], [1.0, 2.0 * damping * frequency, frequency**2])
    time = flight.dt * np.arange(len(command))
    exact = lsim(system, held - command[0], time, interp=False)[1] + command[0]
    start = flight.positions["elevator"][0] - command[0]  # it begins where it was recorded, not where it was told
    rest = slice(int(4.0 / flight.dt), None)
    assert abs(start) < 0.05
    np.testing.assert_allclose(got[rest], exact[rest], atol=2e-3 * np.ptp(command) + 2e-4)


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize(("frequency", "damping"), [(9.3, 0.7), (14.0, 0.55), (13.0, 0.9)])
def test_an_actuator_of_second_order_is_found_as_it_is(surface: str, frequency: float, damping: float):
    flights = [behind(seed, surface, frequency, damping) for seed in (4, 5)]
    found = second_order(flights, [f.parameters for f in flights], surface)
    assert found is not None
    assert found.frequency == pytest.approx(frequency, rel=0.03)
    assert found.damping == pytest.approx(damping, abs=max(3.0 * found.errors[1], 0.05))
    assert found.frequency == pytest.approx(frequency, abs=max(3.0 * found.errors[0], 0.03 * frequency))
    assert found.gain > 100.0


@pytest.mark.parametrize("surface", SURFACES)
def test_a_published_actuator_is_of_first_order(surface: str):
    flights = [reconstruct(flown(seed)) for seed in (4, 5)]
    found = second_order(flights, [f.parameters for f in flights], surface)
    assert found is None or found.gain < 1.0


def test_a_surface_that_does_not_move_has_no_actuator():
    flight = reconstruct(flown())
    still = replace(flight, commands={})
    assert second_order([still], [still.parameters], "elevator") is None


def test_a_line_and_its_cube_are_a_gear_that_bends_and_a_side_is_not():
    gearing = SetFit((_family("aileron_gearing"),), weights={1: 1.0})
    assert ("aileron_path", "position*position*position") in bends(effects.LIBRARY["aileron_gearing"])
    assert bent_gear(gearing, _terms("aileron_path", "position", "position*position*position"))
    assert not bent_gear(gearing, _terms("aileron_path", "position", "side"))
    assert not bent_gear(gearing, _terms("elevator_path", "position*position*position"))
    assert not bent_gear(SetFit((_family("aileron_lag"),), weights={1: 1.0}), _terms("aileron_path", "position"))


def test_a_pair_keeps_what_other_terms_of_the_second_regain():
    free = (Liberty(1.0, 1, np.inf, 900.0), Liberty(1.0, 1, np.inf, 900.0), Liberty(1.0, 1, np.inf, 900.0))
    told = UnknownFit("aileron_path", 400.0, (("aileron natural frequency", 9.0, 0.1),), 200.0, {})
    lag = Hypothesis(_set(1000.0, "aileron_lag"), None, -5.0, 100.0, Form((0.0,), (1000.0,), free[:1]))
    gear = Hypothesis(_set(1100.0, "rudder_gearing"), None, -5.0, 50.0, Form((0.0,), (1100.0,), free[:1]))
    both = Hypothesis(_set(900.0, "aileron_lag", "rudder_gearing"), None, -10.0, 150.0, Form((0.0,), (900.0,), free))
    none = Hypothesis(_set(1200.0), None, -0.2, 0.0)
    lag, both = replace(lag, instead=replace(told, misfit=300.0)), replace(both, instead=told)
    found = {h.effects: h for h in forgive([none, lag, gear, both], 1200.0, 150.0)}
    assert found["aileron_lag", "rudder_gearing"].regained > 200.0


def test_a_servo_is_told_with_its_frequency_and_damping_where_these_say_much():
    said = UnknownFit("aileron_path", 400.0, (("aileron damping ratio", 0.6, 0.02),
                                              ("aileron natural frequency", 9.0, 0.1)), 200.0, {})  # fmt: skip
    lag = Hypothesis(_set(1000.0, "aileron_lag"), None, -5.0, 100.0, instead=said)
    told, = servos(lag)
    assert (told.component, told.kind, told.values) == ("aileron_path", "dynamic", {})
    assert told.terms == (("damping ratio", 0.6, 0.02), ("natural frequency", 9.0, 0.1))
    assert servos(replace(lag, instead=None)) == ()
    assert servos(replace(lag, instead=replace(said, misfit=970.0))) == ()  # no more than any terms would
    vague = replace(said, terms=(("aileron damping ratio", 1.4, 0.9), *said.terms[1:]))
    assert servos(replace(lag, instead=vague)) == ()
    assert servos(replace(lag, instead=_terms("aileron_path", "position", "position*position*position"))) == ()


@pytest.mark.slow
def test_a_servo_of_second_order_is_told_as_one(tmp_path: Path):
    """An aileron at 10 rad/s with a damping ratio of 0.7 or so was a lag that changes all the time."""
    aircraft = Aircraft(parts=(("aileron_lag", "other", 0.086),))
    found = diagnose(in_still_air(tmp_path, "diagnose", aircraft, 12))
    form = next(e for e in found.effects if e["name"] == "aileron_lag")["other_form"]
    told = {t["term"]: t["coefficient"] for t in form["terms"]}
    assert told["damping ratio"] == pytest.approx(0.7, abs=0.05)
    assert "a servo of second order (10" in sentences(found)[0]
    assert "changing in time" not in sentences(found)[0]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "size"), [("rudder_lag", 0.1), ("aileron_lag", 0.086), ("aileron_gearing", -0.21)])
def test_an_actuator_in_another_form_is_told_as_what_it_is(name: str, size: float, tmp_path: Path):
    """The lags were something unknown on their paths."""
    aircraft = Aircraft(parts=((name, "other", size),))
    best = diagnose(in_still_air(tmp_path, "diagnose", aircraft, 12)).hypotheses[0]
    assert (best["effects"], best["unknown"]) == ([name], False)
    assert best["probability"] > 0.7


def _family(name: str) -> Family:
    effect = effects.LIBRARY[name]
    return Family(effect, effect.parameters[0], (0.0, 0.1), (1,), -0.3, 0.3)


def _terms(component: str, *names: str) -> UnknownFit:
    return UnknownFit(component, 50.0, tuple((name, 1.0, 0.1) for name in names), 0.0, {})


def _set(misfit: float, *names: str) -> SetFit:
    return SetFit(tuple(_family(name) for name in names), misfit=misfit, weights={})

