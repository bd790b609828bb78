"""Engine channels that come late: told by when thrust acts, and taken earlier."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from icing_env import scenario
from icing_env.record import FlightRecord
from sim2real.diagnosis import _reconstructed
from sim2real.records.channels import MEASURED
from sim2real.records.late_power import lateness_of_power
from sim2real.records.reconstruct import reconstruct
from testbed.flight import fly

ENGINES = ("thrust_left", "thrust_right", "torque_left", "torque_right")


def flown(sigma: float) -> FlightRecord:
    """Levers that the autothrottle moves: hardly, in still air."""
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": sigma})
    return fly(chosen, seed=2, observer=False, protection=False).record


@pytest.fixture(scope="module")
def record() -> FlightRecord:
    return flown(1.0)


def late(record: FlightRecord, by: float) -> FlightRecord:
    """The same record, its engines' channels shown `by` seconds late."""
    moved = {}
    for name in ENGINES:
        good = np.isfinite(record[name])
        moved[name] = record[name].copy()
        moved[name][good] = np.interp(record.time[good] - by, record.time[good], record[name][good])
    return replace(record, channels={**record.channels, **moved})


@pytest.mark.parametrize("by", [0.1, 0.2])
def test_lateness_is_told(record, by):
    before, error = lateness_of_power([reconstruct(record)])
    found, _ = lateness_of_power([reconstruct(late(record, by))])
    assert abs(before) < max(3.0 * error, 0.03)
    assert found - before == pytest.approx(by, abs=0.25 * by)


def test_powers_are_taken_when_the_thrust_acted(record):
    (as_it_was,), (mended,) = (_reconstructed([one], None, None) for one in (record, late(record, 0.2)))
    assert not any("earlier" in note for note in as_it_was.notes)
    assert any("engine channels taken 0.2" in note or "engine channels taken 0.1" in note for note in mended.notes)
    inside = slice(100, -100)
    for side in ("left", "right"):
        true, told = (flight.controls[f"power_{side}"][inside] for flight in (as_it_was, mended))
        unmended = reconstruct(late(record, 0.2)).controls[f"power_{side}"][inside]
        assert np.std(told - true) < 0.4 * np.std(unmended - true)
        column = MEASURED.index(f"thrust_{side}")
        kept = np.isfinite(as_it_was.measured[:, column])
        np.testing.assert_array_equal(np.isfinite(mended.measured[:, column]), kept)


def test_levers_that_hardly_move_tell_nothing():
    still = flown(0.0)
    assert lateness_of_power([reconstruct(still)])[1] > 0.1
    (flight,) = _reconstructed([late(still, 0.2)], None, None)
    assert not any("earlier" in note for note in flight.notes)


def test_power_that_no_engine_channel_told_is_left_alone(record):
    bare = replace(record, channels={n: v for n, v in record.channels.items() if n not in ENGINES})
    assert lateness_of_power([reconstruct(bare)]) == (0.0, np.inf)
