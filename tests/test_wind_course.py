"""A wind that nobody had in mind is told as wind; gusts are not."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from flown_again import flown_again
from free_courses import course_along, fits_beside
from numpy.typing import NDArray

from icing_env import scenario
from icing_env.record import FlightRecord
from sim2real.diagnosis import diagnose
from sim2real.library.pushes import pushes
from sim2real.library.terms import WIND_SIZE, Term
from sim2real.posterior.any_course import PLACES
from sim2real.posterior.generic import COURSE
from sim2real.prediction.predictor import Predictor
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction, reconstruct
from testbed.flight import fly


@cache
def flown(seed: int, sigma: float = 0.0, duration: float = 52.0) -> FlightRecord:
    chosen = scenario.load("clear_air", duration=duration, parameters={"turbulence_sigma_w": sigma})
    return fly(chosen, seed=seed, observer=False, protection=False).record


def through_a_front(change: float, seed: int = 3) -> FlightRecord:
    """The aircraft under the recorded controls, the wind from the south growing by `change` m/s about 25 s."""
    def rows(flight: Reconstruction, t: float) -> NDArray:
        row = flight.parameters.copy()
        row["wind_north"] += 0.5 * change * (1.0 + np.tanh((t - 25.0) / 3.0))
        return row

    return flown_again(flown(seed), rows, 0.1)


@pytest.mark.slow
def test_a_front_is_unknown_at_the_wind():
    change = 2.0
    found = diagnose([through_a_front(change, seed) for seed in (3, 4)])
    assert found.verdict == "unknown"
    assert found.unknown is not None and (found.unknown["component"], found.unknown["kind"]) == ("wind", "time_varying")
    assert found.where["components"]["wind"] > 0.8
    told = found.unknown["terms"][0]
    along = np.sqrt((change / 6.0) ** 2 * 4.0 / 52.0)  # root mean square of how fast it gathers, over 52 s
    assert told["term"] == COURSE
    assert told["coefficient"] == pytest.approx(along / np.sqrt(2.0), rel=0.3)  # none of it across


@pytest.mark.slow
def test_a_stronger_one_is_told_as_wind():
    found = diagnose([through_a_front(4.0)])  # one record: wind effects of the library with a bias may say it as well
    assert found.verdict != "no_gap"
    assert found.where["components"]["wind"] > 0.8
    flown = {c: p for c, p in found.where["components"].items() if not c.startswith("sensor:")}
    assert max(flown, key=lambda c: flown[c]) == "wind"  # a bias that is named beside may be as likely


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
    course = course_along(record)
    found = fits_beside(course, [course.model, course.evidence.rows])
    return {u.component: u for u in found}["wind"].log_evidence


def test_gusts_are_no_wind_of_its_own():
    assert "wind" in PLACES
    assert max(wind_in(flown(seed, 1.5, 40.0)) for seed in (5, 6, 7)) < 1.0
    assert wind_in(through_a_front(3.0)) > 20.0
