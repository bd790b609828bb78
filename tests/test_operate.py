"""Operating the ice protection: inflations that pay, no thrash, heat by water and cold, whoever holds the switches."""

from __future__ import annotations

import numpy as np
import pytest
from controlled import airframe, believed, cruise

from controllers import ice_management
from icing_env import scenario
from icing_env.types import TARGET
from testbed.benchmarks.ice_protection import fly
from testbed.flight import make_world

DT = 0.5
TUNING = ice_management.load_tuning()
THICK = float(TUNING["boot_thickness"][0])


def flown(seconds, water=3e-4, severity=0.5, celsius=-8.0, advisory=None, **told):
    """Switches [steps, 4] of an ice management that believes in this ice and measures this water."""
    a = ice_management.init(1) if advisory is None else advisory
    m, e = cruise(), believed(severity=severity)
    m["temperature"], m["lwc"] = 273.15 + celsius, water
    log = []
    for _ in range(round(seconds/DT)):
        for name, value in told.items():
            a[name] = value
        ice_management.step(a, e, m, airframe(), TUNING, DT)
        log.append([a[name][0] for name in ("boots_wing", "boots_tail", "boots_vtail_struts", "prop_heat")])
    return np.array(log), a


def inflations(switch):
    """Times of rising edges [s]."""
    return DT*np.flatnonzero((switch[1:] > 0.5) & (switch[:-1] < 0.5))


def test_more_water_inflates_more_often_but_never_sooner_than_the_shortest_interval():
    counts = []
    for water in (1e-4, 3e-4, 6e-4, 2e-3):
        at = inflations(flown(900, water)[0][:, 0])
        assert (np.diff(at) >= TUNING["boot_interval"][0] - DT).all()
        counts.append(len(at))
    assert counts == sorted(counts) and counts[0] < counts[-1] <= 900/TUNING["boot_interval"][0] + 1


def test_each_later_inflation_has_a_thickness_worth_it():
    m, a = cruise(), ice_management.init(1)
    m["temperature"], m["lwc"] = 265.0, 3e-4
    before, seen = 0.0, []
    for _ in range(1800):
        ice_management.step(a, believed(severity=0.5), m, airframe(), TUNING, DT)
        if a["shot_wing"][0] == DT:
            seen.append(before)
        before = float(a["collected_wing"][0])
    assert len(seen) > 2 and min(seen[1:]) > 0.95*THICK


def test_without_water_the_residual_is_left_alone_and_told_ice_is_not():
    assert len(inflations(flown(800, water=0.0)[0][:, 0])) == 1  # what was there at detection, once
    told, _ = flown(800, water=0.0, severity_left_wing=0.15)
    assert len(inflations(told[:, 0])) == 5 and len(inflations(told[:, 1])) == 1  # wing ice only: wing boots only
    blind, _ = flown(800, water=np.nan)
    assert len(inflations(blind[:, 0])) == 5  # a probe that says nothing: by the clock


def test_no_thrash_when_detection_flickers():
    a, edges = ice_management.init(1), 0
    for k in range(40):
        log, a = flown(20, severity=0.5 if k % 2 else 0.0, advisory=a)
        edges += len(inflations(log[:, 0]))
    assert edges <= 800/TUNING["boot_interval"][0]


def test_heat_goes_by_water_and_cold_and_ends():
    share = [flown(480, celsius=c)[0][:, 3].mean() for c in (-2.0, -15.0)]
    assert 0.4 < share[0] < share[1] < 0.8
    assert flown(480, celsius=6.0)[0][:, 3].max() == 0
    _, a = flown(240)
    log, _ = flown(600, water=0.0, advisory=a)
    assert log[-100:, 3].max() == 0 and log[:60, 3].max() == 1


def test_clear_air_switches_nothing():
    assert flown(600, water=0.0, severity=0.0)[0].max() == 0


def test_the_crew_keeps_its_switches():
    iced = scenario.load("stratiform", duration=30.0, ice_protection="off")
    world = make_world(iced, 2)
    world.reset(seeds=[1, 2], initial={"eta": {"left_wing": 0.1, "right_wing": 0.1, "other": 0.1, "struts": 0.1}})
    for _ in range(1500):
        world.step()
    assert (world.loop.advisory["shot_wing"] > 0).all()  # advised
    assert (world.fleet.state["boot_cycles"] == 0).all()  # not done


def test_managed_carries_less_ice_than_boots_on_while_detected_and_heats_less():
    managed, simple, none = (
        fly("cumuliform", way, 4, 600.0) for way in ("managed, drag sensed", "on while detected", "none"))
    assert managed["ice_mass"] < simple["ice_mass"] < none["ice_mass"]
    assert managed["eta_wing"] < 1.05*simple["eta_wing"] < none["eta_wing"]
    assert managed["heat_energy"] < simple["heat_energy"]


@pytest.mark.parametrize(("lever", "climbing", "lacking"), [(0.6, 0.0, 0), (1.0, 0.0, 1), (1.0, 0.06, 0)])
def test_power_is_lacking_where_level_flight_takes_nearly_all(lever, climbing, lacking):
    m, a = cruise(), ice_management.init(1)
    m["throttle_left"] = m["throttle_right"] = lever
    m["theta"] += climbing
    m["ax"] = 9.81*np.sin(m["theta"])  # steady
    m["thrust_left"] = m["thrust_right"] = 4000.0
    for _ in range(120):
        ice_management.judge_power(a, m, np.zeros(1, TARGET), airframe(), TUNING, DT)
    assert a["power_lacking"][0] == lacking


def test_power_is_judged_at_the_speed_asked_for():
    m, asked = cruise(3), np.zeros(3, TARGET)  # level and steady at 65 m/s, asked for 65, 72, and for no speed
    m["airspeed"], m["throttle_left"], m["throttle_right"] = 65.0, 0.83, 0.83
    m["thrust_left"] = m["thrust_right"] = 3300.0
    m["ax"] = 9.80665*np.sin(m["theta"])
    asked["speed_mode"], asked["airspeed"] = (1, 1, 0), (65.0, 72.0, 72.0)
    a = ice_management.init(3)
    for _ in range(120):
        ice_management.judge_power(a, m, asked, airframe(), TUNING, DT)
    assert a["power_share"] == pytest.approx([0.83, a["power_share"][1], 0.83], abs=0.001)
    assert a["power_lacking"].tolist() == [0, 1, 0]
    # parasite drag grows with V^2, that of lift falls with it, and a propeller's thrust falls with V
    assert 0.83*(72.0/65.0)**1.0 < a["power_share"][1] < 0.83*(72.0/65.0)**3.0


def test_power_that_lacks_at_the_start_is_told_within_seconds():
    m, a = cruise(), ice_management.init(1)
    m["throttle_left"] = m["throttle_right"] = 1.0
    m["thrust_left"] = m["thrust_right"] = 3900.0
    m["ax"] = 9.80665*np.sin(m["theta"])
    for _ in range(400):
        m["time"] += 0.02
        ice_management.judge_power(a, m, np.zeros(1, TARGET), airframe(), TUNING, 0.02)
    assert a["power_lacking"][0] == 1
