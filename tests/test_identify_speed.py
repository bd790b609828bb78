"""What is timed does what it is timed for; how long it takes is no test."""

from __future__ import annotations

from estimators.methods import METHODS
from testbed.benchmarks.identify_speed import REAL_TIME, chain, flight, regress


def test_the_timed_record_is_longitudinal_and_twenty_seconds_long() -> None:
    record = flight()
    assert len(record) == 1000 and abs(record.dt - 0.02) < 1e-9
    assert not record.has("beta") and flight(lateral=True).has("beta")
    chain(record)


def test_what_is_timed_finds_derivatives_and_what_runs_in_flight_is_registered() -> None:
    assert regress(1, 0) > 15
    assert set(REAL_TIME) <= set(METHODS)
