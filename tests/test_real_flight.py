"""Recorded flights diagnosed: what is known of them, how an answer is judged, and the study where the records are."""

from __future__ import annotations

from dataclasses import replace

import pytest

from icing_env.errors import InputError
from testbed.benchmarks import policies, real_flight
from testbed.benchmarks.real_flight import Known, measure, textbook_sizes
from testbed.textbook import folder

HERE = pytest.mark.skipif(not folder().is_dir(), reason="no recorded flights: set ICING_FLIGHT_DATA")


def test_known_sizes_are_the_textbooks_against_the_published_model():
    sizes = textbook_sizes("totter_f1_017_data.mat")
    assert sizes["side_force"] == pytest.approx(0.8451/0.6 - 1.0)
    assert sizes["aileron_power"] == pytest.approx(0.2117/0.15 - 1.0)
    longitudinal = textbook_sizes("totter_demo_data.mat")
    assert longitudinal["lift_slope"] == pytest.approx(6.349/5.66 - 1.0)
    assert longitudinal["pitch_trim"] == pytest.approx(0.0023 - 0.040)


def test_an_answer_is_judged_by_its_interval_and_its_detection_limit():
    said = Known("lift_slope", "change", 0.12, 0.1, 0.11, 0.09, 0.14, 0.9)
    assert said.outcome == "right"
    assert replace(said, high95=0.115).outcome == "named, size outside its interval"
    assert replace(said, probability=0.1).outcome == "missed"
    assert replace(said, probability=0.1, size=-0.05).outcome == "below its detection limit"
    assert replace(said, probability=0.0, smallest=None, low95=None, high95=None).outcome == "below its detection limit"


@pytest.mark.parametrize("study", [real_flight, policies])
def test_an_unknown_case_is_refused_with_the_nearest(study):
    with pytest.raises(InputError, match="did you mean"):
        study.measure([f"{next(iter(study.CASES))}x"])


def test_recorded_flights_that_are_not_there_are_asked_for(monkeypatch, tmp_path):
    monkeypatch.setenv("ICING_FLIGHT_DATA", str(tmp_path / "nowhere"))
    with pytest.raises(InputError, match="ICING_FLIGHT_DATA"):
        measure(["longitudinal"])


@HERE
@pytest.mark.slow
def test_the_gap_of_a_recorded_flight_shrinks_on_another_one():
    case, = measure(["longitudinal"])
    assert case.verdict != "no_gap"
    assert case.gap["held_out"]["after"] < case.gap["held_out"]["before"]
    assert {k.effect for k in case.known} >= {"lift_slope", "pitch_trim"}
