"""A free course of time at one component shows what no generic term follows, and noise alone shows none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from free_courses import course_along, fits_beside

from icing_env import scenario
from sim2real.posterior.any_course import PLACES, with_courses
from sim2real.posterior.generic import UnknownFit
from sim2real.prediction.predictor import Push
from sim2real.signatures.courses import Course
from testbed.flight import fly


@pytest.fixture(scope="module")
def course() -> Course:
    chosen = scenario.load("clear_air", duration=30.0, parameters={"turbulence_sigma_w": 0.5})
    return course_along(fly(chosen, seed=11, observer=False, protection=False).record)


def fits(course: Course, target: str = "q", size: float = 0.0, seed: int = 0) -> list[UnknownFit]:
    """Of white noise and an odd course of time at a state or a channel, the nuisances free to give way."""
    t = course.about.flight.time - course.about.flight.time[0]
    series = size * np.sign(np.sin(1.3 * t)) * np.sin(0.37 * t) ** 3
    pushed = course.about.respond([Push(0, target, series, target not in "uvwpqr")]).values
    noise = np.random.default_rng(seed).standard_normal(pushed.shape) * (course.model != 0.0)
    return fits_beside(course, [pushed + noise, course.evidence.rows])


def test_noise_shows_nothing(course):
    samples = np.count_nonzero(course.model)
    for seed in range(3):
        found = fits(course, seed=seed)
        assert max(u.log_evidence for u in found) < 5.0
        assert all(u.left == pytest.approx(samples, abs=5.0 * np.sqrt(2.0 * samples)) for u in found)


@pytest.mark.parametrize(("target", "component", "size"), [
    ("q", "pitching_moment", 0.01), ("r", "yawing_moment", 0.01), ("w", "z_force", 0.3),
    ("theta", "sensor:theta", 0.01),
])
def test_what_acts_somewhere_shows_there(course, target, component, size):
    found = {u.component: u for u in fits(course, target, size)}
    best = max(found.values(), key=lambda u: u.log_evidence)
    assert set(found) == set(PLACES)
    assert best.component == component and best.log_evidence > 20.0


def test_long_records_take_their_components_one_by_one_and_say_the_same(course, monkeypatch):
    assert course.bytes == pytest.approx(course.rows("rolling_moment").nbytes, rel=0.1)
    together = fits(course, "r", 0.01)
    monkeypatch.setattr("sim2real.posterior.any_course.MOST", 1.0)
    for one, other in zip(fits(course, "r", 0.01), together, strict=True):
        assert one.component == other.component
        assert (one.log_evidence, one.left) == pytest.approx((other.log_evidence, other.left), rel=1e-9)


def test_a_component_counts_terms_and_course_and_tells_the_likelier():
    terms, course = (UnknownFit("x_force", log, (("1", 1.0, 0.1),), 10.0, {}) for log in (2.0, 9.0))
    other = UnknownFit("y_force", 1.0, (("1", 1.0, 0.1),), 10.0, {})
    found = with_courses([terms, other], [replace(course, terms=(("course", 1.0, 0.1),))])
    assert [u.terms[0][0] for u in found] == ["course", "1"]
    assert found[0].log_evidence == pytest.approx(np.log(2.0 / 3.0 * np.exp(2.0) + np.exp(9.0) / 3.0))
    assert found[1].log_evidence == pytest.approx(1.0 + np.log(2.0 / 3.0))


@pytest.mark.parametrize(("course", "told"), [(3015.0, "airspeed"), (3060.0, "course")])
def test_of_ways_that_say_a_large_gap_nearly_as_well_terms_are_told_and_all_are_counted(course, told):
    terms = UnknownFit("x_force", 3000.0, (("airspeed", 1.0, 0.1),), 10.0, {})
    (found,) = with_courses([terms], [replace(terms, log_evidence=course, terms=(("course", 1.0, 0.1),))])
    assert found.terms[0][0] == told
    assert found.log_evidence == pytest.approx(course + np.log(1.0 / 3.0))
