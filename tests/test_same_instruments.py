"""Reference flights with the aircraft's own instruments and another loading: neither is a gap afterwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from generated import in_still_air

from icing_env import scenario
from icing_env.aircraft import load
from icing_env.record import FlightRecord, RecordMeta
from sim2real.baseline.loading import CENTRE, INERTIA, of_another_loading, of_published, otherwise_loaded
from sim2real.baseline.references import REPEATABLE, Baseline, _baseline, directions, uncertain
from sim2real.diagnosis import diagnose
from sim2real.library.candidates import (
    INSTRUMENTS,
    RIGGING,
    SIGNED,
    SPREAD,
    TOLD_ONCE,
    WEAK,
    bank,
    nuisances,
    shifted,
)
from testbed.flight import fly
from testbed.withheld.flights import Aircraft

BIASES = {"bias_alpha": 2e-3, "bias_beta": -1.5e-3, "bias_q": 5e-4, "bias_az": 0.03, "bias_theta": 1.5e-3}


@pytest.mark.slow
def test_offsets_that_all_flights_have_are_no_gap_and_one_beside_them_is(tmp_path):
    own = Aircraft(terms=BIASES)
    clean, again = (in_still_air(tmp_path, role, own, seed) for role, seed in (("reference", 1), ("diagnose", 2)))
    assert diagnose(again, reference=clean).verdict == "no_gap"
    worse = in_still_air(tmp_path, "diagnose", replace(own, parts=(("alpha_bias", "same", 8e-3),)), 3)
    found = diagnose(worse, reference=clean)
    assert found.hypotheses[0]["effects"] == ["alpha_bias"]
    size = found.effects[0]["parameters"]["offset"]
    assert size["low95"] - 5e-4 < 8e-3 < size["high95"] + 5e-4


@pytest.mark.parametrize(("times", "gap"), [(1.0, False), pytest.param(4.0, True, marks=pytest.mark.slow)])
def test_without_references_offsets_beyond_a_calibration_are_a_gap(tmp_path, times, gap):
    own = Aircraft(terms={name: times * offset for name, offset in BIASES.items()})
    assert (diagnose(in_still_air(tmp_path, "diagnose", own, 2)).verdict != "no_gap") == gap


@pytest.mark.slow
@pytest.mark.parametrize("number", TOLD_ONCE)
def test_a_number_that_one_source_tells_may_be_another_without_a_gap(tmp_path, number):
    far = 8.0 if number == "spool_time" else -8.0  # no engine spools before it is told to
    within, beyond = (Aircraft(baseline={number: 1.0 + times * TOLD_ONCE[number]}) for times in (-1.2, far))
    assert diagnose(in_still_air(tmp_path, "diagnose", within, 4)).verdict == "no_gap"
    assert diagnose(in_still_air(tmp_path, "diagnose", beyond, 4)).verdict != "no_gap"


def flown(off: dict[str, float]) -> FlightRecord:
    """Doublets in still air, instruments and rigging off by so much."""
    row = load()
    parameters = {name: float(row[name][0]) + size for name, size in off.items()}
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.0, **parameters})
    return fly(chosen, seed=4, observer=False, protection=False).record


def test_what_calibration_and_rigging_leave_is_no_gap():
    """All of it at once; of gyros, pick-ups and rigging nothing was allowed for, and every such aircraft blamed."""
    signs = np.random.default_rng(1).choice([-1.0, 1.0], len(INSTRUMENTS | RIGGING))
    off = {name: sign * size for (name, size), sign in zip((INSTRUMENTS | RIGGING).items(), signs, strict=True)}
    found = diagnose([flown(off)])
    assert found.verdict == "no_gap", found.hypotheses[:3]


@pytest.mark.parametrize(("name", "where"), [
    ("bias_q", "sensor:q"), ("aileron_offset", "aileron_path"),
    pytest.param("Cl_0", "rolling_moment", marks=pytest.mark.slow)])  # fmt: skip
def test_ten_times_as_much_is_one(name, where):
    found = diagnose([flown({name: 10.0 * (INSTRUMENTS | RIGGING)[name]})])
    assert found.verdict != "no_gap" and found.where["components"][where] > 0.5, found.hypotheses[:3]


@pytest.mark.parametrize("number", [SIGNED[0], *(pytest.param(n, marks=pytest.mark.slow) for n in SIGNED[1:])])
def test_such_a_number_may_have_the_other_sign_without_a_gap(tmp_path, number):
    """Held at a tenth of the published one, and stepped by parts of what it was moved to, one in nine was a gap."""
    other = Aircraft(baseline={number: 1.0 - 2.5 * (WEAK | TOLD_ONCE)[number]})
    assert diagnose(in_still_air(tmp_path, "diagnose", other, 4)).verdict == "no_gap"


def test_deviations_of_such_numbers_add():
    moves, one = nuisances(), np.zeros(len(nuisances()))
    for j, move in enumerate(moves):
        if move.name in SIGNED:
            one[j] = -1.7
    row = load()
    twice = shifted(shifted(row, moves, one, "torque"), moves, one, "torque")
    both = shifted(row, moves, 2.0 * one, "torque")
    for name in SIGNED:
        assert twice[name][0] == pytest.approx(both[name][0])
        assert both[name][0] == pytest.approx((1.0 - 3.4 * (WEAK | TOLD_ONCE)[name]) * row[name][0])
    fitted = shifted(row, directions(bank()), np.array([move.name in SIGNED for move in directions(bank())]), "torque")
    for name in SIGNED:  # of reference flights, in steps of that size
        assert fitted[name][0] - row[name][0] == pytest.approx((WEAK | TOLD_ONCE)[name] * abs(row[name][0]))


def test_numbers_are_less_certain_where_references_did_not_fly():
    """Values are told at the references' condition alone; how they change with it, by the prior of the change."""
    moves, known, n = directions(bank()), 1e4, len(directions(bank()))
    at = 0.1
    precision = known * np.kron([[1.0, at], [at, at**2]], np.eye(n)) + np.diag(np.r_[np.ones(n), 0.25 * np.ones(n)])
    there, elsewhere = (_baseline(bank(), moves, np.zeros(2 * n), precision, np.array([where])) for where in (at, -0.2))
    j = [move.name for move in moves].index("Cm_alpha")
    sd = [np.sqrt(np.linalg.inv(found.precision)[j, j]) for found in (there, elsewhere)]
    assert sd == pytest.approx([REPEATABLE, np.hypot(REPEATABLE, 0.3 * 2.0)], rel=0.02)


