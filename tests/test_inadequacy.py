"""What reference flights show of the model that flies them: nothing where it knows the aircraft."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from generated import in_still_air

from icing_env.aircraft import load
from sim2real.baseline.inadequacy import colour
from sim2real.baseline.references import Baseline
from sim2real.diagnosis import _reconstructed, diagnose
from sim2real.library.candidates import PICK_UPS, bank
from sim2real.posterior.generic import fit_unknown
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Inadequacy
from sim2real.signatures.evidence import gather
from sim2real.signatures.means import without_means
from sim2real.signatures.whitening import SETTLE
from sim2real.words import of_the_model
from testbed.withheld.draw import published_spread
from testbed.withheld.flights import Aircraft

CANDIDATES = bank()
Q, AX = MEASURED.index("q"), MEASURED.index("ax")
FLIGHTS, N = 5, 1800


def innovations(seed: int) -> list[SimpleNamespace]:
    rng = np.random.default_rng(seed)
    return [SimpleNamespace(whitened=rng.normal(size=(N, len(MEASURED)))) for _ in range(FLIGHTS)]


@pytest.mark.parametrize("seed", range(5))
def test_white_innovations_have_no_colour(seed):
    within, means = colour(innovations(seed))
    assert len(within) + len(means) <= 1  # by chance


def test_slow_innovations_are_worth_their_long_run_variance_less():
    """An autoregression of first order r and unit innovations has that of 1 / (1 - r)^2."""
    white, r = innovations(1), 0.8
    for flight in white:
        for k in range(1, N):
            flight.whitened[k, Q] += r * flight.whitened[k - 1, Q]
    within, means = colour(white)
    assert set(within) == {"q"} and "q" not in means
    assert within["q"] == pytest.approx(25.0, rel=0.4)  # the largest of several ratios: rather more than less


def test_a_mean_that_differs_between_flights_leaves_the_changes_their_worth():
    white = innovations(2)
    for flight, offset in zip(white, (-1.0, 1.0, -1.0, 1.0, 0.0), strict=True):
        flight.whitened[:, AX] += offset
    within, means = colour(white)
    assert "ax" not in within
    assert means["ax"] == pytest.approx(0.8 * N, rel=0.1)


def test_rows_and_inner_products_lose_the_same_mean(tmp_path):
    plain = _reconstructed(in_still_air(tmp_path, "diagnose", Aircraft(), 1)[:1], Baseline(load(), np.eye(1)), None)[0]
    known = gather(plain, CANDIDATES)
    flight = replace(plain, inadequacy=Inadequacy(1.0, {"q": 4.0}, {"q": 9.0, "altitude": 4.0}))
    less = gather(flight, CANDIDATES, known.gain)
    first = round(SETTLE / flight.dt)
    own = less.whitened[first:].reshape(-1)
    found = less.rows[:, : len(CANDIDATES.nuisances)].T @ own
    of_paths = (*PICK_UPS, "spool_time")  # which have products of their own
    flown = [nuisance.name not in of_paths for nuisance in CANDIDATES.nuisances]
    assert found[flown] == pytest.approx(less.gram[1 : 1 + len(found), 0][flown], rel=1e-9, abs=1e-6)
    assert np.mean(less.whitened[first:, Q]) == pytest.approx(np.mean(known.whitened[first:, Q]) / (2.0 * 3.0))
    rows = np.random.default_rng(0).normal(size=(len(own), 2))
    away = without_means(rows, flight, first) - rows
    assert np.ptp(away.reshape(-1, len(MEASURED), 2)[:, Q], axis=0) == pytest.approx(0.0, abs=1e-12)
    assert not np.any(away.reshape(-1, len(MEASURED), 2)[:, AX])
    assert less.samples < known.samples


def test_what_terms_explain_of_clean_flights_is_no_evidence():
    rng = np.random.default_rng(3)
    one = tuple(term for term in CANDIDATES.terms if term.component == "z_force")
    terms = tuple(replace(term, row=1 + i) for i, term in enumerate(one))
    half = rng.normal(size=(1 + len(terms), 200))
    found, = fit_unknown(half @ half.T, replace(CANDIDATES, terms=terms))
    clean, = fit_unknown(half @ half.T, replace(CANDIDATES, terms=terms, clean={"z_force": 7.0}))
    assert found.log_evidence - clean.log_evidence == pytest.approx(7.0)
    assert clean.misfit == found.misfit


@pytest.mark.slow
def test_an_aircraft_that_the_model_knows_is_disturbed_little_and_has_no_gap(tmp_path):
    """References of an aircraft whose derivatives are off by their published spread, of the other plant."""
    aircraft = Aircraft(published_spread(np.random.default_rng(5)))
    clean, again = (in_still_air(tmp_path, role, aircraft, seed) for role, seed in (("reference", 1), ("diagnose", 2)))
    found = diagnose(again, reference=clean)
    model = found.provenance["model"]
    assert model["walk"] <= 10.0
    assert set(model["colour"]) <= {"airspeed", "ax", "altitude"} or max(model["colour"].values()) < 4.0
    assert found.verdict == "no_gap"


def test_what_references_said_is_a_sentence():
    told = {"walk": 30.0, "colour": {"ax": 40.0, "q": 5.0}, "means": {},
            "explained_without_a_gap": {"pitching_moment": 9.0}}  # fmt: skip
    one = {"walk": 1.0, "colour": {}, "means": {}, "explained_without_a_gap": {}}
    assert of_the_model(SimpleNamespace(provenance={"references": 5, "model": told})) == (
        "With the model corrected, its 5 reference flights are followed with 30 times the process noise of an aircraft "
        "that the model knows; slow errors count for less in ax (by 40), q (by 5); part of what pitching_moment would "
        "explain is there without a gap.")
    assert of_the_model(SimpleNamespace(provenance={"references": 1, "model": one})) == (
        "With the model corrected, its reference flight is followed with the process noise of an aircraft that the "
        "model knows.")
    assert of_the_model(SimpleNamespace(provenance={"references": 0, "model": None})) == ""
