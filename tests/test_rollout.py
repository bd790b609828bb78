"""A user's simulator in the place of ours: its gap is found, what it has is not blamed, bad ones are told."""

from __future__ import annotations

import runpy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from icing_env import effects, scenario
from icing_env.aircraft import load
from icing_env.errors import InputError
from icing_env.record import FlightRecord, write
from icing_env.sensors import SENSOR_PARAMETERS
from sim2real import rollout
from sim2real.closing.missing_terms import missing_terms, residual_coefficients
from sim2real.diagnosis import diagnose
from sim2real.prediction.predictor import Predictor, put
from sim2real.prediction.windows import COMPARED
from sim2real.records.reconstruct import reconstruct
from testbed.cli import _run
from testbed.flight import fly

EXAMPLE = Path(__file__).parent.parent / "examples" / "own_simulator.py"
OWN = runpy.run_path(str(EXAMPLE), run_name="example")


@cache
def flown(**built_in: float) -> FlightRecord:
    """52 s of the aircraft, with a lift slope or an angle of attack that is off."""
    values = {"lift_slope": {"change": built_in.get("lift", 0.0)}, "alpha_bias": {"offset": built_in.get("bias", 0.0)}}
    return fly(scenario.load("clear_air", duration=52.0, effects=values), seed=3, observer=False,
               protection=False).record  # fmt: skip


def ours_with(values: dict[str, dict[str, float]]) -> rollout.Rollout:
    """A stranger's simulator made of our plant: it flies with effects of its own in the aircraft."""
    whole = reconstruct(flown())
    row = effects.with_effects(whole.parameters, values)
    for name, _, _ in SENSOR_PARAMETERS:
        row[name] = load(instruments="perfect")[name]

    def simulate(initial_state, controls, dt, parameters):
        n = len(controls["elevator"])
        altitude = np.full(n, initial_state["altitude"])
        flight = replace(whole, controls=dict(controls), time=np.arange(n) * dt, altitude=altitude,
                         measured=whole.measured[:n])
        predictor = Predictor(flight, row)
        put(predictor.fleet, dict(initial_state) | {name: series[0] for name, series in controls.items()})
        told = predictor.fly(n - 1)[:, 0]
        return {name: told[:, j] for j, name in enumerate(COMPARED)}

    return simulate


def test_what_your_simulator_already_has_is_not_blamed_and_what_it_lacks_is_found():
    found = diagnose([flown(lift=-0.25, bias=0.009)], simulator=ours_with({"lift_slope": {"change": -0.25}}))
    assert found.verdict == "explained"
    assert found.hypotheses[0]["effects"] == ["alpha_bias"]
    assert found.effects[0]["parameters"]["offset"]["estimate"] == pytest.approx(0.009, rel=0.2)
    apart, = found.provenance["simulator"]
    assert apart["CZ"] > 10.0 * apart["CX"]


def test_an_aircraft_that_flies_as_your_simulator_has_no_gap():
    found = diagnose([flown(lift=-0.25)], simulator=ours_with({"lift_slope": {"change": -0.25}}))
    assert found.verdict == "no_gap"


def test_our_own_plant_as_yours_changes_nothing_its_memory_of_the_downwash_included():
    apart = rollout.difference(rollout.flying_as(reconstruct(flown()), ours_with({})))
    assert all(value < 2e-4 for value in apart.values())


def test_other_equations_with_the_published_derivatives_are_our_aircraft():
    """The example with its elevator repaired: another person's equations and integrator."""
    OWN["CM"]["elevator"], OWN["CZ"]["elevator"] = -1.740, -0.608
    try:
        apart = rollout.difference(rollout.flying_as(reconstruct(flown().slice(0.0, 24.0)), OWN["rollout"]))
    finally:
        OWN["CM"]["elevator"], OWN["CZ"]["elevator"] = 0.7 * -1.740, 0.7 * -0.608
    assert max(apart[name] for name in ("CX", "CY", "CZ")) < 0.01
    assert max(apart[name] for name in ("Cl", "Cm", "Cn")) < 0.004


def test_residual_coefficients_show_the_weak_elevator():
    residual = residual_coefficients(OWN["rollout"], flown().slice(0.0, 30.0))
    found = missing_terms(residual)["Cm"]
    lacking = dict(zip(found.terms, found.fit.theta, strict=True))
    assert lacking["elevator"] == pytest.approx(-0.3 * 1.740, rel=0.25)
    assert set(residual) >= {"CX", "CY", "CZ", "Cl", "Cm", "Cn", "time"}


def test_gap_by_channel_takes_whatever_channels_there_are():
    def pitch_alone(initial_state, controls, dt, parameters):
        return {"q": np.zeros(len(controls["elevator"]) - 1)}

    gap = rollout.gap_by_channel(pitch_alone, flown())
    assert set(gap) == {"q"}
    assert gap["q"] > 0.5
    with pytest.raises(InputError, match=r"reads no ax, az"):
        rollout.flying_as(reconstruct(flown()), pitch_alone)


@pytest.mark.parametrize(("text", "word"), [
    ("x = 1", "no function `rollout"), ("1/0", "ZeroDivisionError"),
    ("def rollout(initial_state, controls, dt, parameters):\n    raise RuntimeError('stalled')", "stalled"),
    ("def rollout(initial_state, controls, dt, parameters):\n    return {'speed': 1}", "expected any of"),
    ("def rollout(initial_state, controls, dt, parameters):\n    return {'q': [1.0, 2.0]}", "shape (2,)"),
])  # fmt: skip
def test_a_bad_simulator_is_one_line_and_exit_2(text, word, tmp_path, capsys):
    write(flown().slice(0.0, 20.0), tmp_path / "a.csv")
    (tmp_path / "mine.py").write_text(text)
    assert _run(["diagnose", str(tmp_path / "a.csv"), "--simulator", str(tmp_path / "mine.py")]) == 2
    said = capsys.readouterr().err.strip()
    assert len(said.splitlines()) == 1
    assert word in said
