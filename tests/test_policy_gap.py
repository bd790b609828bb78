"""Rankings of controllers before and after: the figures by hand, and short flights in which a gap turns pairs round."""

from __future__ import annotations

import numpy as np
import pytest

from icing_env.errors import InputError
from testbed import policy_gap
from testbed.policy_gap import correlation, flips, intervals, kendall, mmrv, rank, scenario_with, sentences

NAMES = ("a", "b", "c")


def test_ranks_by_hand():
    real = np.array([1.0, 2.0, 3.0, 4.0])
    assert correlation(real, real**3) == pytest.approx(1.0)
    assert correlation(real, -real) == pytest.approx(-1.0)
    assert correlation(real, np.array([2.0, 1.0, 3.0, 4.0])) == pytest.approx(1.0 - 6.0*2.0/(4.0*15.0))
    assert kendall(real, np.array([2.0, 1.0, 3.0, 4.0])) == pytest.approx((5.0 - 1.0)/6.0)
    assert correlation(real, np.zeros(4)) is None


def test_maximum_rank_violation_by_hand():
    real = np.array([1.0, 2.0, 5.0])
    assert mmrv(real, np.array([10.0, 20.0, 21.0])) == 0.0
    # b and c change places: each may be believed better than the other at a cost of 3, a is in its place
    assert mmrv(real, np.array([1.0, 7.0, 6.0])) == pytest.approx((0.0 + 3.0 + 3.0)/3.0)


def test_a_pair_turns_round_only_beyond_chance():
    rng = np.random.default_rng(0)
    gusts = rng.standard_normal(30)  # common to all: they fly the same seeds
    noise = 0.1*rng.standard_normal((3, 30))
    real = gusts + np.array([[0.0], [1.0], [2.0]]) + noise
    assert flips(NAMES, real, real + 5.0) == []
    turned = gusts + np.array([[1.0], [0.0], [2.0]]) + noise
    assert flips(NAMES, real, turned) == [["a", "b"]]
    alike = gusts + noise - noise[[1, 0, 2]]*1e-3
    assert flips(NAMES[:2], alike[:2], alike[[1, 0]]) == []


def test_sizes_are_drawn_within_their_interval_where_one_is_given():
    drawn = scenario_with({"elevator_lag": {"extra": (0.1, 0.2)}, "wing_ice": {"eta": 0.1}})
    assert drawn.effects == {"wing_ice": {"eta": 0.1}}
    assert drawn.randomise.effects["elevator_lag"]["extra"].high == 0.2


def test_the_leading_explanation_is_what_flies():
    found = {"verdict": "explained", "hypotheses": [{"effects": ["wing_ice"]}],
             "effects": [{"name": "wing_ice", "parameters": {"eta": {"estimate": 0.1, "low95": 0.08, "high95": 0.12}}},
                         {"name": "mass_error", "parameters": {}}]}
    assert intervals(found) == ({"wing_ice": {"eta": (0.08, 0.12)}}, {"wing_ice": {"eta": 0.1}})
    assert intervals(found | {"verdict": "no_gap"}) == ({}, {})


def test_knowing_the_effect_puts_the_ranking_right():
    true = {"elevator_lag": {"extra": 0.25}}
    found = rank(true, true, ("autopilot", "h_infinity", "lqg", "pilot"), 4, duration=30.0)
    for name, figure in found["figures"].items():
        assert figure["rank_after"]["mmrv"] == 0.0, name
        assert figure["rank_after"]["flips"] == [], name
        assert figure["aircraft"] == figure["after"] != figure["before"] or name == "losses"
    activity = found["figures"]["elevator_activity"]
    assert activity["rank_after"]["spearman"] == pytest.approx(1.0)
    assert activity["rank_before"]["spearman"] < 1.0
    assert activity["rank_before"]["flips"]
    assert "wrong order" in sentences(found)[0]


def test_nothing_added_ranks_as_before():
    found = rank({"pitch_gyro_bias": {"offset": 0.01}}, {}, ("autopilot", "sis", "lqg"), 2, duration=4.0)
    for figure in found["figures"].values():
        assert figure["before"] == figure["after"]
        assert figure["rank_before"] == figure["rank_after"]


@pytest.mark.parametrize(("who", "episodes", "word"), [
    (("autopilot", "lqr"), 4, "3 controllers"), (("autopilot", "lqr", "lqg"), 1, "2 episodes"),
    (("autopilot", "lqr", "autopilott"), 2, "did you mean 'autopilot'"),
])  # fmt: skip
def test_what_cannot_be_ranked_is_refused(who, episodes, word):
    with pytest.raises(InputError, match=word):
        policy_gap.rank({}, {}, who, episodes)
