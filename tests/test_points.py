"""A set flown along records: slopes taken from elsewhere save flights and change nothing that is found."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from icing_env import scenario
from icing_env.aircraft import load
from sim2real.baseline.references import Baseline
from sim2real.flown.corrections import corrected, lost
from sim2real.flown.points import Flying
from sim2real.flown.steps import Point, bounded_step, rooms
from sim2real.library.candidates import NUISANCE_STEP, bank
from sim2real.library.pushes import in_common, pushes
from sim2real.library.sizes import size_prior
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.posterior.sets import SetFit
from sim2real.records.reconstruct import reconstruct
from sim2real.signatures.courses import Course, Courses
from sim2real.signatures.evidence import gather
from testbed.flight import fly

NOTHING = SetFit(misfit=1e6)


@pytest.fixture(scope="module")
def flying() -> Flying:
    """A flight in gusts whose weathercock moment is weaker than published, by four deviations of the model's own."""
    chosen = scenario.load("clear_air", duration=24.0, parameters={"turbulence_sigma_w": 0.5},
                           effects={"directional_stability": {"change": -0.2}})  # fmt: skip
    flight = in_common([reconstruct(fly(chosen, seed=5, observer=False, protection=False).record)])[0]
    candidates = replace(bank(), families=())
    evidence = gather(flight, candidates)
    baseline = Baseline(load(), np.eye(len(candidates.nuisances)))
    return Flying([flight], candidates, [evidence], baseline, 1.0,
                    Courses([Course(evidence)], 1.0, candidates.terms))


def test_what_was_kept_of_the_terms_is_their_response(flying):
    (evidence,), terms = flying.evidences, flying.candidates.terms
    assert evidence.linear is not None
    again = evidence.linear.respond(pushes(evidence.linear.flight, terms))
    at = [j for j, term in enumerate(terms) if term.row in again.rows]
    (kept, inner), = flying.courses.of_terms()
    assert len(at) > 100 and np.max(np.abs(again.values)) > 1.0
    assert kept[:, at] == pytest.approx(again.values, abs=1e-12) and not np.delete(kept, at, axis=1).any()
    assert inner[np.ix_(at, at)] == pytest.approx(again.values.T @ again.values, rel=1e-9, abs=1e-6)


def test_a_point_with_slopes_from_elsewhere_costs_what_it_does_with_its_own(flying):
    away = 0.5 * np.random.default_rng(0).standard_normal(len(flying.candidates.nuisances))
    own = flying.point(NOTHING, np.zeros(0), away)
    lent = flying.point(NOTHING, np.zeros(0), away, flying.near)
    assert lent.cost == pytest.approx(own.cost, rel=1e-12)
    assert lent.rows[0][:, 0] == pytest.approx(own.rows[0][:, 0], abs=1e-12)
    assert lent.slopes[0] is flying.near[0]


def test_what_commands_and_positions_tell_counts_where_a_set_is_flown(flying):
    """Nothing of them was told of gearings and offsets there, and the prior drew back what they say."""
    nothing = np.zeros(len(flying.candidates.nuisances))
    alone, (beside,) = flying.point(NOTHING, nothing[:0], nothing), flying.points([(NOTHING, nothing[:0], nothing)])
    gram = flying.evidences[0].gram
    names = [nuisance.name for nuisance in flying.candidates.nuisances]
    for j in (names.index("elevator_gearing"), names.index("elevator_offset")):
        told = gram[1 + j, 1 + j] / NUISANCE_STEP**2
        assert told > 1.0
        for at in (alone, beside):
            assert at.information[j, j] == pytest.approx(1.0 + told, rel=0.02)
            assert at.slope[j] == pytest.approx(gram[1 + j, 0] / NUISANCE_STEP, abs=0.02 * np.sqrt(told))


def test_it_settles_where_full_steps_of_gauss_and_newton_do(flying):
    start = np.zeros(len(flying.candidates.nuisances))
    best = flying.point(NOTHING, np.zeros(0), start)
    first = best.cost
    for _ in range(6):
        step = bounded_step(best.information, best.slope, *rooms(NOTHING, best, np.zeros(0)))
        tried = flying.point(NOTHING, np.zeros(0), best.nuisances + step)
        if tried.cost >= best.cost:
            break
        best = tried
    settled = flying.settle(NOTHING, start)
    assert best.cost < first - 20.0
    assert settled.cost < best.cost + 0.2


def test_a_derivative_and_its_own_uncertainty_cannot_be_told_apart_where_they_are_flown(flying):
    """N(1 + change)(1 + 0.05 z) has parallel slopes by both: else the size would look surer than it can be."""
    family = next(f for f in bank().families if f.effect.name == "directional_stability")
    change, spread = np.array([-0.2]), 0.04
    fit = SetFit((family,), 0.0, (-0.2,), (-0.3,), (-0.1,), np.array([[spread**2]]), {}, 1e6)
    point = flying.point(fit, change, np.zeros(len(flying.candidates.nuisances)))
    j = next(j for j, n in enumerate(flying.candidates.nuisances) if n.parameter == "Cn_beta")
    by_size, by_deviation = point.rows[0][:, 1] / point.steps[0], point.slopes[0].rows[:, j]
    unlike = 0.05 * (1.0 - 0.2) * by_size - by_deviation
    assert np.linalg.norm(by_deviation) > 1.0
    assert np.linalg.norm(unlike) < 3e-3 * np.linalg.norm(by_deviation)
    unit = family.parameter.high - family.parameter.low
    assert unit * np.sqrt(np.linalg.inv(point.information)[0, 0]) > 0.04  # no surer than the spread lets it be


