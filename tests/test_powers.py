"""What drives the model where engines were not recorded: levers behind the spool, or what the acceleration asks for."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from icing_env import aircraft, scenario
from icing_env.errors import InputError
from icing_env.record import FlightRecord
from sim2real.diagnosis import diagnose
from sim2real.library.candidates import bank, not_testable
from sim2real.library.pushes import pushes
from sim2real.records.channels import MEASURED
from sim2real.records.powers import powers, spin_inertia, thrust_per_power
from sim2real.records.reconstruct import reconstruct
from testbed.flight import fly

ENGINES = ("thrust", "torque", "rpm")


@cache
def flown(sigma: float = 0.0) -> FlightRecord:
    """Doublets of all surfaces, levers moved by the autothrottle as speed wants it."""
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": sigma})
    return fly(chosen, seed=2, observer=False, protection=False).record


def without(record: FlightRecord, *names: str) -> FlightRecord:
    return replace(record, channels={n: v for n, v in record.channels.items() if not n.startswith(names)})


@pytest.mark.parametrize(("absent", "source", "within"), [
    (("torque", "rpm"), "thrust", 0.02), (ENGINES, "throttle", 0.02), ((*ENGINES, "throttle"), "balance", 0.1),
])  # fmt: skip
def test_powers_are_those_of_the_torque_whatever_they_are_told_by(absent, source, within):
    true = reconstruct(flown())
    assert true.power_from == "torque"
    flight = reconstruct(without(flown(), *absent))
    assert flight.power_from == source
    for side in ("left", "right"):
        power, told = true.controls[f"power_{side}"], flight.controls[f"power_{side}"]
        assert np.sqrt(np.mean((told - power) ** 2)) < within * np.mean(power)
    assert any("not recorded" in note for note in flight.notes)


def by_another_chart(source: str | None) -> FlightRecord:
    """A record whose owner's propeller pulls a fifth more at the same torque, and more so at low speed."""
    record = flown(0.5)
    share = 1.2 - 0.004 * (record["airspeed"] - np.nanmean(record["airspeed"]))
    sensors = {name: value for name, value in record.meta.sensors.items() if name != "thrust"}
    told = {} if source is None else {"thrust": {"source": source}}
    return replace(record, meta=replace(record.meta, sensors=sensors | told),
                   channels=record.channels | {f"torque_{s}": record[f"torque_{s}"] / share for s in ("left", "right")})


@pytest.mark.parametrize("source", [None, "computed"])
def test_thrust_that_its_owner_computed_drives_the_model_whatever_the_published_chart_makes_of_torque(source):
    flight = reconstruct(by_another_chart(source))
    record, per_power = flight.record, thrust_per_power(flight.parameters[0], flight.channel("airspeed"),
                                                        flight.channel("alpha"))
    assert flight.power_from == "thrust" and flight.shaft_powers
    recorded = np.isfinite(record["thrust_left"])
    there = np.interp(record.time[recorded] - record.time[0], flight.time, flight.controls["power_left"] * per_power)
    off = there / record["thrust_left"][recorded] - 1.0  # noise of 15 N and of airspeed, of which power has none
    assert abs(np.mean(off)) < 1e-3 and np.std(off) < 0.01
    assert any("1.20 of what the published chart makes of torque" in note for note in flight.notes)
    assert "spool_lag" not in not_testable([flight], bank())
    assert diagnose([record]).verdict == "no_gap"


@pytest.mark.slow
def test_thrust_that_was_measured_is_compared_with_what_the_torque_makes():
    flight = reconstruct(by_another_chart("measured"))
    assert flight.power_from == "torque" and flight.has("thrust_left")
    assert "thrust_loss" in diagnose([flight.record]).hypotheses[0]["effects"]


def test_the_source_of_thrust_is_one_of_two_words():
    with pytest.raises(InputError, match="must be measured or computed, got 'guessed'"):
        reconstruct(by_another_chart("guessed"))


def test_a_lever_that_steps_moves_the_power_through_the_spool():
    row, dt, n = aircraft.load(), 0.02, 500
    lever = np.where(np.arange(n) < 100, 0.4, 0.6)
    values = {"airspeed": np.full(n, 65.0), "alpha": np.zeros(n), "throttle_left": lever, "throttle_right": lever}
    _, found = powers(row, values, np.full(n, 2200.0), dt, [])
    share = (found["power_left"] - found["power_left"][0]) / (0.5 * found["power_left"][0])
    assert share[:100] == pytest.approx(0.0, abs=1e-12)
    since = dt * np.arange(1, n - 99)
    assert share[100:] == pytest.approx(1.0 - np.exp(-since / row["spool_time"][0]), abs=1e-9)


