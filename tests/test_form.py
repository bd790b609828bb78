"""What another form of a known effect may take, and what it may not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from icing_env import effects
from sim2real.library.bends import bends, natural, of_own
from sim2real.library.candidates import bank
from sim2real.library.terms import BEYOND, GENERIC
from sim2real.library.units import unit_of
from sim2real.posterior.form import (
    ALIKE,
    DIRECTIONS,
    FORGIVEN,
    INEXACT,
    LEAK,
    LUCK,
    OF_FORM,
    SHARES,
    Form,
    Liberty,
    forgiven,
    own_terms,
    with_terms,
)
from sim2real.posterior.generic import UnknownFit, fit_unknown
from sim2real.posterior.home_terms import gain, without
from sim2real.posterior.home_terms import given as after_terms
from sim2real.posterior.hypotheses import Hypothesis, is_home
from sim2real.posterior.likeness import PURE, SHAPE, alike, calibration, foreign, is_own, like
from sim2real.posterior.sets import SetFit

TERMS = 6


def products(seed: int, left: float) -> np.ndarray:
    """Inner products of TERMS random signatures and a residual `left` standard deviations along the first."""
    rng = np.random.default_rng(seed)
    columns = 10.0 * rng.standard_normal((200, TERMS)) / np.sqrt(200.0)
    residual = left * columns[:, 0] / np.linalg.norm(columns[:, 0])
    whole = np.column_stack([residual, columns])
    return whole.T @ whole


@given(st.integers(0, 100), st.floats(0.0, 200.0), st.floats(0.0, 1e4))
def test_a_form_takes_no_more_than_its_share_of_the_effect(seed: int, left: float, energy: float) -> None:
    gram = products(seed, left)
    misfit = float(gram[0, 0])
    found = gain(gram[1:, 1:], gram[1:, 0], np.full(TERMS, energy / TERMS), misfit)
    assert max(found.gained) <= 0.5 * max(SHARES) ** 2 * energy + 1e-9
    assert misfit - max(SHARES) ** 2 * energy - 1e-9 <= found.least <= misfit + 1e-9
    assert found.left[0] == misfit and found.gained[0] == pytest.approx(-np.log(len(found.gained)))


def test_a_remainder_within_the_share_is_taken_and_costs_little() -> None:
    gram = products(1, 20.0)
    found = gain(gram[1:, 1:], gram[1:, 0], np.full(TERMS, 60.0**2 / TERMS), 20.0**2)
    assert 0.5 * 20.0**2 - 25.0 < max(found.gained) < 0.5 * 20.0**2
    assert found.least < 10.0
    assert gain(gram[1:, 1:], gram[1:, 0], np.zeros(TERMS), 20.0**2) == Form((0.0,), (20.0**2,))


@given(st.floats(0.0, 1e4), st.floats(0.0, 1e6), st.floats(0.0, 1e4), st.floats(0.0, 1e3))
def test_what_is_forgiven_never_exceeds_what_is_left_nor_its_share(left, explained, foreign, more):
    got = forgiven(left, explained, foreign)
    assert -1e-9 <= got <= 0.5 * min(left, FORGIVEN**2 * explained) + 1e-9
    assert forgiven(left, explained, foreign + more) <= got + 1e-9  # a reason elsewhere is no excuse
    assert 0.5 * (left + more) - forgiven(left + more, explained, foreign) >= 0.5 * left - got - 1e-6  # less is better


def test_a_small_remainder_is_not_forgiven_and_a_large_one_costs_its_logarithm():
    assert forgiven(2.0, 1e6) < 0.1
    costs = [0.5 * left - forgiven(left, 1e6) for left in (100.0, 1000.0, 10000.0)]
    assert costs == pytest.approx([0.5 * DIRECTIONS * np.log1p(left / DIRECTIONS) for left in (100, 1000, 10000)])
    assert forgiven(20.0, 1e6, 20.0) == forgiven(20.0, 1e6)  # within the leak
    assert forgiven(1000.0, 1e6, 1000.0) < 0.5 * LEAK**2 * 1e6
    assert forgiven(1000.0, 1e6, 0.0, 4) < forgiven(1000.0, 1e6)  # more places, more ways to explain anything


@given(st.floats(0.0, 1e4), st.floats(0.0, 1e4))
def test_what_no_course_at_home_could_make_is_not_forgiven(left, free):
    """A second effect elsewhere must not hide in the form of the first."""
    form, noise, explained = Form((0.0,), (6e4 + left,), (Liberty(free, beyond=6e4 + left - free),)), 6e4, 1e6
    got = form.regained(6e4 + left + explained, noise, noise)
    most = min(left, free + LEAK**2 * explained)
    assert got <= 0.5 * most + 1e-6
    assert form.bare() == pytest.approx(min(6e4 + left, 6e4 + left - free + LUCK))


@given(st.floats(0.0, 1e4), st.floats(0.0, 1e3))
def test_only_another_form_at_home_leaves_much_elsewhere(left, home):
    """A large effect in the library's form is no excuse for a second one: of a small one it would leave nothing."""
    explained, noise = 1e8, 6e4
    form = Form((0.0,), (noise + home + left,), (Liberty(home, beyond=noise + left),))
    got = form.regained(noise + home + left + explained, noise, noise)
    assert got <= 0.5 * (home + min(left, max(INEXACT**2 * explained, OF_FORM**2 * home))) + 1e-6
    bent = Form((50.0 * left,), (noise + left,), (Liberty(0.0, beyond=noise + left),))
    if left < 0.5 * LEAK**2 * explained:
        assert bent.regained(noise + left + explained, noise, noise) == pytest.approx(50.0 * left + forgiven(left, 1e8))


