"""Free courses of time take what enters at their component, whatever its form, and leave what enters elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from icing_env import scenario
from sim2real.library.candidates import bank
from sim2real.prediction.predictor import Push
from sim2real.records.reconstruct import reconstruct
from sim2real.signatures.courses import Course, Courses, Remainder
from sim2real.signatures.evidence import Evidence, flown, gather
from testbed.flight import fly


@pytest.fixture(scope="module")
def evidence() -> Evidence:
    chosen = scenario.load("clear_air", duration=25.0, parameters={"turbulence_sigma_w": 0.5})
    flight = reconstruct(fly(chosen, seed=4, observer=False, protection=False).record)
    return gather(flight, replace(bank(), families=(), terms=(), nuisances=(), size=1))


def remainder(evidence: Evidence, target: str, size: float, seed: int = 0) -> tuple[Remainder, float]:
    """White noise and the response to an odd course of time at `target`; and that response's whitened square."""
    flight = evidence.flight
    t = flight.time - flight.time[0]
    series = size * (np.tanh(t - 8.0) + np.sin(0.7 * t) ** 3)
    rows = np.repeat(flight.parameters, 2)
    response = flown(flight, rows, (Push(1, target, series, False),), evidence.gain, evidence.factor, keep=[1]).rows
    noise = np.random.default_rng(seed).standard_normal(response.shape) * np.any(evidence.whitened != 0.0)
    row = response + noise
    return Remainder(row.T @ row, 1, [[row]], {}, {}, {}), float(np.sum(response**2))


@pytest.mark.parametrize(("target", "home", "elsewhere"), [
    ("p", "rolling_moment", "z_force"), ("q", "pitching_moment", "yawing_moment"), ("w", "z_force", "rolling_moment"),
])  # fmt: skip
def test_a_course_takes_what_enters_at_its_component(evidence, target, home, elsewhere):
    left, square = remainder(evidence, target, 0.1 if target == "w" else 0.01)
    courses = Courses([Course(evidence)], 1.0)
    assert square > 200.0
    assert courses.free(left, {home}) == pytest.approx(square, abs=0.05 * square + 40.0)
    assert courses.free(left, {elsewhere}) < 0.1 * square + 40.0
    assert courses.free(left, {home, elsewhere}) >= 0.95 * courses.free(left, {home}) - 20.0


def test_noise_alone_gives_a_course_little(evidence):
    courses = Courses([Course(evidence)], 1.0)
    found = [courses.free(remainder(evidence, "p", 0.0, seed)[0], {"rolling_moment"}) for seed in range(20)]
    assert np.mean(found) < 15.0 and max(found) < 60.0


def test_a_path_has_no_courses_but_its_excess(evidence):
    left, _ = remainder(evidence, "p", 0.01)
    held = Remainder(left.gram, left.first, left.rows, {"elevator_path": 77.0}, {}, {})
    assert Courses([Course(evidence)], 1.0).free(held, {"elevator_path"}) == 77.0