def test_what_the_axial_acceleration_stands_for_is_compared_and_tested_no_more():
    flight = reconstruct(without(flown(), *ENGINES, "throttle"))
    assert not flight.has("ax")
    assert np.isfinite(reconstruct(flown()).measured[:, MEASURED.index("ax")]).all()
    why = not_testable([flight], bank())
    for name in ("thrust_loss", "ice_drag", "drag_due_to_lift", "axial_accelerometer_bias"):
        assert "axial acceleration" in why[name]
    assert "asymmetric_thrust" not in why
    assert "ice_drag" not in not_testable([flight, reconstruct(flown())], bank())


@pytest.mark.slow
@pytest.mark.parametrize("absent", [ENGINES, (*ENGINES, "throttle")])
def test_a_clean_aircraft_without_engine_channels_is_not_blamed(absent):
    assert diagnose([without(flown(0.5), *absent)]).verdict == "no_gap"


@pytest.mark.parametrize("absent", [ENGINES, (*ENGINES, "throttle")])
def test_a_thrust_coefficient_made_of_what_it_would_explain_says_nothing(absent):
    """Levers tell of power by themselves; without them it is made of alpha and ax, and no discrepancy goes with it."""
    flight = reconstruct(without(flown(), *absent))
    (term,) = [t for t in bank().terms if (t.component, t.name) == ("sensor:alpha", "CT")]
    (push,) = pushes(flight, [term])
    assert np.any(push.series != 0.0) == (flight.power_from == "throttle")


def spun(inertia: float, noise: float) -> tuple[FlightRecord, np.ndarray]:
    """A record whose propellers speed up and down, and the power that each absorbs."""
    record = flown()
    t = record.time
    omega = 150.0 + 4.0 * np.sin(0.9 * t) + 2.0 * np.sin(0.31 * t)
    omega_dot = 3.6 * np.cos(0.9 * t) + 0.62 * np.cos(0.31 * t)
    absorbed = 2.5e5 + 4e4 * np.sin(0.4 * t)
    per_power = thrust_per_power(aircraft.load()[0], record["airspeed"], record["alpha"])
    rng, changed = np.random.default_rng(3), {}
    for side in ("left", "right"):
        changed[f"rpm_{side}"] = omega * 30.0 / np.pi
        changed[f"torque_{side}"] = (absorbed + inertia * omega * omega_dot) / omega
        changed[f"thrust_{side}"] = 1.04 * absorbed * per_power + noise * rng.standard_normal(len(t))
    return replace(record, channels=record.channels | changed), absorbed


@pytest.mark.parametrize("inertia", [8.0, 34.0])
def test_what_spins_a_propeller_up_does_not_pull(inertia):
    record, absorbed = spun(inertia, noise=20.0)
    flight = reconstruct(record)
    wrong = np.interp(flight.time, record.time - record.time[0],
                      record["torque_left"] * record["rpm_left"] * np.pi / 30.0 - absorbed)  # fmt: skip
    left = flight.controls["power_left"] - np.interp(flight.time, record.time - record.time[0], absorbed)
    inside = slice(50, -50)  # a line through the speed is lopsided at the ends
    assert np.std(left[inside]) < 0.15 * np.std(wrong[inside])
    assert any("propellers change their speed" in note for note in flight.notes)


def test_power_is_the_torques_where_thrust_says_nothing_of_the_propellers_speed():
    """Propellers without inertia, thrust that is noise, or thrust that was not recorded."""
    for record in (spun(0.0, 20.0)[0], spun(34.0, 5e3)[0], without(spun(34.0, 20.0)[0], "thrust")):
        flight = reconstruct(record)
        shaft = record["torque_left"] * record["rpm_left"] * np.pi / 30.0
        told = np.interp(flight.time, record.time - record.time[0], shaft)
        assert np.abs(flight.controls["power_left"] - told).max() < 1e-3 * told.max()
        assert not any("propellers" in note for note in flight.notes)


@settings(max_examples=30)
@given(inertia=st.floats(2.0, 80.0), k=st.floats(0.7, 1.3), constant=st.floats(-300.0, 300.0))
def test_a_propellers_inertia_is_that_of_the_thrust_it_costs(inertia, k, constant):
    t = np.arange(0.0, 40.0, 0.02)
    shaft, change = 3e5 + 6e4 * np.sin(0.5 * t), 900.0 * np.cos(0.9 * t)
    per_power = 0.82 / np.hypot(65.0 + np.sin(0.2 * t), 42.6)
    thrust = k * (shaft - inertia * change) * per_power + constant
    assert spin_inertia(thrust, shaft, change, per_power) == pytest.approx(inertia, rel=1e-6)
    assert spin_inertia(thrust + 2.0 * k * inertia * change * per_power, shaft, change, per_power) == 0.0  # less than 0
