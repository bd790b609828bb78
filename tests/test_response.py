"""The linear response of the predictor to small pushes is what a flight with them makes of the record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from icing_env import scenario
from sim2real.library.candidates import bank
from sim2real.library.pushes import at_any_time, pushes
from sim2real.prediction.gusts import KINDS, LATER
from sim2real.prediction.kalman import follow
from sim2real.prediction.predictor import Push
from sim2real.records.reconstruct import reconstruct
from sim2real.signatures.evidence import Evidence, flown, gather
from sim2real.signatures.gust_intensity import SIGMAS, choose_gain
from sim2real.signatures.response import Filter
from testbed.flight import fly


@pytest.fixture(scope="module", params=[(0.0, LATER), *((1.5, kind) for kind in KINDS[:3]), (0.5, KINDS[3])])
def evidence(request) -> Evidence:
    sigma, kind = request.param
    weather = {"turbulence_sigma_w": sigma, "turbulence_tail_delay": float(kind.tail_delay),
               "turbulence_rotation": float(kind.rotation)}
    chosen = scenario.load("clear_air", duration=25.0, parameters=weather)
    flight = reconstruct(fly(chosen, seed=7, observer=False, protection=False).record)
    flight.measured[1::5, 0] = np.nan  # a reading that is missing now and then
    model = replace(bank(), families=(), terms=(), nuisances=(), size=1)
    return gather(flight, model, follow(flight, choose_gain(flight, SIGMAS, (), kind)))


def both(evidence: Evidence, pushed: tuple[Push, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Response [N x channels, rows] as linearised, and as flown a hundredth as far."""
    rows = np.repeat(evidence.flight.parameters, 1 + max(q.row for q in pushed))
    small = tuple(replace(q, series=0.01 * q.series) for q in pushed)
    there = flown(evidence.flight, rows, small, evidence.gain, evidence.factor, keep=range(1, len(rows))).rows
    assert evidence.linear is not None
    return evidence.linear.respond(pushed).values, 100.0 * there


def test_every_generic_term_does_what_its_flight_does(evidence):
    terms = [replace(term, row=1 + i) for i, term in enumerate(t for t in bank().terms if "_path" not in t.component)]
    assert evidence.linear is not None
    linear, there = both(evidence, pushes(evidence.linear.flight, terms))
    apart = np.linalg.norm(linear - there, axis=0) / np.maximum(np.linalg.norm(there, axis=0), 1e-6)
    assert len(apart) == len(terms) and np.median(apart) < 0.01 and np.quantile(apart, 0.9) < 0.03
    # what is left of a constant error of attitude, once the filter has followed it, hangs on small errors of gravity;
    # of a term that this flight moves by less than one unit, a third is nothing
    assert apart[np.linalg.norm(there, axis=0) > 1.0].max() < 0.3
    assert np.linalg.norm(linear - there, axis=0).max() < 0.05 * np.linalg.norm(there, axis=0).max()


def test_a_hat_does_nothing_before_its_time(evidence):
    assert evidence.linear is not None
    hats = at_any_time(evidence.linear.flight, "pitching_moment", 1)
    linear, there = both(evidence, pushes(evidence.linear.flight, hats))
    late = linear[:, 15].reshape(-1, evidence.whitened.shape[1])  # about 15 s; counted from 4 s
    assert not late[: round((14.0 - 4.0) / evidence.flight.dt)].any() and late.any()
    assert np.linalg.norm(linear - there) < 0.02 * np.linalg.norm(there)


def test_responses_add_and_scale(evidence):
    assert evidence.linear is not None
    n = len(evidence.flight.time)
    one, other = np.sin(np.arange(n) / 40.0), np.cos(np.arange(n) / 25.0)
    alone = [Push(0, "q", one, False), Push(1, "airspeed", other, True)]
    parts = evidence.linear.respond(alone).values
    together = evidence.linear.respond([Push(4, "q", 2.0 * one, False), Push(4, "airspeed", -other, True)])
    assert together.rows == (4,)
    np.testing.assert_allclose(together.values[:, 0], 2.0 * parts[:, 0] - parts[:, 1], atol=1e-9)


def test_nothing_pushed_has_no_response(evidence):
    assert isinstance(evidence.linear, Filter)
    found = evidence.linear.respond(())
    assert found.rows == () and found.values.shape[1] == 0
