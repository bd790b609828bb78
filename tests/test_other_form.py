"""Powers of regressors, one condition for all records, nuisances with an end, forms weighed where they were flown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from icing_env import effects, scenario
from icing_env.aircraft import load
from sim2real.baseline.references import Baseline
from sim2real.closing.whole_model import changed_places
from sim2real.flown import other_form as in_form
from sim2real.flown.other_form import Bent, bring, flown_unknown
from sim2real.flown.points import Flying
from sim2real.flown.steps import FARTHEST, bounded_step
from sim2real.library import candidates as library
from sim2real.library.candidates import bank
from sim2real.library.pushes import in_common, pushes, values_of
from sim2real.library.terms import GENERIC_SIZE, Term
from sim2real.posterior.form import Form, home
from sim2real.posterior.generic import fit_unknown
from sim2real.posterior.home_terms import gain
from sim2real.posterior.sets import SetFit
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.signatures.courses import Course, Courses, projected
from sim2real.signatures.evidence import gather
from testbed.flight import fly


def products(seed: int, terms: int, left: float) -> np.ndarray:
    """Inner products of a residual and of the signatures of terms, random."""
    rng = np.random.default_rng(seed)
    whole = np.column_stack([left * rng.standard_normal(300) / 10.0, 3.0 * rng.standard_normal((300, terms))])
    whole[:, 0] += whole[:, 1:] @ rng.standard_normal(terms)
    return whole.T @ whole


@given(st.integers(0, 200), st.floats(0.0, 30.0), st.sampled_from([None, (True, False, False, False),
                                                                  (False, True, False, True)]))
def test_a_form_is_worth_as_much_wherever_its_terms_are_flown(seed, left, chosen):
    """Where all is linear, flying the terms at any size changes nothing of their evidence."""
    gram = products(seed, 4, left)
    square, powers = np.full(4, 4.0 * gram[0, 0]), None if chosen is None else np.array(chosen)
    plain = gain(gram[1:, 1:], gram[1:, 0], square, gram[0, 0], powers=powers)
    at = np.random.default_rng(seed).standard_normal(4)
    moved = np.eye(5)
    moved[0, 1:] = at
    there = moved @ gram @ moved.T
    flown = gain(there[1:, 1:], there[1:, 0], square, gram[0, 0], flown=at, closer=gram[0, 0] - there[0, 0],
                 powers=powers)
    assert flown.few == plain.few
    assert flown.gained == pytest.approx(plain.gained, rel=1e-6, abs=1e-4)
    assert flown.left == pytest.approx(plain.left, rel=1e-6, abs=1e-4)


@given(st.integers(0, 200), st.floats(0.0, 30.0))
def test_all_terms_and_powers_alone_are_as_likely_each_way(seed, left):
    gram, powers = products(seed, 4, left), np.array([False, True, False, True])
    square = np.full(4, 4.0 * gram[0, 0])

    def logs(rows: np.ndarray, **more: np.ndarray) -> np.ndarray:
        found = gain(gram[np.ix_(rows, rows)], gram[rows, 0], square[rows - 1], gram[0, 0], **more)
        return np.array(found.gained) + np.log(len(found.gained))

    every, few = logs(np.arange(1, 5)), logs(1 + np.flatnonzero(powers))
    assert logs(np.arange(1, 5), powers=powers) == pytest.approx(np.logaddexp(every, few) - np.log(2.0), abs=1e-6)
    for all_alike in (np.zeros(4, bool), np.ones(4, bool)):
        assert logs(np.arange(1, 5), powers=all_alike) == pytest.approx(every)


def test_a_saturation_does_not_pay_for_the_terms_that_it_does_not_need():
    """One power among twenty terms of a moment."""
    gram, powers = products(3, 20, 0.0), np.arange(20) == 4
    onto, square = -gram[1:, 5], np.full(20, 1e4)
    plain, few = (gain(gram[1:, 1:], onto, square, 1e4, powers=own) for own in (None, powers))
    assert few.few and not plain.few and max(few.gained) > max(plain.gained) + 20.0
    assert few.least == pytest.approx(plain.least, abs=0.1 * gram[5, 5])


def test_what_one_component_may_take_another_may_not():
    """A little offset of one path is no reason for a large gearing there, however large another member's home is."""
    inner, onto = np.diag([100.0, 100.0]), np.array([-3000.0, 0.0])  # 90,000 to be had at the first
    square = np.array([10.0, 1e6])
    apart = gain(inner, onto, square, 1e5, at=("elevator_path", "rolling_moment"))
    together = gain(inner, onto, square, 1e5)
    assert apart.least > 1e5 - 0.03 * 90_000.0 and together.least < 1e5 - 0.03 * 90_000.0
    assert max(apart.gained) < 0.1 * max(together.gained)