def loaded(mass: float | None, inertia: float = 1.0) -> FlightRecord:
    moments = None if mass is None else (2e4 * inertia, 3e4, 5e4, 1e3)
    return FlightRecord({"time": np.zeros(1)}, RecordMeta(mass=mass, inertia=moments))


@pytest.mark.parametrize(("one", "other", "otherwise"), [
    ((4800.0,), (4800.0,), False), ((4800.0,), (4900.0,), True), ((4800.0,), (4803.0, 1.1), False),
    ((None,), (None,), False), ((4800.0,), (None,), False),
])  # fmt: skip
def test_a_loading_is_another_one_where_masses_say_so(one, other, otherwise):
    assert otherwise_loaded([loaded(*one)], [loaded(*other)]) == otherwise


def test_the_published_model_is_as_uncertain_of_a_loading():
    """Inertias and c.g. that papers tell move the moments' derivatives together, as no spread of single ones does."""
    moves = nuisances()
    covariance = np.linalg.inv(of_published(moves).precision)
    at = {move.name: j for j, move in enumerate(moves)}
    assert covariance[at["Cl_p"], at["Cl_beta"]] == pytest.approx((INERTIA / SPREAD) ** 2)
    assert covariance[at["CZ_alpha"], at["Cm_q"]] == pytest.approx(0.0)
    assert covariance[at["CZ_alpha"], at["CZ_alpha"]] == pytest.approx(1.0)


def test_another_loading_leaves_moments_uncertain_and_forces_as_they_were():
    moves = (*nuisances(), *uncertain())
    names = [move.name for move in moves]
    known = Baseline(load(), 1e6 * np.eye(len(moves)), spread=None)
    sd = dict(zip(names, np.sqrt(np.diag(np.linalg.inv(of_another_loading(known, moves).precision))), strict=True))
    p = known.parameters[0]
    moved = CENTRE / p["chord"] * p["CZ_alpha"] / (SPREAD * p["Cm_alpha"])
    assert sd["Cm_alpha"] == pytest.approx(np.hypot(moved, INERTIA / SPREAD), rel=1e-3)
    assert sd["Cl_p"] == pytest.approx(INERTIA / SPREAD, rel=1e-3)
    assert sd["CZ_alpha"] == pytest.approx(1e-3) and sd["bias_alpha"] == pytest.approx(1e-3)
