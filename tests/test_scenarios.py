"""Scenarios: every file loads and flies, what it prescribes happens, mistakes are told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from icing_env import scenario
from icing_env.errors import InputError
from icing_env.types import SURFACES
from icing_env.world import World
from testbed.flight import make_world

NAMES = scenario.names()


def test_the_scenarios_that_are_relied_on_exist():
    assert {"clear_air", "flight_010302f1"} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_a_scenario_flies_in_a_batch(name):
    flown = scenario.load(name)
    assert flown.name == name and flown.description
    world = make_world(flown, 3)
    world.reset(seeds=[1, 2, 3])
    for _ in range(250):
        world.step()
        assert np.isfinite(world.observation).all()
    f = world.fleet
    for array in (f.measurement, f.state, f.current, world.loop.estimate, world.loop.advisory):
        names = [n for n in array.dtype.names if array.dtype[n] == np.float64]
        assert all(np.isfinite(array[n]).all() for n in names)
    assert not world.terminated.any()
    assert len(set(f.measurement["alpha"])) == 3 or flown.true_parameters()["turbulence_sigma_w"][0] == 0.0


@pytest.mark.parametrize(("text", "named"), [
    ('name = "x"\ncloudd = 1\n', "cloud"),
    ('name = "x"\n[initial]\nairsped = 70.0\n', "airspeed"),
    ('name = "x"\n[parameters]\nturbulence_sigma = 1.0\n', "turbulence_sigma_w"),
    ('name = "x"\n[[events]]\ntime = 1.0\nboot = ["wing"]\n', "boots"),
    ('name = "x"\n[randomise.eta]\nleft_wings = { low = 0.0, high = 0.1 }\n', "left_wing"),
])  # fmt: skip
def test_an_unknown_key_names_the_nearest(tmp_path: Path, text: str, named: str):
    path = tmp_path / "x.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=named):
        scenario.load(path)


def test_an_unknown_scenario_names_the_nearest():
    with pytest.raises(InputError, match="stratiform"):
        scenario.load("stratifrom")


def schedule(*events: dict, cloud: tuple = ()) -> World:
    world = World(scenario.load("clear_air", duration=60.0, ice_protection="schedule", events=events, cloud=cloud,
                                initial={"eta": dict.fromkeys(SURFACES, 0.05)}), 2)
    world.reset(seeds=[0, 1])
    return world


def test_each_scheduled_shot_fires_once_and_only_its_boots():
    world = schedule({"time": 2.0, "boots": ["wing"]}, {"time": 5.0, "boots": ["tail"]},
                     {"time": 8.0, "boots": ["wing", "tail", "vtail_struts"]})
    before = world.fleet.state["eta_left_wing"].copy(), world.fleet.state["eta_htail"].copy()
    for _ in range(200):
        world.step()
    assert (world.fleet.state["boot_cycles"] == 1.0).all()
    assert (world.fleet.state["eta_left_wing"] < 0.6*before[0]).all()
    assert (world.fleet.state["eta_htail"] > 0.99*before[1]).all()
    for _ in range(400):
        world.step()
    assert (world.fleet.state["boot_cycles"] == 5.0).all()


def test_propeller_heat_stays_as_switched():
    world = schedule({"time": 1.0, "prop_heat": True}, {"time": 3.0, "prop_heat": False})
    on = []
    for _ in range(250):
        world.step()
        on.append(float(world.fleet.command["prop_heat"][0]))
    assert on[40] == 0.0 and on[60] == on[140] == 1.0 and on[160] == 0.0


def test_a_prescribed_cloud_is_met_at_its_time():
    clear = {"lwc": 0.0, "mvd": 0.0, "temperature": 268.15}
    world = schedule(cloud=({"time": 0.0, **clear}, {"time": 2.0, "lwc": 4e-4, "mvd": 2e-5, "temperature": 266.0},
                            {"time": 4.0, **clear}))
    met = []
    for _ in range(300):
        world.step()
        met.append((world.fleet.state["lwc"][0], world.fleet.state["temperature"][1]))
    assert met[40] == (0.0, 268.15) and met[120] == (4e-4, 266.0) and met[250] == (0.0, 268.15)


def test_a_flight_that_starts_with_ice_has_its_thickness_and_mass():
    """Severity 0.073 belongs to 3.4 mm (20 min of the calibration's cloud); 0.05 to about two thirds of it."""
    world = schedule()
    s = world.fleet.state
    assert 0.002 < s["thickness_left_wing"][0] < 0.003
    assert (s["ice_mass_left_wing"] == s["ice_mass_right_wing"]).all() and (s["ice_mass_other"] > 0.0).all()


def test_flight_010302f1_follows_the_printed_clock():
    flown = scenario.load("flight_010302f1")
    clock = {e.name: 13.0 + (38.0 + e.time/60.0)/60.0 for e in flown.events if e.name}
    printed = {"above_cloud": "14:06", "second_encounter": "14:35", "third_encounter_1": "14:49",
               "third_encounter_2": "14:56", "third_encounter_3": "15:10"}
    for name, text in printed.items():
        hour, minute = text.split(":")
        assert abs(clock[name] - float(hour) - float(minute)/60.0) < 1e-9, name
    shots = [(e.time, e.boots) for e in flown.events if e.boots]
    assert [b for _, b in shots][1:4] == [("wing",), ("tail",), ("vtail_struts",)]
    first = next(p for p in flown.cloud if p.lwc > 0.0)
    assert (first.lwc, first.mvd) == (3.5e-4, 1.8e-5)
    assert clock["first_encounter"] - (13.0 + (38.0 + first.time/60.0)/60.0) == pytest.approx(20.0/60.0)
    assert all(p.temperature == 268.15 for p in flown.cloud)


def test_perfect_boots_are_a_scenario_of_their_own():
    perfect, plain = scenario.load("flight_010302f1_perfect_deicing"), scenario.load("flight_010302f1")
    assert perfect.events == plain.events and perfect.cloud == plain.cloud
    assert perfect.true_parameters()["boot_residual"][0] == 0.0 < plain.true_parameters()["boot_residual"][0]


def test_doublets_scale():
    small, large = (scenario.load("clear_air", doublet_scale=k).doublets() for k in (0.5, 1.0))
    assert [a.amplitude for a in small] == [0.5*b.amplitude for b in large]