@given(st.integers(0, 500), st.floats(0.1, 5.0))
def test_a_step_between_bounds_is_the_best_there(seed, width):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((8, 6))
    information, slope = root.T @ root + 0.1 * np.eye(6), 5.0 * rng.standard_normal(6)
    low, high = -width * rng.random(6) - 1e-3, width * rng.random(6) + 1e-3

    def cost(x: np.ndarray) -> float:
        return float(slope @ x + 0.5 * x @ information @ x)

    step = bounded_step(information, slope, low, high)
    assert np.all(step >= low - 1e-9) and np.all(step <= high + 1e-9)
    for _ in range(50):
        other = np.clip(step + 0.1 * width * rng.standard_normal(6), low, high)
        assert cost(step) <= cost(other) + 1e-6
    far = bounded_step(information, slope, np.full(6, -1e6), np.full(6, 1e6))
    assert far == pytest.approx(-np.linalg.solve(information, slope))


def test_what_is_held_gives_way_no_more():
    gram = products(3, 5, 1.0)
    assert projected(gram, 3)[0, 0] < projected(gram, 3, (2,))[0, 0] < projected(gram, 3, (1, 2))[0, 0]
    assert projected(gram, 3, (1, 2))[0, 0] == pytest.approx(gram[0, 0])
    assert FARTHEST >= 4.0  # one in a million of what is within the spread


@pytest.fixture(scope="module")
def flights() -> list[Reconstruction]:
    """Two flights of one aircraft at two speeds."""
    made = []
    for speed in (55.0, 70.0):
        chosen = scenario.load("clear_air", duration=20.0, initial={"airspeed": speed},
                               parameters={"turbulence_sigma_w": 0.0})
        made.append(reconstruct(fly(chosen, seed=3, observer=False, protection=False).record))
    return made


@pytest.mark.parametrize(("name", "least"), [("thrust_loss", 0.01), ("asymmetric_thrust", 0.1), ("mass_error", 0.1),
                                             ("wing_ice", 0.1), ("elevator_power", 0.1)])  # fmt: skip
def test_what_an_effect_does_to_forces_and_moments_is_at_its_home(flights, name, least):
    """Lost thrust takes little lift with it, by the slipstream on the wing: of a large loss, that shows."""
    size = effects.get(name).neutral() | {p.name: p.typical for p in effects.get(name).parameters if p.typical}
    changed = changed_places(flights, {name: size})
    most = max(changed.values())
    assert most > 0.0 and {place for place, rms in changed.items() if rms > least * most} <= home([name])


def course(flight: Reconstruction, name: str) -> np.ndarray:
    return pushes(flight, [Term("pitching_moment", name, "q", 1)])[0].series


def test_a_term_is_one_function_of_its_regressor_in_all_records(flights):
    """As an acceleration it goes with dynamic pressure; as a coefficient it is the same at the same angle of attack."""
    slow, fast = in_common(flights)
    assert slow.about == fast.about
    for flight in (slow, fast):
        unit = course(flight, "1")
        speed = flight.channel("airspeed")
        assert unit / unit[0] == pytest.approx((speed / speed[0]) ** 2)
        coefficient = course(flight, "alpha*alpha") / unit
        deviation = (flight.channel("alpha") - slow.about["alpha"]) / 0.05
        assert coefficient == pytest.approx(deviation**2 / slow.reach["alpha*alpha"])
    assert np.mean(course(slow, "airspeed")) < 0.0 < np.mean(course(fast, "airspeed"))
    assert slow.reach == fast.reach and min(slow.reach.values()) >= 1.0
    for name in ("airspeed", "alpha*alpha*alpha", "elevator*elevator*elevator"):
        both = np.concatenate([course(f, name) / course(f, "1") for f in (slow, fast)])
        assert np.sqrt(np.mean(both**2)) <= 1.0 + 1e-9  # no flight with a cube that nothing reaches
    own = replace(slow, about={})
    assert abs(np.median(course(own, "airspeed") / course(own, "1"))) < 1e-6


def test_a_mode_rings_after_what_shakes_it_and_says_nothing_of_the_sample_itself(flights):
    """A tenth of the reading where it is shaken at the mode's own frequency, a quarter apart."""
    flight, hertz = flights[0], 3.0
    time = flight.time - flight.time[0]
    measured = flight.measured.copy()
    measured[:, MEASURED.index("az")] = np.sin(2.0 * np.pi * hertz * time)
    shaken = replace(flight, measured=measured)

    def rings(of: Reconstruction) -> list[np.ndarray]:
        terms = [Term("sensor:az", f"{kind}:{hertz:g}", "az", 1) for kind in ("rings", "rings_late")]
        return [push.series for push in pushes(of, terms)]

    settled = slice(round(4.0 / flight.dt), None)
    both = [series[settled] for series in rings(shaken)]
    for series in both:
        assert np.sqrt(2.0 * np.mean(series**2)) == pytest.approx(0.1, rel=0.02)
    assert abs(np.corrcoef(*both)[0, 1]) < 0.02
    measured[-1] += 5.0
    for before, after in zip(rings(shaken), rings(replace(flight, measured=measured)), strict=True):
        assert np.array_equal(before, after)


