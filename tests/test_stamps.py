"""Stamps that jitter are told from samples that do, and only the stamps are evened."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from estimators.signals.data_checks import check
from estimators.signals.mending import MOTION
from estimators.signals.stamps import evenly_spaced, shown
from icing_env import scenario
from icing_env.record import FlightRecord
from sim2real.diagnosis import diagnose
from testbed.flight import fly


@cache
def flown(seed: int, instruments: str = "nasa_2002") -> FlightRecord:
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.5}, instruments=instruments)
    return fly(chosen, seed=seed, observer=False, protection=False).record


def jitter(record: FlightRecord, seed: int, size: float = 0.003) -> np.ndarray:
    return size * np.random.default_rng(seed).uniform(-1.0, 1.0, len(record))


def stamped(record: FlightRecord, off: np.ndarray) -> FlightRecord:
    """The samples as they were, with stamps that are off."""
    return replace(record, channels=record.channels | {"time": record.time + off})


def sampled(record: FlightRecord, off: np.ndarray, seed: int) -> FlightRecord:
    """Samples taken when their stamps say, each with noise of its own."""
    rng, perfect = np.random.default_rng(seed), flown(seed, "perfect")
    noise = {n: np.std(np.diff(record[n], 3)) / np.sqrt(20.0) for n in MOTION}
    at = record.time + off
    taken = {n: CubicSpline(perfect.time, perfect[n])(at) + noise[n] * rng.standard_normal(len(at)) for n in MOTION}
    return replace(record, channels=record.channels | {"time": at} | taken)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_samples_show_of_the_jitter_tells_whose_it_is(seed: int):
    record, step = flown(seed), flown(seed).dt
    off = jitter(record, seed)
    share, error = shown(stamped(record, off), off, step)
    assert abs(share) < 4.0 * error < 0.8
    share, error = shown(sampled(record, off, seed), off, step)
    assert abs(share - 1.0) < 4.0 * error < 0.8


def test_stamps_that_jitter_are_evened_and_said_to():
    record = flown(1)
    told = check(stamped(record, jitter(record, 1)))
    np.testing.assert_allclose(told.time, record.time, atol=4e-4)
    np.testing.assert_array_equal(told["q"], check(record)["q"])
    assert [p.channel for p in told.problems if "samples do not, taken as evenly spaced" in p.kind] == ["time"]
    assert not [p for p in told.problems if "irregular" in p.kind]


def test_samples_that_jitter_and_records_with_gaps_keep_their_stamps():
    record = flown(1)
    for kept in (sampled(record, jitter(record, 1), 1), record.take(np.r_[0:500, 520 : len(record)]), record):
        assert evenly_spaced(kept) is kept


@pytest.mark.slow
def test_a_clean_aircraft_with_a_bad_clock_is_not_blamed():
    found = diagnose([stamped(flown(seed), jitter(flown(seed), seed)) for seed in (1, 2, 3)])
    assert found.verdict == "no_gap"
