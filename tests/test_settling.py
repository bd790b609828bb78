"""Gusts and the aircraft's own numbers are found together.

Flown by the generator's plant, in gusts of another scale than the filter has, by aircraft whose derivatives are off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from generated import written

from icing_env.aircraft import load
from sim2real.baseline.references import Baseline
from sim2real.diagnosis import _reconstructed
from sim2real.flown.settling import likeliest, settle
from sim2real.library.candidates import bank
from sim2real.prediction.kalman import gains
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures import gust_intensity
from sim2real.signatures.gust_intensity import SIGMAS, choose_gain, likelihoods
from testbed.withheld.conditions import Conditions
from testbed.withheld.draw import SPREAD, published_spread
from testbed.withheld.flights import Aircraft, recorded
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS

CANDIDATES = bank()
BASELINE = Baseline(load(), np.eye(len(CANDIDATES.nuisances)))
SIGMA, SCALE, LEVEL = 1.5, 0.75, 0.5
WEATHERCOCK = ("Cl_beta", "Cn_beta", "CY_beta", "CZ_alpha", "Cm_alpha", "Cm_q")


def flown(folder, seed: int) -> tuple[list[Reconstruction], dict[str, float]]:
    """Three records of an aircraft in gusts, with good instruments, and the factors of its derivatives."""
    rng = np.random.default_rng(seed)
    factors, out = published_spread(rng), []
    for i, manoeuvre in enumerate(PLANS[2][:DIAGNOSED]):
        flight, seen = recorded(Aircraft(factors), manoeuvre, 1.15, Conditions(SIGMA, SCALE, LEVEL), rng)
        out.append(written(folder / f"{i}", seen, flight.commands))
    return _reconstructed(out, BASELINE, None), factors


def off(centre: Sequence[float], factors: dict[str, float]) -> dict[str, float]:
    """Standard deviations between what was found of each derivative and what it is."""
    return {n.parameter: float(x) - (factors[n.parameter] - 1.0) / SPREAD
            for n, x in zip(CANDIDATES.nuisances, centre, strict=True) if n.parameter in factors}  # fmt: skip


@pytest.mark.parametrize("seed", [2, 4])
def test_derivatives_are_found_in_gusts_of_another_scale(tmp_path, seed):
    flights, factors = flown(tmp_path, seed)
    centre, known = settle(flights, CANDIDATES, BASELINE)
    found = off(centre, factors)
    assert max(abs(found[name]) for name in WEATHERCOCK) < 0.8, found
    same = SIGMA / np.sqrt(SCALE)  # quick gusts of a shorter scale are those of a greater intensity
    assert all(0.8 * same < gain.sigma < 1.25 * same for gain in known)


@pytest.mark.parametrize("last", [SIGMAS[0], SIGMAS[-1]])
def test_the_likeliest_gusts_are_found_from_wherever_they_were_sought_last(tmp_path, last):
    flight = flown(tmp_path, 1)[0][0]
    first = gains(flight, (last,))[0]
    assert likeliest(flight, first).sigma == likeliest(flight, gains(flight, (1.45,))[0]).sigma


def test_a_filter_that_loses_the_record_is_not_the_likeliest(tmp_path, monkeypatch):
    """Whatever is lost is a constant, whose median deviation is none at all."""
    flight = flown(tmp_path, 1)[0][0]
    weak, good, wild = gains(flight, (0.8, 1.2, 3.2))
    wild = replace(wild, K=40.0 * wild.K)
    scores = likelihoods(flight, [good, wild])
    assert np.isfinite(scores[0]) and scores[1] == -np.inf
    options = {gain.sigma: gain for gain in (weak, good, wild)}
    monkeypatch.setattr(gust_intensity, "gains", lambda _, sigmas, _rotation: [options[s] for s in sigmas])
    assert choose_gain(flight, (1.2, 3.2)).sigma == good.sigma
    assert choose_gain(flight, (0.8, 1.2, 3.2)).sigma == good.sigma
