"""What a record is said to show: correlations, excitation and the sentence."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from flights import flight_data, lateral, longitudinal

from estimators.methods import method
from estimators.observability import observability
from estimators.regression.equation_error import identify
from icing_env.record import read


def test_a_lively_record_says_how_well_it_shows_each_derivative() -> None:
    record = longitudinal(1)
    estimates = identify(record)
    found = observability(record, estimates)
    assert set(found) == set(estimates)
    damping = found["Cm_q"]
    assert damping.relative_error == pytest.approx(estimates["Cm_q"].std_error / abs(estimates["Cm_q"].estimate))
    assert damping.identifiable and "known to" in damping.sentence and "elevator moved" in damping.sentence
    assert damping.correlated_with in ("Cm_alpha", "Cm_elevator") and 0.1 < damping.correlation < 1.0
    assert found["Cm_alpha"].motion_rms == pytest.approx(np.std(record["alpha"]), rel=0.1)
    assert found["CD_0"].motion_rms is None


def test_correlation_is_that_of_the_least_squares_parameters() -> None:
    record = longitudinal(2)
    found = observability(record, identify(record))
    x = np.column_stack([record["alpha"], record["q"], record["elevator"], np.ones(len(record))])
    covariance = np.linalg.inv(x.T @ x)
    expected = abs(covariance[0, 1]) / np.sqrt(covariance[0, 0] * covariance[1, 1])
    pair = found["Cm_alpha"]
    assert pair.correlation == pytest.approx(expected, abs=0.1) or pair.correlated_with == "Cm_elevator"


def test_what_is_refused_gets_the_reason_in_plain_words() -> None:
    record = read(flight_data("totter_f1_017_data.mat"))
    found = observability(record, identify(record))
    refused = found["Cn_aileron"]
    assert not refused.identifiable
    assert refused.sentence.startswith("Cn_aileron cannot be had from this record: its standard error")
    assert "no longitudinal manoeuvre" in found["Cm_alpha"].sentence
    assert found["Cl_aileron"].control_rms > np.radians(0.25)


def test_surfaces_that_move_together_are_told() -> None:
    record = lateral(3)
    both = replace(record, channels={**record.channels, "rudder": 0.5 * record["aileron"] + 1e-4 * record["rudder"]})
    found = observability(both, identify(both))
    assert found["Cl_aileron"].correlated_with == "Cl_rudder" and found["Cl_aileron"].correlation > 0.95


@pytest.mark.parametrize("name", ["orthogonal", "stepwise"])
def test_any_method_can_be_asked_and_the_answer_is_plain_data(name: str) -> None:
    record = longitudinal(4)
    for told in observability(record, method(name)(record)).values():
        plain = asdict(told)
        assert all(isinstance(v, (float, str, bool, type(None))) for v in plain.values())
