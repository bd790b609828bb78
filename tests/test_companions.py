"""What is flown beside the best single effect."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from generated import in_still_air

from sim2real.diagnosis import diagnose
from sim2real.flown.refine import _Search
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.posterior.sets import SetFit
from testbed.withheld.flights import Aircraft


@pytest.mark.slow
def test_what_a_path_tells_is_tried_though_nothing_is_left_of_the_flight(tmp_path):
    """Ice left nothing that any generic term would take, and engines that spool up slowly beside it were not asked."""
    aircraft = Aircraft(parts=(("spool_lag", "same", 0.75), ("wing_ice", "same", 0.17)))
    found = diagnose(in_still_air(tmp_path, "diagnose", aircraft, 12, gain=1.0))
    assert found.hypotheses[0]["effects"] == ["spool_lag", "wing_ice"]


@pytest.mark.parametrize(("held", "beside"), [((3, 2, 1), [0, 2, 1]), ((3, 0, 1), [0, 2]), ((3, 2, 0), [0, 2])])
def test_the_second_best_has_companions_where_neither_is_all(held: tuple[int, ...], beside: list[int]) -> None:
    """A weaker engine in an aircraft of less inertia was a scale of airspeed beside it: that alone was ahead."""
    found = [Hypothesis(SetFit(), None, 0.0, evidence) for evidence in (5.0, 8.0, 9.0, 1.0)]
    points = {i: SimpleNamespace(held=np.arange(n)) for i, n in enumerate(held)}
    search = SimpleNamespace(_ranked=lambda effects: [0, 1, 2], found=found, points=points, _companions=lambda i: [i])
    assert _Search.companions(search) == beside  # the best with what is forgiven it, then as they are
