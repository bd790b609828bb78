"""Those who tell the ice management the ice: the oracle from the truth, the characteriser from what it sees."""

from __future__ import annotations

import numpy as np
import pytest

from icing_env import scenario
from icing_env.errors import InputError
from icing_env.types import SENSED_PARTS
from testbed.environments import loop_factory, make
from testbed.flight import make_world
from testbed.sensing import unlike

ICE = {"left_wing": 0.12, "right_wing": 0.2, "htail": 0.15, "vtail": 0.1, "other": 0.1}


def flown(who="autopilot", seconds=2.0, n=2, eta=None, seed=3, **options):
    case = scenario.load("clear_air", duration=max(seconds, 60.0), task={"kind": "hold"}, ice_protection="off",
                         parameters={"turbulence_sigma_w": 1.0, "temperature_offset": -15.0})
    world = make_world(case, n, who, **options)
    world.reset(seeds=[seed + i for i in range(n)], initial={"eta": ICE if eta is None else eta, "airspeed": 66.0})
    for _ in range(round(seconds/world.dt)):
        world.step()
    return world


def test_the_oracle_says_what_is_true():
    world = flown("oracle")
    a, e, f = world.loop.advisory, world.loop.estimate, world.fleet
    for part in SENSED_PARTS:
        assert a[f"severity_{part}"] == pytest.approx(f.state[f"eta_{part}"], abs=1e-3)
    assert e["Cl_aileron"] == pytest.approx(f.current["Cl_aileron"]) and (a["ice_detected"] == 1).all()
    assert (e["Cm_elevator"] > -1.6).all() and (e["excess_drag"] > 0.02).all() and (a["confidence"] > 0.9).all()
    clear = flown("oracle", eta={}).loop
    assert (clear.advisory["ice_detected"] == 0).all() and clear.estimate["excess_drag"] == pytest.approx(0, abs=1e-9)


def test_an_oracle_that_was_shown_nothing_says_so():
    from icing_env.world import World

    world = World(scenario.load("clear_air"), 1, loop_factory(estimator="oracle"))
    with pytest.raises(InputError, match="reveal"):
        world.reset(seeds=[0])
    env = make(scenario="clear_air", estimator="oracle", mode="targets")
    env.reset(seed=0)  # the registered environments show it


def test_the_characteriser_tells_wing_from_wing_and_is_silent_in_clear_air():
    iced = flown(seconds=40.0, n=4, sense="characterise").loop.advisory
    assert (iced["told"] == 1).all() and (iced["ice_detected"] == 1).all()
    assert (iced["severity_right_wing"] > iced["severity_left_wing"]).all()
    assert iced["severity_left_wing"] == pytest.approx(0.12, abs=0.06)
    clear = flown(seconds=40.0, n=4, eta={}, sense="characterise").loop.advisory
    assert (clear["ice_detected"] == 0).all() and clear["severity"].max() < 0.1


def test_before_the_first_judgement_the_drag_speaks():
    a = flown(seconds=10.0, sense="characterise").loop.advisory
    assert (a["told"] == 0).all() and (a["severity"] > 0.3).all()


@pytest.mark.parametrize("who", ["adapted", "oracle"])
def test_a_flight_goes_on_where_it_was_saved(who):
    world = flown(who, 21.0)
    saved = world.save()
    for _ in range(120):
        world.step()
    state, told = world.fleet.state.copy(), world.loop.advisory.copy()
    world.restore(saved)
    for _ in range(120):
        world.step()
    assert world.fleet.state.tobytes() == state.tobytes() and world.loop.advisory.tobytes() == told.tobytes()


def test_a_row_that_begins_anew_forgets_and_leaves_the_others_alone():
    world = flown(seconds=20.0, n=2, sense="characterise")
    before = world.loop.informant.kept.evidence[1:].copy(), world.loop.advisory[1:].copy()
    world.reset(np.array([0]), seeds=[3])
    kept, advisory = world.loop.informant.kept, world.loop.advisory
    assert kept.evidence["age"][0] == 0 and advisory["told"][0] == 0
    assert kept.evidence[1:].tobytes() == before[0].tobytes() and advisory[1:].tobytes() == before[1].tobytes()


def test_a_reference_of_its_own_is_kept_over_episodes():
    from estimators.characterise.features import FEATURES

    world = flown(seconds=1.0)
    loop = loop_factory(sense="characterise", reference=np.full((1, len(FEATURES)), 0.5))(2, world.clean, 0.02)
    loop.informant.reset(np.array([1]))
    assert loop.informant.kept.referenced.all() and (loop.informant.kept.offset == 0.5).all()


def test_an_unknown_way_to_sense_is_refused():
    with pytest.raises(InputError, match="characterise"):
        make_world(scenario.load("clear_air"), sense="characterize")


@pytest.mark.parametrize(("left", "right", "tested", "failed"), [
    (0.08, 0.01, 2, (True, False)), (0.01, 0.08, 3, (False, True)), (0.08, 0.07, 5, (False, False)),
    (0.08, 0.01, 1, (False, False)), (0.04, 0.0, 5, (False, False)),
])
def test_a_half_wing_that_keeps_its_ice_while_the_other_loses_it_has_no_boot(left, right, tested, failed):
    found = unlike(np.array([[left, right]]), np.full((1, 2), 0.017), np.array([float(tested)]))
    assert tuple(found[0]) == failed


def test_a_failed_boot_is_told_and_working_ones_are_not():
    told = []
    for failed in (1.0, 0.0):
        case = scenario.load("stratiform", duration=400.0, parameters={
            "boot_failed_left_wing": failed, "turbulence_sigma_w": 1.0}, task={"kind": "hold"})
        world = make_world(case, 6, sense="characterise")
        world.reset(seeds=range(6), initial={"eta": {"left_wing": 0.1, "right_wing": 0.1, "htail": 0.08}})
        for _ in range(world.limit):
            world.step()
        told.append([float(world.loop.advisory[f"failed_{part}"].mean()) for part in SENSED_PARTS])
    assert told[0][0] > 0.4 and sum(told[0][1:]) == 0 and sum(told[1]) == 0
