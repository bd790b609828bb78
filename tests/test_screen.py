"""Effects flown to where they fit before explanations are ranked: side by side as one by one, and along valleys."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from icing_env import effects, scenario
from icing_env.aircraft import load
from sim2real.baseline.references import Baseline
from sim2real.flown.companions import without
from sim2real.flown.points import Flying
from sim2real.flown.steps import Places, Point
from sim2real.flown.valleys import lowest
from sim2real.library.candidates import Family, bank, nodes
from sim2real.library.pushes import in_common
from sim2real.posterior.sets import SetFit
from sim2real.prediction.predictor import LOST, with_spare
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.signatures.courses import Course, Courses
from sim2real.signatures.evidence import gather
from testbed.flight import fly

WHOLE = bank()
NUMBERS = [n.parameter for n in WHOLE.nuisances]
NOTHING = SetFit(misfit=1e6)


def flown(changed: dict[str, dict[str, float]]) -> Reconstruction:
    """A flight in gusts by an aircraft with some effects."""
    chosen = scenario.load("clear_air", duration=24.0, parameters={"turbulence_sigma_w": 0.5}, effects=changed)
    return in_common([reconstruct(fly(chosen, seed=5, observer=False, protection=False).record)])[0]


def a_set(**sizes: float) -> SetFit:
    """Effects by name at sizes of their first parameter."""
    families = []
    for name in sizes:
        effect = effects.get(name)
        parameter = effect.parameters[0]
        families.append(Family(effect, parameter, nodes(parameter), (), parameter.low, parameter.high))
    at = tuple(sizes.values())
    return SetFit(tuple(families), 0.0, at, at, at, np.diag([1e-4] * len(at)), {}, 1e9)


@pytest.fixture(scope="module")
def flying() -> Flying:
    flight, candidates = flown({"directional_stability": {"change": -0.35}}), replace(WHOLE, families=())
    evidence = gather(flight, candidates)
    baseline = Baseline(load(), np.eye(len(candidates.nuisances)))
    return Flying([flight], candidates, [evidence], baseline, 1.0,
                    Courses([Course(evidence)], 1.0, candidates.terms))


def test_sets_flown_side_by_side_cost_what_each_does_alone(flying):
    rng, n = np.random.default_rng(1), len(WHOLE.nuisances)
    sets = [NOTHING, a_set(directional_stability=-0.2), a_set(tail_ice=0.1, roll_trim=0.002),
            a_set(elevator_lag=0.08), a_set(alpha_bias=0.01)]  # fmt: skip
    asked = [(fit, np.array(fit.estimate), 0.3 * rng.standard_normal(n)) for fit in sets]
    for (fit, sizes, nuisances), point in zip(asked, flying.points(asked), strict=True):
        alone = flying.point(fit, sizes, nuisances, flying.near)
        assert point.cost == pytest.approx(alone.cost, abs=0.2)  # a path's low pass is the model's own there
        if fit.effects != ("elevator_lag",):
            assert point.slope == pytest.approx(alone.slope, rel=1e-6, abs=1e-6 * np.abs(alone.slope).max())
            assert point.information == pytest.approx(alone.information, rel=1e-6,
                                                      abs=1e-6 * np.abs(alone.information).max())  # fmt: skip


def test_side_by_side_they_descend_to_where_each_descends_alone(flying):
    """The effect to blame ends lowest although it starts as no other does, and none by more than a step's worth."""
    start = np.zeros(len(WHOLE.nuisances))
    sets = [NOTHING, a_set(directional_stability=-0.05), a_set(side_force=-0.1)]
    found = flying.descended(sets, [start] * len(sets))
    for fit, point in zip(sets, found, strict=True):
        assert point.cost == pytest.approx(flying.settle(fit, start).cost, abs=1.0)
    none, right, wrong = (point.cost for point in found)
    assert right < none - 5.0 and right < wrong - 5.0
    assert found[1].sizes[0] == pytest.approx(-0.35, abs=0.12)


derivative = st.sampled_from(["lift_slope", "static_stability", "pitch_damping", "roll_damping", "side_force",
                              "directional_stability", "aileron_power", "elevator_power", "tail_ice", "wing_ice"])