@given(st.floats(0.0, 1e4), st.floats(0.0, 1e4))
def test_a_member_that_explains_little_is_forgiven_little(left, most):
    """Else whatever has a home at the right place would be named beside the true effect."""
    free = Form((0.0,), (6e4 + left,), (Liberty(np.inf, 1, most),))
    assert free.regained(1e6, 6e4) <= 0.5 * min(left, most) + 1e-6


def test_what_terms_take_of_noise_is_luck():
    """Else the best explanation seems to leave less than noise, and every other one to leave too much."""
    rng = np.random.default_rng(4)
    columns = 10.0 * rng.standard_normal((200, TERMS)) / np.sqrt(200.0)
    taken = []
    for _ in range(400):
        noise = rng.standard_normal(200)
        whole = np.column_stack([noise, columns])
        gram = whole.T @ whole
        taken.append(gram[0, 0] - gain(gram[1:, 1:], gram[1:, 0], np.full(TERMS, 1e4), float(gram[0, 0])).least)
    assert np.mean(taken) < 0.5 * TERMS  # the worst of several ways; without luck all of TERMS and more


def test_terms_given_their_room_take_what_the_evidence_says_they_take() -> None:
    gram = products(1, 20.0)
    square = np.full(TERMS, 60.0**2 / TERMS)
    after = after_terms(gram, list(range(1, TERMS + 1)), square, SHARES[1])
    form = gain(gram[1:, 1:], gram[1:, 0], square, 20.0**2)
    assert 0.0 < after[0, 0] < 0.2 * gram[0, 0]
    assert form.left[2] <= after[0, 0] + TERMS  # the evidence's own square has its prior's share beside it, luck apart


def test_each_way_is_judged_by_what_was_free_where_it_was_flown() -> None:
    """Two members have two shares, of one more way beside them nothing is flown."""
    strict, easy = (Liberty(beyond=beyond) for beyond in (400.0, 0.0))
    own = UnknownFit("z_force", 0.0, (), 300.0, {})
    form = with_terms(Form((0.0,) * 3, (300.0,) * 3, (strict,), bent=(easy,)), own)
    assert form is not None
    ways = [form.way(k, 1e4, 0.0, 0.0) - form.gained[k] for k in range(4)]
    assert ways[0] == ways[3] < ways[1] == ways[2]


def test_sizes_give_way_before_a_form_is_judged() -> None:
    """A remainder along an effect's own signature is a matter of its size."""
    rng = np.random.default_rng(2)
    slope, term = rng.standard_normal((2, 300))
    whole = np.column_stack([3.0 * slope, slope, term])
    inner, onto = without(whole.T @ whole, 2)
    assert np.abs(onto[0]) < 0.01 * np.abs(whole[:, 0] @ term) + 0.1
    assert inner[0, 0] == pytest.approx(term @ term - (term @ slope) ** 2 / (slope @ slope + 1e-2))


def test_every_effect_has_terms_where_it_enters_and_every_term_a_unit() -> None:
    terms = bank().terms
    for name in effects.LIBRARY:
        if name != "turbulence":
            assert own_terms([name], terms), name
    known = {component for component, _, _ in (*GENERIC, *BEYOND)}
    assert {c for alike in ALIKE.values() for c in alike} <= known
    assert all(unit_of(term.name, term.component) > 0.0 for term in terms)


