"""What is flown beside the best single effect."""

from __future__ import annotations

from generated import in_still_air

from sim2real.diagnosis import diagnose
from testbed.withheld.flights import Aircraft


def test_what_a_path_tells_is_tried_though_nothing_is_left_of_the_flight(tmp_path):
    """Ice left nothing that any generic term would take, and engines that spool up slowly beside it were not asked."""
    aircraft = Aircraft(parts=(("spool_lag", "same", 0.75), ("wing_ice", "same", 0.17)))
    found = diagnose(in_still_air(tmp_path, "diagnose", aircraft, 12, gain=1.0))
    assert found.hypotheses[0]["effects"] == ["spool_lag", "wing_ice"]