@given(derivative, st.floats(-1.0, 1.0), st.integers(0, 10**6))
def test_along_a_valley_the_aircraft_stays_what_it_is(flying, name, share, seed):
    parameter = effects.get(name).parameters[0]
    end = parameter.high if share > 0.0 else parameter.low
    fit = a_set(**{name: parameter.neutral + 0.8 * abs(share) * (end - parameter.neutral)})
    nuisances = np.clip(1.5 * np.random.default_rng(seed).standard_normal(len(NUMBERS)), -4.0, 4.0)
    (flight,), precision = flying.flights, flying.baseline.precision
    place = lowest(flight, WHOLE, precision, fit, (np.array(fit.estimate), nuisances))
    assume(place is not None)
    sizes, moved = place
    assert moved @ moved < nuisances @ nuisances
    assert parameter.low <= sizes[0] <= parameter.high and np.abs(moved[nuisances != moved]).max() <= 5.0
    before, after = (aircraft_of(flight, fit, *at) for at in ((np.array(fit.estimate), nuisances), place))
    changed = [number for number in NUMBERS if "+" not in number]
    assert [after[n][0] for n in changed] == pytest.approx([before[n][0] for n in changed], rel=1e-9, abs=1e-12)


def aircraft_of(flight: Reconstruction, fit: SetFit, sizes: np.ndarray, nuisances: np.ndarray) -> np.ndarray:
    row = flight.parameters.copy()
    for nuisance, size in zip(WHOLE.nuisances, nuisances, strict=True):
        nuisance.apply(row, 0, flight.power_from, float(size))
    return effects.with_effects(row, {f.effect.name: {f.parameter.name: size}
                                      for f, size in zip(fit.families, sizes, strict=True)})  # fmt: skip


def test_the_published_effect_of_a_bent_model_is_found_again(flying):
    """A lift slope 29 % low, told as 6 % with the model's own five deviations low, goes back to within one."""
    nuisances = np.zeros(len(NUMBERS))
    at = NUMBERS.index("CZ_alpha")
    nuisances[at] = -5.0
    told = a_set(lift_slope=-0.06)
    place = lowest(flying.flights[0], WHOLE, np.eye(len(NUMBERS)), told, (np.array([-0.06]), nuisances))
    assert place is not None
    assert place[0][0] == pytest.approx(0.94 * 0.75 - 1.0, abs=0.05)
    assert abs(place[1][at]) < 1.0


def test_a_row_that_flies_to_no_numbers_is_the_farthest_from_any_record(flying):
    """Not the nearest: what has no number was counted as not measured, and explained a record wholly."""
    (flight,), (evidence,) = flying.flights, flying.evidences
    rows = np.repeat(flight.parameters, 3)
    rows["CZ_alpha"][1] = np.nan
    left = with_spare(flight, rows, evidence.gain.K)
    measured = np.isfinite(flight.measured[1:])
    assert np.isfinite(left[:, 0][measured]).all() and np.isfinite(left[:, 2][measured]).all()
    assert np.max(left[:, 1][measured]) == LOST and np.isnan(left[:, 1][~measured]).all()
    point = flying.point(NOTHING, np.zeros(0), np.zeros(len(NUMBERS)))
    assert np.isfinite(point.cost)


def test_a_set_without_a_member_is_the_rest_of_it_as_it_was():
    both = a_set(tail_ice=0.1, roll_trim=0.002)
    for m, (name, size) in enumerate([("roll_trim", 0.002), ("tail_ice", 0.1)]):
        rest = without(both, m)
        assert rest.effects == (name,) and rest.estimate == (size,) and rest.low95 == (size,)
        assert rest.covariance == pytest.approx(np.array([[1e-4]]))


def test_a_set_begins_where_it_settled_whichever_member_is_named_first():
    places, one, other = Places(), a_set(pitch_trim=0.0, mass_error=0.0), a_set(mass_error=0.0, pitch_trim=0.0)
    nuisances = np.ones(3)
    point = Point(np.array([0.01, 0.2]), nuisances, 0.0, np.zeros(2), np.eye(2), np.zeros(2))
    places.keep(one, point)
    assert places.begin(other, np.zeros(3))[0].estimate == (0.2, 0.01)
    assert places.begin(other, np.zeros(3))[1] is nuisances
    assert places.begin(a_set(pitch_trim=0.0), np.zeros(3))[0].estimate == (0.0,)