def test_one_term_is_found_alone_where_one_is_enough() -> None:
    candidates = bank()
    at = [t for t in candidates.terms if t.component == "pitching_moment"]
    rng = np.random.default_rng(3)
    columns = 3.0 * rng.standard_normal((400, len(at))) / np.sqrt(400.0)
    residual = 8.0 * columns[:, 2] / np.linalg.norm(columns[:, 2])
    gram = np.zeros((candidates.size, candidates.size))
    rows = [0, *(t.row for t in at)]
    whole = np.column_stack([-residual, columns])
    gram[np.ix_(rows, rows)] = whole.T @ whole
    (found,) = [u for u in fit_unknown(gram, candidates) if u.component == "pitching_moment"]
    assert [name for name, _, _ in found.terms] == [at[2].name]
    assert found.log_evidence > 10.0


def test_a_form_is_a_function_of_what_its_effect_is_one_of():
    """Ice on one wing yaws with alpha and thrust, never with a rudder; a constant may be anything."""
    ice, trim, pitch = (effects.LIBRARY[name] for name in ("asymmetric_ice", "pitch_trim", "pitch_damping"))
    assert not natural(ice, "yawing_moment", "rudder")
    assert natural(ice, "rolling_moment", "alpha*alpha")
    assert natural(trim, "pitching_moment", "alpha*elevator")
    assert natural(pitch, "pitching_moment", "alpha*q")
    assert not natural(pitch, "pitching_moment", "elevator")


def test_a_scale_is_a_function_of_its_own_reading_and_a_bias_of_none():
    speed, gyro, vane = (effects.LIBRARY[name] for name in ("airspeed_scale", "pitch_gyro_bias", "alpha_scale"))
    assert natural(speed, "sensor:airspeed", "airspeed*airspeed")
    assert not natural(speed, "sensor:airspeed", "alpha")
    assert natural(gyro, "sensor:q", "time")
    assert not natural(gyro, "sensor:q", "az")
    assert bends(vane) == {("sensor:alpha", "alpha*alpha")}
    rows = {term.name: term.row for term in bank().terms if term.component == "sensor:alpha"}
    raw = np.eye(max(rows.values()) + 1)
    bent, other = (UnknownFit("sensor:alpha", 0.0, tuple((name, w, 0.1) for name, w in terms), 0.0,
                              {rows[name]: w for name, w in terms})
                   for terms in ((("alpha*alpha", 1.0), ("q", 0.2)), (("alpha*alpha", 0.2), ("q", 1.0))))
    assert calibration("alpha_scale", bent, raw)
    assert not calibration("alpha_scale", other, raw)
    assert not calibration("alpha_bias", bent, raw)
    assert not calibration("static_stability", bent, raw)


def test_an_offset_that_drifts_is_the_bias_though_a_calibration_leaves_most_of_its_mean():
    rows = {term.name: term.row for term in bank().terms if term.component == "sensor:beta"}
    raw = np.eye(max(rows.values()) + 1)
    drift, other = (UnknownFit("sensor:beta", 4000.0, tuple((name, w, 0.1) for name, w in terms), 0.0,
                               {rows[name]: w for name, w in terms})
                    for terms in ((("time", 1.0), ("1", 1.0), ("alpha", 0.3)), (("alpha", 1.0), ("1", 0.3))))
    families = tuple(f for f in bank().families if f.effect.name == "beta_bias")[:1]
    bias = Hypothesis(SetFit(families, weights={}), None, 0.0, 0.0)
    for explained in (250.0, -40.0):  # of 8000: the rest of the mean is taken for what a calibration leaves
        assert is_home(bias, drift, 8000.0, explained, raw)
        assert not is_home(bias, other, 8000.0, explained, raw)


def test_what_small_commands_lose_is_no_form_of_a_gearing():
    rows = {term.name: term.row for term in bank().terms if term.component == "aileron_path"}
    raw = np.eye(max(rows.values()) + 1)
    dead, bent = (UnknownFit("aileron_path", 0.0, tuple((name, w, 0.1) for name, w in terms), 0.0,
                             {rows[name]: w for name, w in terms})
                  for terms in ((("side", -0.6), ("position", 0.2)), (("position", 1.0), ("side", 0.2))))
    assert foreign("aileron_gearing", dead, raw)
    assert not foreign("aileron_gearing", bent, raw)
    whole = next(f for f in bank().families if f.effect.name == "aileron_gearing")
    raw = np.eye(1 + max(*rows.values(), *whole.rows))
    geared = Hypothesis(SetFit((whole,), weights={whole.rows[0]: 1.0}), None, 0.0, 0.0)
    assert not is_home(geared, dead, 1000.0, 700.0, raw)
    assert is_home(geared, dead, 1000.0, 900.0, raw)  # what explains nearly all is the cause, whatever is left
    assert is_home(geared, bent, 1000.0, 700.0, raw)
    for least, so in ((60.0, True), (140.0, False)):  # of 1000 that the terms explain, nothing left over by them
        formed = replace(geared, form=Form((0.0,), (least,)))
        assert is_home(formed, dead, 1000.0, 700.0, raw) is so  # in its own form it says nearly all that they do
        assert not is_home(formed, dead, 1000.0, 550.0, raw)  # alone it says no more than what is like it would


