"""Modified stepwise regression: what enters, what leaves, and why."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flights import PITCH, V, flight_data, longitudinal

from estimators.regression.equation_error import histories, identify
from estimators.regression.least_squares import correlation, least_squares
from estimators.regression.stepwise import Criteria, stepwise
from estimators.signals.differentiate import slope, smooth
from icing_env.record import read


def test_stepwise_finds_the_cubic_and_leaves_the_rest() -> None:
    rng = np.random.default_rng(3)
    alpha, de = 0.2 * rng.standard_normal(400), 0.1 * rng.standard_normal(400)
    candidates = {
        "alpha": alpha,
        "elevator": de,
        "alpha*elevator": alpha * de,
        "alpha^3": alpha**3,
        "twin": 1.1 * alpha,
    }
    target = 0.1 - 1.4 * alpha - 1.8 * de + 9.0 * alpha**3 + 0.01 * rng.standard_normal(400)
    found = stepwise(candidates, target, forced=("alpha", "elevator"))
    assert set(found.terms) == {"alpha", "elevator", "alpha^3", "1"}
    assert found.fit.theta[found.terms.index("alpha^3")] == pytest.approx(9.0, rel=0.05)
    assert "entered  alpha^3" in found.table()
    assert correlation(np.column_stack([alpha, candidates["twin"]]))[0, 1] == pytest.approx(1.0)


def test_stepwise_passes_over_twins_and_stops_at_what_explains_nothing() -> None:
    rng = np.random.default_rng(4)
    a, b, noise = rng.standard_normal((3, 500))
    candidates = {"a": a, "twin": a + 0.1 * noise, "b": b}
    target = a + 0.1 * noise + 0.02 * rng.standard_normal(500)
    found = stepwise(candidates, target, forced=("a",))
    assert [(s.term, s.action) for s in found.history] == [("a", "forced"), ("twin", "refused"), ("b", "refused")]
    assert "correlation with a" in found.history[1].why and "F not above 20" in found.history[2].why
    loose = stepwise(candidates, target, forced=("a",), criteria=Criteria(r2_gain=0.0, collinear=1.0))
    assert loose.terms == ("a", "twin", "1")
    tight = stepwise(candidates, target, forced=("a",), criteria=Criteria(r2_gain=0.0, collinear=1.0, condition=10.0))
    assert "condition number" in tight.history[1].why


def test_a_term_that_others_replace_leaves() -> None:
    """Before its two halves are in, their sum explains most; with them it explains nothing (F_out)."""
    rng = np.random.default_rng(5)
    a, b, blur = rng.standard_normal((3, 400))
    candidates = {"sum": a + b + 0.5 * blur, "a": a, "b": b}
    found = stepwise(candidates, 1.0 * a + 1.0 * b + 0.1 * rng.standard_normal(400))
    assert set(found.terms) == {"a", "b", "1"}
    assert [s.action for s in found.history if s.term == "sum"] == ["entered", "left"]


@pytest.mark.parametrize("weight", [1.0, 2.0])
def test_partial_f_r2_and_pse_are_those_of_the_full_fits(weight: float) -> None:
    rng = np.random.default_rng(6)
    x = dict(zip("abc", rng.standard_normal((3, 200)), strict=True))
    target = 0.5 + x["a"] - 0.3 * x["b"] + 0.2 * rng.standard_normal(200)
    found = stepwise(x, target, criteria=Criteria(weight=weight))
    steps = {s.term: s for s in found.history if s.action == "entered"}
    one, two = (least_squares(np.column_stack([*(x[n] for n in m), np.ones(200)]), target) for m in ("a", "ab"))
    gained = np.sum(one.residual**2) - np.sum(two.residual**2)
    assert steps["b"].partial_f == pytest.approx(gained / two.variance)
    assert steps["b"].r2 == pytest.approx(two.r2)
    assert steps["b"].pse == pytest.approx(np.mean(two.residual**2) + weight * np.var(target) * 3 / 200)


def test_a_curved_moment_is_found_and_does_not_bend_the_slope() -> None:
    curve = -12.0  # of alpha^2 about trim: the tail's loss of damping near the stall, much enlarged
    record = longitudinal()
    meta, alpha = record.meta, record["alpha"]
    centred = alpha - np.mean(alpha)
    extra = curve * centred**2 * 0.5 * 1.03 * V**2 * meta.geometry.wing_area * meta.geometry.chord / meta.inertia[1]
    q_dot = slope(record["q"], record.dt, 5) + smooth(extra, 5)
    whole = replace(record, owner={n: np.nan_to_num(q_dot) * (n == "q_dot") for n in ("p_dot", "q_dot", "r_dot")})
    whole = whole.take(slice(10, -10))
    linear, curved = (identify(whole, "textbook", nonlinear=on) for on in (False, True))
    assert curved["Cm_alpha*alpha"].estimate == pytest.approx(curve, rel=0.05)
    assert abs(curved["Cm_alpha"].estimate - PITCH["Cm_alpha"]) < 0.5 * abs(
        linear["Cm_alpha"].estimate - PITCH["Cm_alpha"]
    )
    assert "entered  alpha*alpha" in histories(whole, "textbook")["Cm"].table()


def test_what_was_not_flown_has_no_competition() -> None:
    assert set(histories(read(flight_data("totter_demo_data.mat")))) == {"CZ", "CL", "Cm"}
    assert set(histories(read(flight_data("totter_f1_017_data.mat")))) == {"CY", "Cl", "Cn"}