@pytest.mark.parametrize(("slope", "misfit"), [(50.0, 200.0), (0.0, 200.0), (-5.0, 197.5)])
def test_no_set_is_credited_with_what_lies_beyond_its_range(slope, misfit):
    """A size at the lower end: what falls on towards less is not to be had, what falls on towards more is."""
    family = next(f for f in bank().families if f.effect.name == "rudder_power")
    end = (family.parameter.low,)
    fit = SetFit((family,), 0.0, end, end, end, np.array([[1e-4]]), {}, 0.0)
    point = Point(np.array(end), np.zeros(0), 100.0, np.array([slope]), np.array([[10.0]]), np.ones(1))
    posterior = SimpleNamespace(reduced=np.array([[300.0]]))
    found = corrected(Hypothesis(fit, None, 0.0, 0.0), point, posterior, bank().families)
    assert found.fit.misfit == pytest.approx(misfit, abs=2.0)  # a step of its grid
    assert found.log_evidence < 0.5 * (300.0 - misfit)
    assert found.fit.low95[0] >= end[0]


@pytest.mark.parametrize("piece", [0, 1, 2])
def test_a_set_is_weighed_alike_whatever_piece_of_its_range_it_was_flown_from(piece):
    """A vane's 0.12 s, which the linear fit had taken for 0.08 s or less, had no prior there: 690 units were lost."""
    pieces = [f for f in bank().families if f.effect.name == "vane_lag"]
    fit = SetFit((pieces[piece],), 0.0, (0.12,), (0.1,), (0.14,), np.array([[1e-4]]), {}, 0.0)
    point = Point(np.array([0.12]), np.zeros(0), 100.0, np.zeros(1), np.array([[4e3]]), np.ones(1))
    found = corrected(Hypothesis(fit, None, 0.0, 0.0), point, SimpleNamespace(reduced=np.array([[300.0]])), pieces)
    sizes = np.linspace(-0.02, 0.5, 4001)
    likelihood = np.exp(-0.5 * 4e3 / 0.52**2 * (sizes - 0.12) ** 2)
    wanted = 50.0 + np.log(np.sum(size_prior(pieces[0].parameter, sizes) * likelihood * np.gradient(sizes)))
    assert found.log_evidence == pytest.approx(wanted, abs=0.02)
    assert found.fit.families[0] is next(f for f in pieces if f.low <= 0.12 <= f.high)
    assert set(found.fit.weights) == set(found.fit.families[0].rows)


@given(st.integers(0, 10_000), st.floats(0.0, 10.0))
def test_a_step_is_found_however_much_more_a_size_tells_than_a_nuisance(seed, decades):
    """Units of some parameters change by up to 1e10: the step is as good, within the same bounds."""
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((40, 6))
    information, slope = rows.T @ rows, rng.standard_normal(6) * 10.0
    high = rng.uniform(0.01, 1.0, 6)
    unit = 10.0 ** (decades * rng.uniform(0.0, 1.0, 6))
    plain = bounded_step(information, slope, -high, high)
    other = bounded_step(information * unit[:, None] * unit, slope * unit, -high / unit, high / unit)
    cost = [float(step @ slope + 0.5 * step @ information @ step) for step in (plain, other * unit)]
    assert np.all(np.abs(plain) <= high + 1e-9) and np.all(np.abs(other * unit) <= high + 1e-9)
    assert cost[1] == pytest.approx(cost[0], rel=1e-6) and cost[0] < 0.0


def test_a_set_that_does_not_fly_is_as_bad_as_it_was_flown():
    """Slopes of a flight that departs say nothing; believed, they made a negative square of rounding, or a crash."""
    family = next(f for f in bank().families if f.effect.name == "lift_slope")
    fit = SetFit((family,), 0.0, (0.5,), (0.4,), (0.6,), np.array([[1e-2]]), {}, 0.0)
    slope, information = np.array([-1e13, 0.0, 0.0]), np.diag([1e22, 1e16, 1.0])
    far = Point(np.array([0.5]), np.zeros(2), 6.7e13, slope, information, np.ones(1))
    posterior = SimpleNamespace(reduced=np.array([[3e5]]))
    assert lost(far, posterior) and not lost(replace(far, cost=3e5), posterior)
    found = corrected(Hypothesis(fit, None, 0.0, 0.0), far, posterior, bank().families)
    assert found.fit.misfit == 2.0 * far.cost and found.log_evidence == 1.5e5 - far.cost
    assert found.fit.estimate == fit.estimate
