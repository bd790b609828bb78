"""Channels recorded on few levels, or held between samples: they say less, and are no gap."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.signals.data_checks import check
from icing_env import scenario
from icing_env.record import FlightRecord
from sim2real.actuators.surfaces import placed
from sim2real.diagnosis import diagnose
from sim2real.records.channels import MEASURED, SURFACE_NOISE
from sim2real.records.reconstruct import reconstruct
from sim2real.records.rounding import SEVERAL, rounding
from testbed.flight import fly

DEG = np.pi / 180.0
# As recorders have them: 10 ft of altitude, a quarter of a degree of flow and attitude, a tenth of surfaces and rates.
LEVELS = {"altitude": 3.048, **dict.fromkeys(("alpha", "beta", "phi", "theta"), 0.25 * DEG),
          **dict.fromkeys(("elevator", "aileron", "rudder", "p", "q", "r"), 0.1 * DEG)}  # fmt: skip


@cache
def flown(seed: int, sigma: float = 0.5) -> FlightRecord:
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": sigma})
    return fly(chosen, seed=seed, observer=False, protection=False).record


def on_levels(record: FlightRecord, levels: dict[str, float]) -> FlightRecord:
    return replace(record, channels=record.channels | {n: np.round(record[n] / q) * q for n, q in levels.items()})


def holding(record: FlightRecord, names: tuple[str, ...], every: int) -> FlightRecord:
    """The record with channels that repeat every so manieth sample until the next."""
    since = np.arange(len(record)) // every * every
    return replace(record, channels=record.channels | {n: record[n][since] for n in names})


def wandering(seed: int, slow: float, noise: float, count: int = 20_000) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.cumsum(slow * rng.standard_normal(count)) + noise * rng.standard_normal(count)


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.floats(0.01, 0.3), st.floats(0.0, 1.5))
def test_means_of_a_rounded_channel_err_by_no_more_than_it_is_said_to(seed: int, slow: float, noise: float):
    samples = wandering(seed, slow, noise)
    on = np.round(samples)
    said = rounding(on)
    assert said > 0.0
    for m in (1, 5, 25, 100, 400):
        off = (on - samples).reshape(-1, m).mean(axis=1)
        luck = 3.0 / np.sqrt(2.0 * len(off))  # three standard errors of so many means' root mean square
        assert np.sqrt(np.mean(off**2)) < (1.15 + luck) * said / np.sqrt(m), m


def test_what_is_not_rounded_leaves_nothing_open():
    assert rounding(wandering(1, 0.1, 0.5)) == 0.0
    assert rounding(np.full(500, 3.0)) == 0.0
    steps = np.repeat([0.0, 5.0, -5.0, 0.0], 100)
    assert rounding(steps, SEVERAL) == 0.0  # a surface moved to a few places and held there


@given(st.integers(0, 100), st.floats(0.1, 1000.0))
@settings(max_examples=20)
def test_rounding_has_the_unit_of_its_channel(seed: int, unit: float):
    samples = np.round(wandering(seed, 0.05, 0.2, 3000))
    assert rounding(unit * samples) == pytest.approx(unit * rounding(samples), rel=1e-6)


def test_noise_of_a_rounded_channel_is_its_rounding_and_others_are_as_they_were():
    plain, rounded = reconstruct(flown(3)), reconstruct(on_levels(flown(3), LEVELS))
    assert not plain.unseen.any()
    for j, name in enumerate(MEASURED):
        if name in LEVELS:
            assert rounded.unseen[j] == rounded.noise[j] >= LEVELS[name] / np.sqrt(12.0)
        else:
            assert rounded.noise[j] == plain.noise[j] and rounded.unseen[j] == 0.0
    assert (plain.surface_noise == SURFACE_NOISE).all() and (rounded.surface_noise > 1.1 * SURFACE_NOISE).all()


def test_an_altitude_that_never_moves_is_not_compared():
    record = flown(3)
    still = replace(record, channels=record.channels | {"altitude": np.full(len(record), 2200.0)})
    flight = reconstruct(still)
    assert not flight.has("altitude") and (flight.altitude == 2200.0).all()


def test_a_rounded_torque_is_noise_and_a_lever_that_stands_still_is_not():
    record = flown(3)
    rounded = reconstruct(on_levels(record, {"torque_left": 20.0, "torque_right": 20.0}))
    assert (rounded.power_noise > 2.0 * reconstruct(record).power_noise).all()
    without = {n: c for n, c in record.channels.items() if not n.startswith(("torque", "thrust", "rpm"))}
    stepped = {f"throttle_{side}": np.where(record.time < 20.0, 0.5, 0.51) for side in ("left", "right")}
    levers = reconstruct(replace(record, channels=without | stepped))
    thrust = {f"thrust_{side}": np.where(record.time < 20.0, 2000.0, 2800.0) for side in ("left", "right")}
    assert (reconstruct(replace(record, channels=without | thrust)).power_noise < 2e3).all()  # steps, and no levels
    assert levers.power_from == "throttle"
    assert (levers.power_noise < 1.0).all()  # W


def test_a_rounded_surface_follows_its_command_all_the_same():
    sharp, rounded = (placed([reconstruct(record)])[0] for record in (flown(3), on_levels(flown(3), LEVELS)))
    for j, surface in enumerate(("elevator", "aileron", "rudder")):
        assert np.sqrt(np.mean((rounded.controls[surface] - sharp.controls[surface]) ** 2)) < 0.01 * DEG
        assert sharp.surface_noise[j] < rounded.surface_noise[j] < SURFACE_NOISE


@pytest.mark.parametrize("sigma", [pytest.param(0.0, marks=pytest.mark.slow), 0.5])
def test_a_clean_aircraft_on_coarse_levels_is_not_blamed(sigma: float):
    found = diagnose([on_levels(flown(seed, sigma), LEVELS) for seed in (3, 4, 5)])
    assert found.verdict == "no_gap"


def test_samples_between_those_where_a_record_is_irregular_keep_their_noise():
    record = flown(3)
    rows = np.sort(np.random.default_rng(0).permutation(len(record))[: int(0.9 * len(record))])
    at = record.time + 0.25 * record.dt * (np.arange(len(record)) % 2)
    found = reconstruct(replace(record, channels=record.channels | {"time": at}).take(rows))
    np.testing.assert_allclose(found.noise[:12], reconstruct(record).noise[:12], rtol=0.12)


def test_a_channel_held_between_its_samples_has_no_more_of_them():
    names = ("airspeed", "alpha", "theta", "elevator")
    held = check(holding(flown(3), names, 5))
    for name in names:
        assert np.count_nonzero(np.isfinite(held[name])) == -(-len(held) // 5)
        told = [p.kind for p in held.problems if p.channel == name]
        assert told[:1] == ["repeats every sample 5 times, repeats left out"]
    for name in set(held.channels) - set(names):
        np.testing.assert_array_equal(held[name], check(flown(3))[name])


def test_levels_are_not_taken_for_samples_that_are_held():
    told = check(on_levels(flown(3), LEVELS)).problems
    assert not [p for p in told if "repeats" in p.kind]


@pytest.mark.slow
def test_a_clean_aircraft_with_slow_vanes_is_not_blamed():
    found = diagnose([holding(flown(seed), ("alpha", "beta", "airspeed"), 5) for seed in (3, 4, 5)])
    assert found.verdict == "no_gap"
