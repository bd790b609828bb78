"""A wind that nobody had in mind is told as wind; gusts are not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from flown_again import flown_again
from numpy.typing import NDArray

from icing_env import scenario
from icing_env.record import FlightRecord
from sim2real.diagnosis import diagnose
from sim2real.library.candidates import bank
from sim2real.library.terms import WIND_SIZE, Term, pushes
from sim2real.posterior.any_course import PLACES, course_fits
from sim2real.prediction.predictor import Predictor
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.signatures.courses import Course, Courses
from sim2real.signatures.evidence import gather
from testbed.flight import fly


@cache
def flown(seed: int, sigma: float = 0.0, duration: float = 52.0) -> FlightRecord:
    chosen = scenario.load("clear_air", duration=duration, parameters={"turbulence_sigma_w": sigma})
    return fly(chosen, seed=seed, observer=False, protection=False).record


def through_a_front(change: float) -> FlightRecord:
    """The aircraft under the recorded controls, the wind from the south growing by `change` m/s about 25 s."""
    def rows(flight: Reconstruction, t: float) -> NDArray:
        row = flight.parameters.copy()
        row["wind_north"] += 0.5 * change * (1.0 + np.tanh((t - 25.0) / 3.0))
        return row

    return flown_again(flown(3), rows, 0.1)


def test_a_front_is_told_as_wind():
    found = diagnose([through_a_front(4.0)])  # one record: wind effects of the library with a bias may say it as well
    assert found.verdict != "no_gap"
    assert found.where["components"]["wind"] > 0.8
    assert max(found.where["components"], key=lambda c: found.where["components"][c]) == "wind"


def test_what_gathers_slows_the_aircraft_in_the_air_and_is_not_felt():
    flight = reconstruct(flown(3))
    half = round(0.5 / flight.dt)
    for name, channel, felt, size in (("along*time", "airspeed", "ax", -0.5 * WIND_SIZE),
                                      ("across*time", "beta", "ay", -0.5 * WIND_SIZE / flight.channel("airspeed")[0])):
        both = [Predictor(flight, flight.parameters) for _ in range(2)]
        for plant in both:
            plant.place(0)
        pushed = pushes(flight, [Term("wind", name, "wind", 0)])
        off = both[1].fly(half, pushes=pushed)[:, 0] - both[0].fly(half)[:, 0]
        assert off[-1, MEASURED.index(channel)] == pytest.approx(size, rel=0.25)
        assert abs(off[0, MEASURED.index(felt)]) < 0.02 * WIND_SIZE


def wind_in(record: FlightRecord) -> float:
    """Log evidence of a free course of the wind along a record, some of the model's numbers free to give way."""
    flight, whole = reconstruct(record), bank()
    few = 4
    only = replace(whole, families=(), terms=(), nuisances=whole.nuisances[:few], size=1 + few)
    course = Course(gather(flight, only))
    parts = [course.model, course.evidence.rows]
    rows = np.concatenate(parts, axis=1)
    gram = rows.T @ rows
    gram[1:, 1:] += np.eye(few)
    return {u.component: u for u in course_fits(Courses([course], 1.0), [parts], gram)}["wind"].log_evidence


def test_gusts_are_no_wind_of_its_own():
    assert "wind" in PLACES
    assert max(wind_in(flown(seed, 1.5, 40.0)) for seed in (5, 6, 7)) < 1.0
    assert wind_in(through_a_front(3.0)) > 20.0
