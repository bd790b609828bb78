"""One estimate from several records."""

from __future__ import annotations

import math

import pytest

from estimators.combine import combine
from estimators.estimate import Estimate


def estimate(value: float, error: float, identifiable: bool = True) -> Estimate:
    """An estimate of one record."""
    return Estimate(value, error, "1/rad", "made", 0.9, identifiable, "" if identifiable else "did not move")


def test_records_that_agree_share_their_weight_by_inverse_variance():
    # Weights 1/0.01 and 1/0.04: mean (2.0*100 + 2.1*25)/125, error 1/sqrt(125).
    mean = combine([{"Cm_q": estimate(2.0, 0.1)}, {"Cm_q": estimate(2.1, 0.2)}])["Cm_q"]
    assert mean.estimate == pytest.approx(2.02, rel=1e-12)
    assert mean.std_error == pytest.approx(1 / math.sqrt(125), rel=1e-12)


def test_records_that_disagree_widen_the_error():
    # chi2 = 2 (0.5/0.1)^2 = 50 with one degree of freedom: the error of the mean is 0.5, the scatter itself.
    mean = combine([{"Cm_q": estimate(1.5, 0.1)}, {"Cm_q": estimate(2.5, 0.1)}])["Cm_q"]
    assert mean.estimate == pytest.approx(2.0, rel=1e-12)
    assert mean.std_error == pytest.approx(0.5, rel=1e-12)


def test_one_record_is_taken_as_it_is_and_a_refusal_weighs_nothing():
    alone = estimate(2.0, 0.1)
    assert combine([{"Cm_q": alone}, {"Cm_q": estimate(9.0, 0.01, identifiable=False)}, {}]) == {"Cm_q": alone}
    assert combine([{"Cm_q": estimate(9.0, 0.01, identifiable=False)}]) == {}


def test_an_error_of_zero_is_no_division_by_zero():
    mean = combine([{"Cm_q": estimate(2.0, 0.0)}, {"Cm_q": estimate(3.0, 0.1)}])["Cm_q"]
    assert mean.estimate == pytest.approx(2.0, rel=1e-9)
    assert math.isfinite(mean.std_error)