def test_terms_are_an_effect_for_their_shape_where_they_are_of_its_own_regressors():
    """Lift that lags looks like lift and is none of it; a power of its regressor is a derivative that bends."""
    rows = {term.name: term.row for term in bank().terms if term.component == "z_force"}
    lift = next(f for f in bank().families if f.effect.name == "lift_slope")
    raw = np.eye(1 + max(*rows.values(), *lift.rows))
    one = SetFit((lift,), weights={lift.rows[0]: 1.0})
    slope, lag = rows["alpha"], rows["alpha_dot"]
    for row in (slope, lag, rows["alpha*alpha"]):
        raw[row, lift.rows[0]] = raw[lift.rows[0], row] = 0.95  # the model's own numbers make them alike

    def some(terms: dict[str, float]) -> UnknownFit:
        return UnknownFit("z_force", 0.0, tuple((name, w, 0.1) for name, w in terms.items()), 0.0,
                          {rows[name]: w for name, w in terms.items()})

    assert like(one, some({"alpha*alpha": 1.0}), raw, 0.01)
    assert like(one, some({"alpha": 1.0}), raw, 0.4) and not like(one, some({"alpha": 1.0}), raw, 0.05)
    assert not like(one, some({"alpha_dot": 1.0}), raw, 0.4)
    assert alike(one, some({"alpha_dot": 1.0}), raw) > SHAPE


def test_terms_of_nothing_but_its_own_regressors_are_an_effect_that_explains_nearly_half_of_them():
    """Whatever their shape: drag that bends with the angle of attack is no line of its square."""
    rows = {term.name: term.row for term in bank().terms if term.component == "x_force"}
    drag = next(f for f in bank().families if f.effect.name == "drag_due_to_lift")
    raw, one = np.eye(1 + max(*rows.values(), *drag.rows)), SetFit((drag,), weights={drag.rows[0]: 1.0})
    for names, own in ((("1", "alpha", "alpha*alpha"), True), (("alpha", "alpha*alpha", "airspeed"), False)):
        terms = UnknownFit("x_force", 0.0, tuple((n, 1.0, 0.1) for n in names), 0.0, {rows[n]: 1.0 for n in names})
        assert alike(one, terms, raw) == 0.0
        assert like(one, terms, raw, 1.1 * PURE) is own and not like(one, terms, raw, 0.9 * PURE)


def test_the_moment_of_power_at_an_angle_is_not_of_the_moment_of_power_alone():
    power = effects.LIBRARY["power_pitching"]
    assert natural(power, "pitching_moment", "alpha*CT") and not of_own(power, "pitching_moment", "alpha*CT")
    assert of_own(power, "pitching_moment", "CT")
    assert of_own(effects.LIBRARY["mass_error"], "z_force", "alpha*alpha")  # whatever a load does to it


def test_company_neither_widens_nor_narrows_the_form_of_a_member():
    """A third of what an effect explains may be its own form, with a small effect beside it as without."""
    families = {f.effect.name: f for f in bank().families}
    whole, small = families["elevator_lag"], families["mass_error"]
    raw = np.eye(1 + max(*whole.rows, *small.rows))
    course = UnknownFit("elevator_path", 1500.0, (("course", 1.0, 0.1),), 5800.0, {})
    pair = SetFit((whole, small), weights={whole.rows[0]: 1.0, small.rows[0]: 1.0}, misfit=9000.0)
    one = SetFit((whole,), weights={whole.rows[0]: 1.0}, misfit=9100.0)
    assert is_own(one, course, 19_000.0, raw, [9900.0])
    assert is_own(pair, course, 19_000.0, raw, [9900.0, 100.0])
    assert not is_own(pair, course, 19_000.0, raw, [100.0, 9900.0])  # the small one's home is no room for the large
