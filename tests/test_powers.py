"""What drives the model where engines were not recorded: levers behind the spool, or what the acceleration asks for."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import aircraft, scenario
from icing_env.record import FlightRecord
from sim2real.diagnosis import diagnose
from sim2real.library.candidates import bank, not_testable
from sim2real.library.terms import pushes
from sim2real.records.channels import MEASURED
from sim2real.records.powers import powers
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
