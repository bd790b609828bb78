"""Surfaces whose positions were recorded now and then: judged as sharply as they deserve, and no more."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import scenario
from icing_env.record import FlightRecord
from sim2real.actuators.paths import CORRELATED, counted, excess, position_noise
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import Reconstruction, reconstruct
from testbed.flight import fly


@cache
def flown() -> FlightRecord:
    """Doublets of all three surfaces."""
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.5})
    return fly(chosen, seed=4, observer=False, protection=False).record


def every(samples: int, noise: float = 0.0) -> Reconstruction:
    """The record with a position every so many samples, `noise` [rad] added to it."""
    rng, channels = np.random.default_rng(1), dict(flown().channels)
    for surface in SURFACES:
        position = channels[surface] + noise * rng.standard_normal(len(channels[surface]))
        channels[surface] = np.where(np.arange(len(position)) % samples == 0, position, np.nan)
    return reconstruct(replace(flown(), channels=channels))


@pytest.mark.parametrize("samples", [1, 5, 10])
@pytest.mark.parametrize("noise", [0.0, 2.5e-3])
def test_an_actuator_as_published_leaves_what_noise_leaves(samples: int, noise: float):
    flight = every(samples, noise)
    for surface in SURFACES:
        count = counted(flight, f"{surface}_path")
        assert count == pytest.approx(flight.dt * len(flight.time) / CORRELATED, rel=0.02)
        assert excess(flight, flight.parameters)[f"{surface}_path"] < 3.0 * np.sqrt(2.0 * count)


@pytest.mark.parametrize("samples", [1, 5])
def test_the_noise_of_positions_is_seen_however_seldom_they_are_read(samples: int):
    flight = every(samples, 2.5e-3)
    for surface in SURFACES:
        noise = position_noise(flight, surface)[1].min() / np.sqrt(CORRELATED / (samples * flight.dt))
        assert noise == pytest.approx(2.5e-3, rel=0.35)


@pytest.mark.parametrize("samples", [5, 10])
def test_a_gearing_shows_in_few_samples_and_no_more_than_in_all(samples: int):
    """20 % of a doublet; the less sharply, since motion between samples passes for their noise."""
    flight, whole = every(samples), every(1)
    geared = flight.parameters.copy()
    geared["elevator_gearing"] *= 0.8
    found, most = (excess(f, geared)["elevator_path"] for f in (flight, whole))
    assert 40.0 < found < most
