"""Paths and flights say nothing of one another, and no member of a set explains more than the set would miss."""

from __future__ import annotations

from dataclasses import replace

import pytest

from icing_env import effects
from sim2real.library.candidates import FEW, NODES, at_few_sizes, bank
from sim2real.posterior.devices import apart, together, within
from sim2real.posterior.forgiveness import _in_company, _leaking, elsewhere
from sim2real.posterior.form import Form, Liberty, energies
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.posterior.sets import SetFit

WHOLE = bank()


def one(*names: str) -> SetFit:
    return SetFit(tuple(next(f for f in WHOLE.families if f.effect.name == name) for name in names))


def test_only_actuators_and_the_spool_are_apart():
    told = {name for name, effect in effects.LIBRARY.items() if name != "turbulence" and apart(effect)}
    surfaces = {f"{s}_{what}" for s in ("elevator", "aileron", "rudder") for what in ("lag", "gearing")}
    assert told == surfaces | {"elevator_offset", "elevator_rate_limit", "spool_lag"}


@pytest.mark.parametrize(("first", "second", "place"), [("rudder_lag", "early_stall", "z_force"),
                                                        ("early_stall", "rudder_lag", "rudder_path")])
def test_what_a_path_leaves_is_no_second_gap_in_flight(first, second, place):
    """Nor the other way round; within flight it may be."""
    regained = 500.0
    beside = UnknownFit(place, 0.0, (("1", 1.0, 0.1),), 0.0, {})
    found = [Hypothesis(one(first), None, -5.0, 100.0, regained=regained),
             Hypothesis(one(first, second), None, -10.0, 140.0, regained=regained),
             Hypothesis(one(first), beside, -9.0, 140.0),
             Hypothesis(one("wing_ice"), None, -5.0, 100.0, regained=regained),
             Hypothesis(one("fin_ice", "wing_ice"), None, -10.0, 140.0)]  # fmt: skip
    less = [before.log_posterior - after.log_posterior
            for before, after in zip(found, _leaking(found, 0.0), strict=True)]
    assert less == pytest.approx([0.0, 0.0, 0.0, 0.0, elsewhere(regained, 0.0)])


def test_a_device_is_what_two_faults_share():
    assert within("elevator_gearing", ["elevator_lag"]) and not within("elevator_gearing", ["rudder_lag"])


def test_a_member_that_a_set_would_not_miss_explains_nothing():
    assert energies([400.0, 300.0], 500.0) == pytest.approx([400.0 * 5 / 7, 300.0 * 5 / 7])
    assert energies([400.0, 300.0], 500.0, [float("inf"), 2.0]) == pytest.approx([400.0, 2.0])
    assert energies([40.0, 30.0], 500.0, [450.0, 50.0]) == pytest.approx([450.0, 50.0])  # flown, not as the bank has it
    assert energies([4e3, 3e3], 500.0, [3e3, 2e3]) == pytest.approx([300.0, 200.0])  # they cancel each other
    assert energies([400.0], 500.0, [1.0]) == [500.0]  # one alone has nothing to be without


def test_few_sizes_are_the_typical_ones():
    few = at_few_sizes(WHOLE, ("wing_ice",))
    assert not few.terms and few.size == 1 + len(few.nuisances) + sum(len(f.nodes) for f in few.families)
    assert {f.effect.name for f in few.families} == {f.effect.name for f in WHOLE.families} - {"wing_ice"}
    rows = [row for f in few.families for row in f.rows]
    assert rows == list(range(1 + len(few.nuisances), few.size))
    for family in few.families:
        assert 1 <= len(family.nodes) <= FEW
        p = family.parameter
        assert p.typical == 0.0 or min(abs(size - p.typical) for size in family.nodes) < 0.1 * (p.high - p.low)
    assert max(len(f.nodes) for f in WHOLE.families) == NODES
    assert replace(few, families=()).linear == tuple(range(1, 1 + len(few.nuisances)))


def test_members_on_paths_and_in_flight_do_not_crowd_one_another():
    assert together(["wing_ice"]) == 1
    assert together(["aileron_gearing", "vane_position"]) == 1
    assert together(["aileron_gearing", "rudder_lag", "wing_ice"]) == 1
    assert together(["aileron_gearing", "aileron_lag"]) == 2
    assert together(["fin_ice", "wing_ice", "rudder_lag"]) == 2


def test_an_idle_companion_regains_nothing_by_the_other_s_form():
    """Terms are a little off wherever a set was flown; what the companion explains gives the pair its reason."""
    free, other = Liberty(beyond=1000.0), Liberty(beyond=1e4)

    def pair(misfit: float, beyond: float) -> float:
        found = [Hypothesis(replace(one("rudder_lag"), misfit=1e4), None, -5.0, 100.0, Form((0.0,), (0.0,), (free,)),
                            regained=500.0),
                 Hypothesis(replace(one("rudder_lag", "mass_error"), misfit=misfit), None, -10.0, 101.0,
                            Form((0.0,), (0.0,), (Liberty(beyond=beyond), other)), regained=530.0)]  # fmt: skip
        return _in_company(found)[1].regained

    assert pair(9998.0, 998.0) == 500.0
    assert pair(9998.0, 940.0) == 530.0  # beside a free course it shows
    assert 500.0 < pair(9990.0, 988.0) < 510.0
