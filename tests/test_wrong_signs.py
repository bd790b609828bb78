"""Reversed signs and wrong units: named by the motion that they contradict, and no sound record refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from flights import flight_data, lateral, longitudinal, with_channel
from generated import written

from estimators.signals.data_checks import check
from estimators.signals.flow_checks import _check_ay_unit, _check_calm_side
from icing_env import scenario as scenarios
from icing_env.errors import InputError
from icing_env.record import FlightRecord, read
from testbed.flight import fly
from testbed.withheld import effects
from testbed.withheld.conditions import Conditions
from testbed.withheld.flights import Aircraft, recorded
from testbed.withheld.manoeuvres import PLANS


@pytest.mark.parametrize(
    ("name", "factor", "message"),
    [
        ("q", -1.0, "'q' .* has its sign reversed"),
        ("theta", -1.0, "has its sign reversed"),
        ("alpha", -1.0, "'alpha' has its sign reversed: lift falls as alpha rises"),
        ("az", -1.0, "'az' has its sign reversed"),
        ("az", 1 / 9.80665, "'az' looks like g"),
        ("alpha", 57.29578, "looks like degrees"),
        ("q", 57.29578, "degrees|not both in rad"),
        ("temperature", 0.03, "looks like Celsius"),
        ("pressure", 0.01, "looks like hPa"),
    ],
)
def test_wrong_signs_and_units_are_refused(name: str, factor: float, message: str) -> None:
    record = longitudinal(7)
    with pytest.raises(InputError, match=message):
        check(with_channel(record, name, record[name] * factor))


@pytest.mark.parametrize(("name", "message"), [("p", "sign reversed"), ("phi", "sign reversed")])
def test_reversed_roll_is_refused(name: str, message: str) -> None:
    record = lateral(8)
    with pytest.raises(InputError, match=message):
        check(with_channel(record, name, -record[name]))


@pytest.mark.parametrize("name", ["q", "alpha"])
def test_reversed_sign_in_a_recorded_flight_is_refused(name: str) -> None:
    record = read(flight_data("totter_demo_data.mat"))
    with pytest.raises(InputError, match="sign reversed"):
        check(with_channel(record, name, -record[name]))


@cache
def doublets(sigma: float, airspeed: float = 55.0) -> FlightRecord:
    """A simulated set of doublets in all three axes, in turbulence."""
    scenario = scenarios.load("clear_air", aircraft="twin_otter_flight", duration=57.0, doublet_scale=0.78,
                              parameters={"turbulence_sigma_w": sigma}, initial={"airspeed": airspeed})  # fmt: skip
    record = fly(scenario, seed=3, observer=False, protection=False).record
    return record.take(record.time >= 5.0)


@pytest.mark.parametrize("sigma", [0.0, 2.0])
@pytest.mark.parametrize(
    ("name", "factor", "message"),
    [
        ("alpha", -1.0, "'alpha' has its sign reversed"), ("beta", -1.0, "'beta'.? has its sign reversed"),
        ("ay", -1.0, "'ay' .*has its sign reversed"), ("r", -1.0, "'r' .*has its sign reversed"),
        ("psi", -1.0, "'psi'.? has its sign reversed"), ("ax", -1.0, "'ax' has its sign reversed"),
        ("elevator", -1.0, "'elevator' has its sign reversed: a positive one raises q"),
        ("aileron", -1.0, "'aileron' has its sign reversed"), ("rudder", -1.0, "'rudder' has its sign reversed"),
        ("airspeed", 1.9438, "'airspeed' looks like knots"), ("airspeed", 3.2808, "'airspeed' looks like ft/s"),
        ("ay", 1 / 9.80665, "'ay' looks like g"), ("r", 57.29578, "not both in rad|degrees per second"),
        ("beta", 57.29578, "'beta' looks like degrees"),
    ],
)  # fmt: skip
def test_the_motion_betrays_wrong_signs_and_units_in_turbulence_too(
    name: str, factor: float, message: str, sigma: float
) -> None:
    record = doublets(sigma)
    with pytest.raises(InputError, match=message):
        check(with_channel(record, name, record[name] * factor))


def test_without_ground_speed_the_turn_of_the_flow_betrays_the_unit_of_airspeed() -> None:
    record = doublets(0.0)
    alone = replace(record, channels={n: v for n, v in record.channels.items() if n != "ground_speed"})
    with pytest.raises(InputError, match="'airspeed' looks like knots: az turns the flow"):
        check(with_channel(alone, "airspeed", 1.9438 * record["airspeed"]))


@pytest.mark.parametrize("sigma", [0.0, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("airspeed", [55.0, 72.0])
def test_sound_records_in_turbulence_are_not_refused(sigma: float, airspeed: float) -> None:
    record = doublets(sigma, airspeed)
    check(record)
    for start in (8.0, 28.0):
        check(record.take((record.time >= start) & (record.time < start + 20.0)))


@pytest.mark.parametrize(("side", "unit"), [(0.3, "ft/s2"), (9.5, "g"), (0.42, ""), (1.0, "")])
def test_ay_is_blamed_only_where_its_factor_is_near_a_unit(side, unit):
    """0.42 is what a bank that errs, for the gyro's erection, made of a sound calm record."""
    if unit:
        with pytest.raises(InputError, match=unit):
            _check_calm_side("record", side, 1.0)
    else:
        _check_calm_side("record", side, 1.0)


@pytest.mark.parametrize("effect", ["fin_ice", "vane_position", "vane_lag"])
def test_a_late_vane_in_calm_air_does_not_bend_the_factor_of_ay(effect: str, tmp_path: Path) -> None:
    """Noise and a vane 20 ms late and more made factors of 0.4 to 0.7 of sound records, and one was called feet."""
    size = effects.BY_NAME[effect].typical * (1.0 if effect == "vane_lag" else 2.0)
    for plan, manoeuvre in enumerate((PLANS[0][0], PLANS[1][1])):
        rng = np.random.default_rng(plan)
        given = Conditions(0.0, 1.0, 1.5)
        flown, channels = recorded(Aircraft({}, [(effect, "same", size)]), manoeuvre, 1.0, given, rng)
        record = written(tmp_path / f"{plan}", channels, flown.commands)
        check(record)
        with pytest.raises(InputError, match="'ay' looks like ft/s2"):
            check(with_channel(record, "ay", record["ay"] / 0.3048))


@pytest.mark.parametrize(("share", "told"), [(0.004, "'beta' looks like degrees"), (0.0204, "'ay' looks like g"),
                                             (0.027, set()), (0.14, {"ay", "beta"}), (0.5, "'ay' looks like ft/s2")])
def test_a_side_force_that_lost_four_fifths_is_neither_confirmed_nor_taken_for_one_in_g(share, told):
    """Ice on the fin was refused as ay in g in two sealed sets, once with a weak side force beside it."""
    if isinstance(told, set):
        assert _check_ay_unit("record", share) == told
        return
    with pytest.raises(InputError, match=told):
        _check_ay_unit("record", share)
