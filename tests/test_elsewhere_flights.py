"""Whole flights of the plant made elsewhere: readings that agree, gusts, effects, the written form; and the score."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from icing_env.errors import InputError
from icing_env.record import read
from testbed.benchmarks import elsewhere
from testbed.elsewhere.aircraft import GRAVITY
from testbed.elsewhere.cases import make_case, write_case
from testbed.elsewhere.distance import TOLERANCE, compare
from testbed.elsewhere.effects import KNOWN, UNKNOWN
from testbed.elsewhere.flight import DT, PREROLL
from testbed.elsewhere.gusts import dryden
from testbed.elsewhere.setting import draw_setting
from testbed.elsewhere.simulation import simulate

START = int(PREROLL / DT)


@pytest.fixture(scope="module")
def calm_case():
    """A clean aircraft in still air."""
    setting = draw_setting(np.random.default_rng(11), False, "uiuc")
    setting.sigma, setting.slow = 0.0, ("none", 0.0)
    return setting, simulate(setting, [], [])[0]


def test_pitch_rate_and_acceleration_reproduce_attitude_and_alpha(calm_case):
    _, groups = calm_case
    s = {k: v[:, START:] for k, v in groups[0].items()}
    theta_rate = s["q"] * np.cos(s["phi"]) - s["r"] * np.sin(s["phi"])
    theta = s["theta"][:, :1] + cumulative_trapezoid(theta_rate, dx=DT, initial=0, axis=1)
    assert np.abs(theta - s["theta"])[:, : 10 * 100].max() < 0.004
    speed, a, b = s["airspeed"], s["alpha"], s["beta"]
    down = s["az"] + GRAVITY * np.cos(s["theta"]) * np.cos(s["phi"])
    ahead = s["ax"] - GRAVITY * np.sin(s["theta"])
    rate = s["q"] - np.tan(b) * (s["p"] * np.cos(a) + s["r"] * np.sin(a))
    rate += (down * np.cos(a) - ahead * np.sin(a)) / (speed * np.cos(b))
    alpha = a[:, :1] + cumulative_trapezoid(rate, dx=DT, initial=0, axis=1)
    assert np.abs(alpha - a)[:, : 10 * 100].max() < 0.004


def test_a_clean_aircraft_has_no_difference_and_starts_near_trim(calm_case):
    setting, groups = calm_case
    found = compare(groups, 1, range(7), 1.0, 50)
    assert found["gap"] == 0.0 and found["whitened_distance"] == 0.0
    assert np.abs(groups[0]["q"][:, START - 100 : START]).max() < 0.02
    assert len(setting.programme) == 7


def test_gusts_have_the_levels_of_the_specification():
    gust = dryden(400_000, 0.02, 65.0, 1.0, True, np.random.default_rng(0))
    assert np.allclose(gust[:3].std(1), 1.0, atol=0.12)
    expected = np.sqrt(0.8 * np.pi / (2 * 533.4) * (np.pi * 533.4 / 79.248) ** (1 / 3) * np.pi / 79.248 * 2 / 2)
    assert abs(gust[3].std() / expected - 1) < 0.1
    assert np.all(gust[3:].std(1) < 0.05)


def test_effects_are_many_of_all_families_and_half_in_another_form():
    names = [e.name for e in KNOWN + UNKNOWN]
    assert len(KNOWN) >= 14 and len(UNKNOWN) >= 14 and len(set(names)) == len(names)
    assert 0.35 <= np.mean([e.other_form for e in KNOWN]) <= 0.65
    assert {e.family for e in KNOWN} == {"aerodynamics", "propulsion", "mass", "actuator", "sensor", "environment"}


@pytest.mark.parametrize("effect", [next(e for e in KNOWN if e.name == "Fuel slosh"), UNKNOWN[0]])
def test_an_effect_moves_its_records_and_spares_references(effect):
    setting = draw_setting(np.random.default_rng(2), True, "uiuc")
    groups, _ = simulate(setting, [effect], [effect.high])
    refs = [i for i, c in enumerate(setting.programme) if c[0] == "reference"]
    assert all(np.allclose(groups[0][k][refs], groups[1][k][refs], atol=1e-12) for k in ("p", "alpha", "ay"))
    assert np.abs(groups[0]["r"][:7] - groups[1]["r"][:7]).max() > 3e-4


def test_the_project_reads_what_is_written(tmp_path):
    rng = np.random.default_rng(4)
    setting, channels, key = make_case(rng, "null", 0, True, "uiuc")
    write_case(tmp_path / "a", tmp_path / "k.json", setting, channels, key, rng)
    records = [read(path) for path in sorted((tmp_path / "a").glob("*.csv"))]
    roles = [r.meta.role for r in records]
    assert [roles.count(role) for role in ("diagnose", "held_out", "reference")] == [5, 2, 2]
    assert all(set(TOLERANCE) <= set(r.channels) and r.time[0] == 0.0 and r.time[-1] > 37.0 for r in records)
    key = json.loads((tmp_path / "k.json").read_text(encoding="utf-8"))
    assert key["kind"] == "null" and key["records"]["record_01"]["role"] == roles[0]


def key_of(kind, components, references=False):
    """As much of a key as the score reads."""
    return {"kind": kind, "references": references, "sigma_w": 0.5, "components": components,
            "effects": [{"name": f"something at the {c}"} for c in components]}


def said(verdict, effects, probability, components, closure):
    """As much of an answer as the score reads."""
    first = {"effects": effects, "unknown": verdict == "unknown", "probability": probability}
    return {"verdict": verdict, "hypotheses": [{"effects": [], "unknown": False, "probability": 0.01}, first],
            "where": {"components": components}, "gap": {"held_out": {"closure": closure}}, "seconds": 9.0}


def test_gaps_are_scored_by_component_and_closure_and_nulls_by_verdict():
    cases = {
        "a": (key_of("null", []), said("no_gap", [], 0.9, {}, None)),
        "b": (key_of("null", [], True), said("explained", ["mass_error"], 0.8, {"mass": 0.8}, 0.3)),
        "c": (key_of("single", ["mass", "wind"]), said("explained", ["cg_shift"], 0.6, {"mass": 0.7}, 0.9)),
        "d": (key_of("single", ["wind"]), said("unknown", [], 0.6, {"mass": 0.6, "wind": 0.3}, 0.5)),
        "e": (key_of("single", ["wind"]), {"error": "no airspeed"}),
        "f": (key_of("unknown", ["sensor:q"]), said("unknown", ["mass_error"], 0.6, {"sensor:q": 0.5}, None)),
    }
    rows = [elsewhere.scored(name, *case) for name, case in cases.items()]
    assert [row["component"] for row in rows] == [None, None, 0.7, 0.3, None, 0.5]
    assert rows[4]["verdict"] == "refused" and rows[4]["explanation"] == "refused: no airspeed"
    assert rows[5]["explanation"] == "mass_error + something unknown" and rows[5]["probability"] == 0.6
    clean, referred, single, strange = elsewhere.summed(rows)
    assert (clean["no_gap"], clean["placed"], clean["closure_median"]) == (1, None, None)
    assert referred["references"] and (referred["no_gap"], referred["explained"]) == (0, 1)
    assert (single["cases"], single["explained"], single["unknown"], single["refused"], single["placed"]) == (
        3, 1, 1, 1, 1)
    assert single["closure_median"] == pytest.approx(0.7)
    assert (strange["placed"], strange["closure_median"]) == (1, None)
    kinds, each = elsewhere.tables({"by_kind": elsewhere.summed(rows), "rows": rows})
    assert kinds[2][2][-2:] == ["1 of 3", "0.70"] and len(kinds[2]) == 4
    assert each[2][4][4:7] == ["something at the wind", "refused", "refused: no airspeed"]


def test_a_set_is_drawn_once_and_answers_are_kept(tmp_path):
    """One case that is flown, one that stands there, both with answers."""
    (tmp_path / "keys").mkdir()
    there = "b2222222"
    (tmp_path / "keys" / "names.json").write_text(json.dumps({"1": there}))
    (tmp_path / "keys" / f"{there}.json").write_text(json.dumps(key_of("single", ["wind"])))
    half = tmp_path / ".drawing_0" / "records" / "a_half"  # of a run that was killed
    half.mkdir(parents=True)
    names = elsewhere._drawn(tmp_path, 2, 5, 1, lambda what: None)
    assert there in names and len(names) == 2 and not (tmp_path / ".drawing_0").exists()
    (tmp_path / "answers").mkdir()
    for one in names:
        (tmp_path / "answers" / f"{one}.json").write_text(json.dumps(said("no_gap", [], 0.9, {}, None)))
    found = elsewhere.measure(tmp_path, 2, 5, 1, lambda what: None)
    assert [(row["kind"], row["cases"], row["no_gap"]) for row in found["by_kind"]] == [
        ("null", 1, 1), ("single", 1, 1)]  # fmt: skip
    with pytest.raises(InputError, match="holds another set"):
        elsewhere.measure(tmp_path, 8, 5, 1, lambda what: None)
