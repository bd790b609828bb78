"""Multivariate orthogonal functions: what they are made of, what they keep, and the derivatives they give."""

from __future__ import annotations

import numpy as np
import pytest
from flights import LATERAL, PITCH, flight_data, lateral, longitudinal
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.methods import method
from estimators.regression import equation_error
from estimators.regression.least_squares import least_squares
from estimators.regression.orthogonal import expand, identify, rankings
from icing_env.errors import InputError
from icing_env.record import read


def cubic(seed: int, n: int = 600) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Functions of two angles and a target that holds three of them."""
    rng = np.random.default_rng(seed)
    a, e = 0.1 * rng.standard_normal((2, n))
    functions = {"a": a, "e": e, "a*a": a**2, "a*e": a * e, "a*a*a": a**3, "e*e": e**2}
    return functions, 0.3 - 1.4 * a - 1.9 * e + 25.0 * a**3 + 0.003 * rng.standard_normal(n)


def test_kept_functions_expand_to_the_terms_that_made_the_target() -> None:
    functions, target = cubic(1)
    found = expand(functions, target, "noise")
    value = dict(zip(found.terms, found.theta, strict=True))
    assert value["a"] == pytest.approx(-1.4, abs=0.02) and value["e"] == pytest.approx(-1.9, abs=0.01)
    assert value["a*a*a"] == pytest.approx(25.0, rel=0.05) and value["1"] == pytest.approx(0.3, abs=1e-3)
    assert "kept     a*a*a" in found.table() and "left out e*e" in found.table()
    for name in set(found.terms) - {"a", "e", "a*a*a", "1"}:
        assert abs(value[name]) * np.std(functions[name]) < 0.003 * np.std(target), name


@settings(max_examples=20)
@given(st.integers(0, 1000), st.permutations(["a", "e", "a*a", "a*e", "a*a*a", "e*e"]))
def test_all_functions_together_are_least_squares_in_any_order(seed: int, order: list[str]) -> None:
    functions, target = cubic(seed, 200)
    found = expand({n: functions[n] for n in order}, target, weight=0.0)
    full = least_squares(np.column_stack([*(functions[n] for n in order), np.ones(200)]), target)
    value, truth = dict(zip(found.terms, found.theta, strict=True)), dict(zip([*order, "1"], full.theta, strict=True))
    for name in found.terms:  # what is left out contributes less than a thousandth of the response
        assert value[name] == pytest.approx(truth[name], abs=0.02 * abs(truth[name]) + 0.1), name
    assert sum(f.share for f in found.ranking) == pytest.approx(full.r2, abs=1e-9)


def test_a_function_that_others_span_is_not_used() -> None:
    functions, target = cubic(2)
    functions["both"] = functions["a"] - 2 * functions["e"]
    found = expand(functions, target)
    assert "both" not in {f.term for f in found.ranking} and np.isfinite(found.theta).all()


def test_the_predicted_square_error_is_least_at_what_is_kept() -> None:
    functions, target = cubic(3)
    ranking = expand(functions, target).ranking
    kept = [f.kept for f in ranking]
    assert kept == sorted(kept, reverse=True)
    assert min(f.pse for f in ranking) == ranking[sum(kept) - 1].pse
    with pytest.raises(InputError, match="bound 'none' is unknown"):
        expand(functions, target, "none")


def test_known_derivatives_are_recovered_without_noise_and_within_their_errors_with_it() -> None:
    clean = {**identify(longitudinal()), **identify(lateral())}
    for name in ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_elevator", "Cl_beta", "Cl_p", "Cl_aileron", "Cn_beta", "Cn_r"):
        assert clean[name].estimate == pytest.approx({**PITCH, **LATERAL}[name], rel=0.03), name
    scores = []
    for seed in range(8):
        found = identify(longitudinal(seed), bound="noise")
        scores += [(found[n].estimate - PITCH[n]) / found[n].std_error for n in ("Cm_alpha", "Cm_q", "Cm_elevator")]
    assert np.mean(np.abs(scores) < 2.0) > 0.8 and np.max(np.abs(scores)) < 5.0


def test_on_a_recorded_flight_it_agrees_with_equation_error() -> None:
    record = read(flight_data("totter_demo_data.mat"))
    found, other = method("orthogonal")(record), equation_error.identify(record)
    for name in ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_elevator", "CD_0"):
        assert found[name].identifiable
        assert found[name].estimate == pytest.approx(other[name].estimate, rel=0.02), name
    assert set(rankings(record)) == {"CZ", "CL", "Cm", "CD", "CX"}


def test_what_is_not_in_the_model_is_not_identified() -> None:
    found = identify(read(flight_data("totter_f1_017_data.mat")))
    assert not found["CY_p"].identifiable and not found["Cm_alpha"].identifiable
    assert "no longitudinal manoeuvre" in found["Cm_alpha"].why