def test_a_rate_of_the_flow_is_that_of_its_angle(flights):
    flight = flights[0]
    time = flight.time - flight.time[0]
    measured = flight.measured.copy()
    measured[:, MEASURED.index("alpha")] = 0.02 * time
    steady = values_of(replace(flight, measured=measured), "alpha_dot")
    assert steady[round(1.0 / flight.dt) :] == pytest.approx(0.02, rel=1e-3)


def test_thrust_counts_as_a_coefficient(flights):
    slow, fast = in_common(flights)
    per_unit = [np.median(course(f, "CT") / course(f, "1")) for f in (slow, fast)]
    assert per_unit[0] * per_unit[1] < 0.0  # one below the median of both, one above


@pytest.fixture(scope="module")
def bent() -> tuple[Flying, Bent]:
    """A flight whose pitching moment is off by a constant, ten deviations of the model's own, and nothing said.

    Nothing but derivatives and the vanes gives way here: no offset, and no thrust line.
    """
    chosen = scenario.load("clear_air", duration=24.0, parameters={"turbulence_sigma_w": 0.0},
                           effects={"discrepancy": {"Cm_0": 0.02}})  # fmt: skip
    flight = in_common([reconstruct(fly(chosen, seed=3, observer=False, protection=False).record)])[0]
    with pytest.MonkeyPatch.context() as only:
        for name in ("RIGGING", "TOLD_ONCE"):
            only.setattr(library, name, {})
        only.setattr(library, "INSTRUMENTS", library.SCALES)
        candidates = replace(bank(), families=())
    evidence = gather(flight, candidates)
    baseline = Baseline(load(), np.eye(len(candidates.nuisances)))
    flying = Flying([flight], candidates, [evidence], baseline, 1.0,
                    Courses([Course(evidence)], 1.0, candidates.terms))
    nothing = SetFit(misfit=float(evidence.gram[0, 0]))
    point = flying.settle(nothing, np.zeros(len(candidates.nuisances)))
    return flying, Bent(point, flying.left_over(nothing, point))


def test_no_nuisance_goes_farther_than_it_may(bent):
    _, flown = bent
    assert np.max(np.abs(flown.point.nuisances)) <= FARTHEST + 1e-9
    assert len(flown.point.held) and flown.left.held == tuple(1 + flown.point.held)


def test_terms_flown_find_what_there_is_and_let_the_nuisances_go(bent):
    """Held nuisances take what they can of a moment; flown with its term, they are what they were."""
    flying, flown = bent
    rows = [1 + j for j, term in enumerate(flying.candidates.terms) if term.component == "pitching_moment"]
    there = bring(flying, SetFit(misfit=0.0), flown, rows, np.full(len(rows), 10.0))
    assert len(there.point.held) == 0 < len(flown.point.held)
    before, after = (float(one.left.gram[0, 0]) for one in (flown, there))
    noise = flying.evidences[0].samples
    assert after < 1.1 * noise < before


def test_something_unknown_is_worth_what_it_is_where_it_is_flown(bent):
    flying, flown = bent
    terms = tuple(replace(term, row=1 + j) for j, term in enumerate(flying.candidates.terms))
    found = {u.component: u for u in fit_unknown(flown.left.reduced(), replace(flying.candidates, terms=terms))}
    linear = found["pitching_moment"]
    there, point = flown_unknown(flying, SetFit(misfit=0.0), flown, linear)
    assert there.log_evidence > linear.log_evidence and there.misfit < linear.misfit
    far, near = (float(np.sum(at.settled.nuisances**2)) for at in (flown.point, point))
    assert near < 0.5 * far  # the model's own numbers have let go of what the terms say
    ((name, coefficient, error),) = there.terms  # of the moment that was flown, which the linear fit has a third of
    assert name == "1" and abs(coefficient - 0.02 / GENERIC_SIZE["q"]) < 3.0 * error
    path = found.get("elevator_path", replace(linear, component="elevator_path"))
    untouched = flown_unknown(flying, SetFit(misfit=0.0), flown, path)  # judged on commands alone, exactly linear
    assert untouched[0] is path and untouched[1] is flown.point


@pytest.mark.parametrize("few", [True, False])
def test_a_form_of_powers_alone_is_flown_with_these_alone(bent, monkeypatch, few):
    flying, flown = bent
    terms, flew = flying.candidates.terms, list[list[int]]()
    rows = [1 + j for j, term in enumerate(terms) if term.component == "pitching_moment"]
    power = SetFit(tuple(f for f in bank().families if f.effect.name == "elevator_power"))
    monkeypatch.setattr(in_form, "gain", lambda *_, **__: Form((0.0, 1e3), (0.0, 0.0), few=few))
    monkeypatch.setattr(in_form, "bring", lambda _flying, _fit, there, chosen, _variance: flew.append(chosen) or there)
    in_form.other_form(flying, power, flown, rows, np.ones(len(rows)), (0.4,))
    (chosen,) = flew
    powers = [row for row in rows if terms[row - 1].name in ("elevator", "elevator*elevator",
                                                             "elevator*elevator*elevator")]  # fmt: skip
    assert chosen == powers if few else len(chosen) > 2 * len(powers) == 6
