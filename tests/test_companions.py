"""What is flown beside the best single effect."""

from __future__ import annotations

import numpy as np

from icing_env.record import read
from sim2real.diagnosis import diagnose
from testbed.withheld.conditions import Conditions
from testbed.withheld.files import record_text, side_text
from testbed.withheld.flights import Aircraft, recorded
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS


def test_what_a_path_tells_is_tried_though_nothing_is_left_of_the_flight(tmp_path):
    """Ice left nothing that any generic term would take, and engines that spool up slowly beside it were not asked."""
    aircraft = Aircraft(parts=(("spool_lag", "same", 0.75), ("wing_ice", "same", 0.17)))
    for i, manoeuvre in enumerate(PLANS[2][:DIAGNOSED]):
        flight, seen = recorded(aircraft, manoeuvre, 1.0, Conditions(0.0, 1.0, 1.0), np.random.default_rng([12, i]))
        (tmp_path / f"{i}.csv").write_text(record_text(seen, flight.commands))
        (tmp_path / f"{i}.toml").write_text(side_text("x", "diagnose"))
    found = diagnose([read(tmp_path / f"{i}.csv") for i in range(DIAGNOSED)])
    assert found.hypotheses[0]["effects"] == ["spool_lag", "wing_ice"]
