"""Kinds of gusts: each is told from the others, and none of them is blamed on the aircraft."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import scenario
from icing_env.aircraft import load
from icing_env.record import FlightRecord
from sim2real.baseline.fit import in_any_gusts
from sim2real.baseline.references import Baseline, directions, uncertain
from sim2real.diagnosis import diagnose
from sim2real.flown import first_guess, settling
from sim2real.flown.first_guess import Guess, likeliest_guess
from sim2real.flown.settling import Followed, followed_in_any, likeliest_explained
from sim2real.library.candidates import bank
from sim2real.prediction.correction import ROTATION
from sim2real.prediction.gusts import KINDS, LATER, Kind
from sim2real.prediction.kalman import gains
from sim2real.prediction.predictor import TANGENT, innovations
from sim2real.records.reconstruct import reconstruct
from sim2real.signatures.gust_intensity import SIGMAS, choose_gain, kind_at_first
from testbed.flight import fly


@cache
def flown(seed: int, sigma: float, kind: Kind = LATER, stability: float = 1.0, trim: float = 0.0, roll: float = 0.0,
          elevator: float = 1.0, lag: float = 1.0) -> FlightRecord:  # fmt: skip
    """`stability`, `elevator`, `lag`: shares of the published Cm_alpha, Cm_elevator, Cm_alphadot; rest: added to it."""
    weather = {"turbulence_sigma_w": sigma, "turbulence_tail_delay": float(kind.tail_delay),
               "turbulence_rotation": float(kind.rotation), "Cm_alpha": stability * float(load()["Cm_alpha"][0]),
               "Cm_elevator": elevator * float(load()["Cm_elevator"][0]), "Cm_0": trim + float(load()["Cm_0"][0]),
               "Cl_0": roll + float(load()["Cl_0"][0]), "Cm_alphadot": lag * float(load()["Cm_alphadot"][0])}
    chosen = scenario.load("clear_air", duration=52.0, parameters=weather)
    return fly(chosen, seed=seed, observer=False, protection=False).record


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sigma", [0.5, 1.5])
def test_innovations_of_the_true_model_are_white_and_of_their_predicted_size(sigma, kind):
    """At 1.5 m/s the gusts double the apparent noise of az, which must not be taken for noise."""
    flight = reconstruct(flown(5, sigma, kind))
    gain = gains(flight, (sigma,), kind)[0].with_start()
    left = innovations(flight, flight.parameters, gain.K, (), kind)[200:, 0, :11].astype(float)
    size = np.mean(left**2, axis=0) / np.diag(gain.S)[:11]
    assert np.all((size > 0.6) & (size < 1.3))
    following = [np.corrcoef(c[1:], c[:-1])[0, 1] for c in left.T]
    assert np.max(np.abs(following)) < 0.2


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sigma", [0.5, 1.5])
def test_the_kind_of_gusts_is_told(sigma, kind):
    """Taken for another, gusts are found twice as strong, and what they do at the tail or to roll is blamed."""
    flight = reconstruct(flown(5, sigma, kind))
    (gain,) = likeliest_explained([flight], [choose_gain(flight, SIGMAS)], [()])
    assert gain.gusts.kind == kind
    assert gain.sigma == pytest.approx(sigma, rel=0.25)


@pytest.mark.parametrize("kind", [LATER, KINDS[2]])
@pytest.mark.parametrize("sigma", [1.0, 1.8])
def test_the_kind_is_told_of_an_aircraft_with_a_gap_before_anything_is_known(sigma, kind):
    """With the gap, which is no gust, only the strongest gusts make sense of 1.8 m/s, whichever kind they are of."""
    assert kind_at_first([reconstruct(flown(5, sigma, kind, 0.7))]) == kind


@pytest.mark.parametrize(("kind", "taken_for"), [(KINDS[1], KINDS[3]), (KINDS[3], KINDS[1])])
def test_weak_gusts_that_turn_the_air_are_not_kept_for_another_such_kind(kind, taken_for):
    """That the air turns was paid for: which of both kinds it is, the likelihood says."""
    flight = reconstruct(flown(5, 0.35, kind))
    (gain,) = likeliest_explained([flight], [choose_gain(flight, SIGMAS, (), taken_for)], [()])
    assert gain.gusts.kind == kind


@pytest.mark.parametrize(("seed", "sigma", "stability"), [(3, 0.5, 0.8), (8, 1.2, 1.0)])
def test_of_kinds_that_turn_the_air_none_is_asked_for_more(seed, sigma, stability):
    """They differ in how strong gusts look, and that they turn the air has been paid for."""
    flight = reconstruct(flown(seed, sigma, KINDS[1], stability))
    (gain,) = likeliest_explained([flight], [choose_gain(flight, SIGMAS, (), KINDS[3])], [()])
    assert gain.gusts.kind == KINDS[1]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sigma", [0.3, 0.5])
def test_the_model_settles_in_gusts_of_the_right_kind(sigma, kind):
    """With a gap in it, air that turns passes for gusts that do not turn it, some of them several times as strong."""
    flights, candidates = [reconstruct(flown(4, sigma, kind, 0.8))], bank()
    baseline = Baseline(load(), np.eye(len(candidates.nuisances)))
    (way,) = followed_in_any(flights, candidates, baseline, kind_at_first(flights))
    (gain,) = way.known
    assert gain.gusts.kind == kind
    assert gain.sigma == pytest.approx(sigma, rel=0.3)


@pytest.mark.parametrize(("seed", "kind", "gap"), [
    (10, KINDS[1], {"trim": 0.06}), (13, LATER, {"roll": 0.006}),
    *(pytest.param(*case, marks=pytest.mark.slow) for case in (
        (15, KINDS[3], {"stability": 0.5}), (12, KINDS[2], {"stability": 0.5}), (4, KINDS[2], {"elevator": 0.6}),
        (4, LATER, {"trim": 0.06}))),
])
def test_of_a_gap_that_no_gusts_make_sense_of_a_first_guess_tells_their_kind(seed, kind, gap):
    """Settled without it, the model is told to meet 3.2 m/s, or derivatives go as far as they may in air that turns."""
    flights, candidates = [reconstruct(flown(seed, 1.5, kind, **gap))], bank()
    baseline = Baseline(load(), np.eye(len(candidates.nuisances)))
    ways = followed_in_any(flights, candidates, baseline, kind_at_first(flights))
    assert len(ways) == 2
    assert likeliest_guess(ways, candidates, baseline, ()).kind == kind


@pytest.mark.parametrize(("kind", "sigma", "ahead", "before", "gap", "taken"), [
    (KINDS[2], 1.5, 0.2, 0.0, True, False), (KINDS[2], 1.5, 0.4, 0.0, True, True),
    (KINDS[2], 1.5, 0.2, 0.1, True, True), (KINDS[2], 1.5, 0.1, 0.1, True, False),
    (KINDS[2], 1.5, 0.1, 0.0, False, True), (KINDS[2], 1.5, -0.1, 0.1, False, False),
    (KINDS[2], SIGMAS[-1], 9.0, 0.0, True, False),
    (KINDS[1], 1.5, 9.0, 9.0, True, False), (KINDS[1], 1.5, 9.0, 9.0, False, False),
    (KINDS[1], 1.5, 19.0, 0.0, True, True), (LATER, SIGMAS[-1], 0.1, 0.0, True, True),
])
def test_what_a_guess_in_other_gusts_has_to_gain(monkeypatch, kind, sigma, ahead, before, gap, taken):
    """Air that turns all that is asked of it; where only the strongest gusts make sense even so, none is enough.

    Less where it is likelier without the gap (`before`), too, and nothing where it needs none.
    """
    flight = reconstruct(flown(5, 0.5))
    first, second = (Followed([flight], np.zeros(1), gains(flight, (s,), k)) for s, k in ((1.5, LATER), (sigma, kind)))
    likely = {id(first.known): 50.0, id(second.known): 50.0 + ahead}
    monkeypatch.setattr(first_guess, "likelihood", lambda _, known: likely[id(known)])
    monkeypatch.setattr(first_guess, "first_guess",
                        lambda way, *_: Guess(way, way.flights, way.known, way is first or gap))
    monkeypatch.setattr(Followed, "likelihood", lambda way, _: before if way is second else 0.0)
    guess = first_guess.likeliest_guess([first, second], bank(), Baseline(load(), np.eye(1)), ())
    assert (guess.begun is second) == taken


@pytest.mark.parametrize(("farthest", "kinds"), [(0.97, [LATER]), (1.0, [LATER, KINDS[2]])])
def test_of_a_model_that_goes_as_far_as_it_may_both_straight_kinds_are_asked(monkeypatch, farthest, kinds):
    """Elevators that are rigged off pass for gusts that the tail meets later, as far as numbers go."""
    flight, candidates = reconstruct(flown(5, 0.5)), bank()
    centre = np.zeros(len(candidates.nuisances))
    centre[3] = -farthest * settling.MOVED
    monkeypatch.setattr(settling, "followed", lambda flights, *given: Followed(flights, centre, gains(
        flights[0], (0.5,), given[2])))
    ways = followed_in_any([flight], candidates, Baseline(load(), np.eye(len(centre))), LATER)
    assert [way.kind for way in ways] == kinds


def test_of_an_aircraft_that_the_model_follows_poorly_no_kind_of_gusts_is_asked():
    flight, candidates = reconstruct(flown(12, 1.5, KINDS[2], stability=0.5)), bank()
    poorly = replace(flight, inadequacy=flight.inadequacy.with_walk(3.0))
    baseline = Baseline(load(), np.eye(len(candidates.nuisances)))
    assert len(followed_in_any([poorly], candidates, baseline, LATER)) == 1


def test_the_gusts_of_all_records_are_of_the_kind_that_most_of_them_say():
    """One record by itself is sometimes wrong: here it is one whose air turns in truth."""
    flights = [reconstruct(flown(5 + k, 1.0, KINDS[k == 0])) for k in range(3)]
    found = likeliest_explained(flights, [choose_gain(f, SIGMAS) for f in flights], [()] * 3)
    assert all(gain.gusts.kind == LATER for gain in found)
    assert likeliest_explained(flights[:1], [choose_gain(flights[0], SIGMAS)], [()])[0].gusts.kind == KINDS[1]


@pytest.mark.parametrize("kind", [KINDS[1], *(pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS[2:])])
def test_a_clean_aircraft_in_gusts_of_another_kind_is_not_blamed(kind):
    """Unknown at the rolling moment where the air turns, `downwash_lag` where the tail meets gusts at once."""
    found = diagnose([flown(3, 1.5, kind)])
    assert found.verdict == "no_gap"
    told = found.provenance["records"][0]
    assert (told["tail_meets_gusts_later"], told["rotational_gusts"]) == kind


def test_air_that_does_not_turn_is_not_taken_to_turn_at_the_start_either():
    flight = reconstruct(flown(5, 0.5))
    still, turning = (gains(flight, (0.5,), kind)[0].with_start() for kind in KINDS[:2])
    at = [TANGENT.index(name) for name in ROTATION]
    assert not still.start[at].any() and not still.K[:, at].any()
    assert np.diag(turning.start)[at].all() and turning.K[:, at].any(axis=(0, 2)).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", [Kind(False, False), Kind(False, True)])
def test_references_are_fitted_in_the_gusts_that_they_met(kind):
    """An aircraft without a lag of the downwash: fitted in gusts that the tail meets later, it has one or three."""
    flights = [reconstruct(flown(seed, 0.5, kind, lag=0.0)) for seed in (3, 4)]
    moves = directions(bank((), uncertain()))
    fit = in_any_gusts(flights, moves, np.zeros(2))
    assert fit.kind == kind and fit.walk <= 3.0
    lag = fit.flown()[0].parameters["Cm_alphadot"][0] / load()["Cm_alphadot"][0]
    assert lag == pytest.approx(0.0, abs=0.15)
