"""Drawn encounters: what is drawn, what is scored, and that protection is worth what the benchmark says."""

from __future__ import annotations

import numpy as np
import pytest

from icing_env.severity import iced_aircraft
from icing_env.types import CURRENT, STATE
from testbed.benchmarks import encounters
from testbed.benchmarks.protection import row, tables
from testbed.oracle import zero_lift_drag


def test_seeds_of_development_and_report_are_apart():
    sets = [set(encounters.seeds_of(name, purpose, 1000)) for name in encounters.ENCOUNTERS
            for purpose in encounters.SEEDS]
    assert len(set().union(*sets)) == sum(len(s) for s in sets)


def test_the_common_ice_brings_the_drawn_drag_and_no_more_than_the_most():
    scenario = encounters.encounter("stratiform")
    p = scenario.true_parameters()
    drags = []
    for seed in range(200):
        s, c = np.zeros(1, STATE), np.zeros(1, CURRENT)
        for surface, value in encounters.severities(scenario, seed).items():
            s[f"eta_{surface}"] = value
        iced_aircraft(s[0], p[0], c[0])
        drags.append(float(zero_lift_drag(c[0]) + c["CD_parasite"][0] - zero_lift_drag(p[0])))
    assert max(drags) == pytest.approx(encounters.EXCESS_DRAG, rel=0.06)
    assert np.mean(drags) == pytest.approx(0.5*encounters.EXCESS_DRAG, rel=0.1) and min(drags) >= 0.0


def test_hazards_of_a_scenario_stay_and_clear_air_is_clear():
    scenario = encounters.encounter("approach_tail_ice")
    tails = [encounters.severities(scenario, seed)["htail"] for seed in range(100)]
    assert min(tails) >= 0.08
    assert encounters.severities(encounters.encounter("clear_air"), 1) == {}


@pytest.mark.parametrize("shield", ["surfaces", "predictive", "barrier"])
def test_a_full_stick_loses_the_unprotected_aircraft_and_not_the_protected(shield):
    seeds = encounters.seeds_of("full_stick", "development", 8)
    free = encounters.fly(encounters.world_of("full_stick", 8, 72.0, management=False, protection=False), seeds)
    held = encounters.fly(encounters.world_of("full_stick", 8, 72.0, shield=shield), seeds)
    assert (free.stalled | free.departed).all() and not (held.stalled | held.departed).any()
    assert (free.moved == 0).all() and (held.moved > 5.0).all()
    assert (free.beyond > held.beyond).all() and np.array_equal(free.drawn["htail"], held.drawn["htail"])


def test_a_row_has_shares_with_intervals_and_a_table():
    found = row("clear_air", "surfaces", 3, "development")
    assert found["stalled"]["mean"] == 0.0 and found["stalled"]["high95"] == pytest.approx(0.5615, abs=1e-3)  # Wilson
    assert found["interventions"]["mean"] == 0.0
    shown = tables({"encounters": 3, "seeds": "development", "rows": [found], "filter_us": {},
                    "steps_per_s": {"observed": 1.0, "controlled": 1.0, "ratio": 1.0}})
    assert shown[0][2][0][:2] == ["clear_air", "surfaces"]


def lost(name, logic, blind, n, duration, **options):
    """Share of encounters that depart when the ice management knows too little, with and without upset logic."""
    world = encounters.world_of(name, n, duration, boots=False, **options)
    tuning = world.loop.management_tuning
    for key in blind:
        tuning[key] = 9.0
    if not logic:
        tuning["upset_share"], tuning["roll_strange"], tuning["tail_near"] = 9.0, 99.0, -9.0
    return float(encounters.fly(world, encounters.seeds_of(name, "development", n)).departed.mean())


def test_a_tailplane_stall_that_nobody_expected_is_recovered():
    blind = ("tail_severity", "tail_loss")  # full flap is allowed, whatever the tail carries
    assert lost("approach_tail_ice", False, blind, 12, 70.0) > 0.5
    assert lost("approach_tail_ice", True, blind, 12, 70.0) == 0.0


def test_a_roll_upset_of_an_aircraft_believed_clean_is_recovered():
    without, logic = (lost("holding_asymmetric", logic, (), 64, 120.0, observer=False) for logic in (False, True))
    assert logic < without - 0.03 and logic < 0.02
