"""Rivals of the diagnosis: each finds a large effect of its own kind, and all answer in the form that is scored."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import effects, scenario
from icing_env.effects.effect import ENTERS_AT
from icing_env.errors import InputError
from icing_env.jit import source_hash
from icing_env.record import FlightRecord, write
from sim2real.records.reconstruct import reconstruct
from testbed.benchmarks import answers
from testbed.benchmarks import diagnosis as run
from testbed.flight import fly
from testbed.rivals import RIVALS, coefficients, scales, solve
from testbed.rivals.opinion import Opinion, Scale, Size, answer, probabilities
from testbed.withheld import score

LARGE = {"bic": ("alpha_bias", "offset", 0.02), "regression": ("lift_slope", "change", -0.3),
         "output_error": ("roll_damping", "change", -0.4)}  # fmt: skip
SAMPLE = Scale(level=10.0, width=0.5, sharpness=1.0, doubt=0.1)


@cache
def flown(effect: str = "", parameter: str = "", value: float = 0.0) -> FlightRecord:
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.0},
                           effects={effect: {parameter: value}} if effect else {})  # fmt: skip
    return fly(chosen, seed=4, observer=False, protection=False).record


@cache
def told(rival: str, effect: str = "", parameter: str = "", value: float = 0.0) -> dict:
    return json.loads(json.dumps(solve.diagnose(rival, [flown(effect, parameter, value)]), allow_nan=False))


def key(tier: str, parts: list[str]) -> dict:
    return {"tier": tier, "sigma_w": 0.0, "effects": parts, "forms": ["same"] * len(parts), "D_none": 20.0,
            "D_pair": 10.0, "D": {n: 0.0 if n in parts else 15.0 for n in effects.LIBRARY}, "salt": "x",
            "parameters": {LARGE[r][0]: {LARGE[r][1]: LARGE[r][2]} for r in RIVALS if LARGE[r][0] in parts},
            "where": list(effects.LIBRARY[parts[0]].enters_at) if parts else []}  # fmt: skip


@pytest.mark.parametrize("rival", RIVALS)
def test_a_large_effect_of_its_own_kind_is_named_with_its_sign(rival):
    effect, parameter, value = LARGE[rival]
    found = told(rival, effect, parameter, value)
    first = next(h for h in found["hypotheses"] if h["effects"])
    assert first["effects"] == [effect]
    size = next(e for e in found["effects"] if e["name"] == effect)["parameters"][parameter]
    assert 0.5 < size["estimate"] / value < 1.5
    assert size["low95"] <= size["estimate"] <= size["high95"]


@pytest.mark.parametrize("rival", RIVALS)
def test_without_a_gap_it_is_less_alarmed_than_with_one(rival):
    clean = told(rival)
    none = next(h["probability"] for h in clean["hypotheses"] if not h["effects"])
    iced = next(h["probability"] for h in told(rival, *LARGE[rival])["hypotheses"] if not h["effects"])
    assert clean["verdict"] == "no_gap"
    assert iced < 0.5 * none


@pytest.mark.parametrize("rival", RIVALS)
def test_every_answer_has_the_form_that_is_scored(rival):
    effect = LARGE[rival][0]
    found = told(rival, *LARGE[rival])
    p = [h["probability"] for h in found["hypotheses"]]
    assert sum(p) == pytest.approx(1.0) and min(p) > 0.0 and p == sorted(p, reverse=True)
    assert all(not h["unknown"] and len(h["effects"]) <= 1 for h in found["hypotheses"])
    assert len({tuple(h["effects"]) for h in found["hypotheses"]}) == len(p)
    inside = [p[i] for i in found["credible_set_95"]]
    assert sum(inside) >= 0.95 > sum(inside[:-1])
    assert set(found["where"]["components"]) <= set(ENTERS_AT)
    scored = score.figures([score.flat(found, key("single", [effect])), score.flat(told(rival), key("null", []))])
    assert scored["top1"] == 1.0 and scored["null_false_alarm"] == 0.0 and scored["failed"] == 0
    assert scored["log_score"] < np.log(len(effects.LIBRARY))  # of knowing nothing


@pytest.mark.parametrize("rival", RIVALS)
def test_names_and_notes_play_no_part(rival):
    record = flown(*LARGE[rival])
    lying = replace(record, meta=replace(record.meta, name="perfect", flight="no gap", notes="nothing here"))
    first, second = (solve.consider(rival, [r]) for r in (record, lying))
    assert first.evidence == second.evidence and first.alarm == second.alarm


def test_what_cannot_be_asked_is_said(tmp_path):
    with pytest.raises(InputError, match="no rival 'bics'"):
        solve.consider("bics", [flown()])
    with pytest.raises(InputError, match="at least one"):
        solve.consider("bic", [])
    bad = FlightRecord({k: v for k, v in flown().channels.items() if k != "theta"}, flown().meta)
    write(bad, tmp_path / "1.csv")
    assert "theta" in run.solve_by(tmp_path, "bic")["error"]


def test_an_effect_lacks_nothing_of_its_own_aircraft():
    """What a variant would lack is what a record of it does lack, so far as a flight without gusts can show."""
    flight = reconstruct(flown("aileron_power", "change", 0.5))
    variant = next(v for v in coefficients.variants() if v.effect == "aileron_power")
    found = coefficients.lack([flight], [replace(variant, size=0.5)])
    own, made = found.residual["Cl"], found.signatures["Cl"][0]
    assert np.corrcoef(own, made)[0, 1] > 0.9
    assert own @ made / (made @ made) == pytest.approx(1.0, abs=0.1)
    assert np.std(found.signatures["Cm"][0]) < 0.05 * np.std(made)


def test_a_biased_vane_is_a_shifted_start():
    """The aircraft flies at less alpha than a vane shows that reads too much; a tenth the motion answers meanwhile."""
    flight = reconstruct(flown())
    variant = next(v for v in coefficients.variants() if v.effect == "alpha_bias")
    found = coefficients.lack([flight], [replace(variant, size=0.01)])
    slope = float(flight.parameters["CZ_alpha"][0])
    assert np.mean(found.signatures["CZ"][0]) == pytest.approx(-0.01 * slope, rel=0.2)


def opinion(alarm: float, **evidence: float) -> Opinion:
    parameter = effects.LIBRARY["lift_slope"].parameters[0]
    return Opinion(alarm, evidence, {name: Size(parameter, 0.1, 0.0, 0.2) for name in evidence})


def test_at_the_level_a_gap_is_as_probable_as_none():
    p = probabilities(opinion(10.0, lift_slope=3.0, side_force=3.0), SAMPLE)
    assert p == pytest.approx({"": 0.5, "lift_slope": 0.25, "side_force": 0.25}, rel=1e-4)
    assert answer(opinion(9.0, lift_slope=3.0), SAMPLE, 1.0)["verdict"] == "no_gap"
    assert answer(opinion(11.0, lift_slope=3.0), SAMPLE, 1.0)["verdict"] == "explained"


def test_scales_are_where_the_truth_is_most_probable():
    rng = np.random.default_rng(0)
    names = ("lift_slope", "side_force", "roll_trim")
    seen = []
    for i in range(150):
        gap = i % 2 == 0
        alarm = float(np.exp(rng.normal(np.log(100.0) if gap else np.log(10.0), 1.0)))
        truth = names[i % 3]
        evidence = {name: 2.0 * (name == truth) + rng.normal() for name in names}
        seen.append((opinion(alarm, **evidence), truth if gap else ""))
    found = scales.fit(seen)
    # of two normal densities of width 1 at log 10 and log 100, and of evidence 2 +- 1 for the truth
    assert found.doubt < 0.3
    assert np.log(found.level) == pytest.approx(np.log(np.sqrt(1000.0)), abs=0.5)
    assert found.width == pytest.approx(1.0 / np.log(10.0), rel=0.5)
    assert found.sharpness == pytest.approx(2.0, rel=0.5)
    with pytest.raises(InputError, match="without a gap"):
        scales.fit([s for s in seen if s[1]])


def test_rivals_stand_among_the_baselines(tmp_path):
    folders = {name: tmp_path / name for name in ("answers", "keys", "answers_bic")}
    for folder in folders.values():
        folder.mkdir()
    for name, true, said in (("a", key("single", ["lift_slope"]), opinion(1000.0, lift_slope=9.0, side_force=0.0)),
                             ("b", key("null", []), opinion(0.1, lift_slope=9.0, side_force=0.0))):
        (folders["keys"] / f"{name}.json").write_text(json.dumps(true))
        for kind in ("answers", "answers_bic"):
            (folders[kind] / f"{name}.json").write_text(json.dumps(answer(said, SAMPLE, 1.0)))
    found = score.score(folders["answers"], folders["keys"], None, None, folders["answers_bic"])["baselines"]
    assert list(found) == ["permuted_keys", "always_no_gap", "bic"]
    assert found["bic"]["top1"] == 1.0 and found["bic"]["null_false_alarm"] == 0.0


def test_the_run_of_the_benchmark_asks_the_rivals_with_the_keys_closed(tmp_path):
    bad = FlightRecord({k: v for k, v in flown().channels.items() if k != "theta"}, flown().meta)
    (tmp_path / "records" / "a").mkdir(parents=True)
    (tmp_path / "keys").mkdir()
    write(bad, tmp_path / "records" / "a" / "1.csv")
    said: list[str] = []
    answers.answer_all(tmp_path, "answers_bic", {"a": ("bic",)}, 1, said.append, run.solve_by)
    assert "theta" in json.loads((tmp_path / "answers_bic" / "a.json").read_text())["error"]
    assert said == ["answers_bic: 1 of 1"]
    assert (tmp_path / "keys").stat().st_mode & 0o777 == answers.OPEN


def test_a_run_does_not_go_on_with_the_answers_of_another_solver(tmp_path):
    (tmp_path / "keys").mkdir()
    (tmp_path / "answers").mkdir()
    for name, said in (("a", {"provenance": {"sources": source_hash("sim2real")}}), ("b", {"error": "no theta"})):
        (tmp_path / "answers" / f"{name}.json").write_text(json.dumps(said))
    answers.answer_all(tmp_path, "answers", {"a": (), "b": ()}, 1, print, run.solve)
    (tmp_path / "answers" / "b.json").write_text(json.dumps({"provenance": {"sources": "0123456789abcdef"}}))
    with pytest.raises(InputError, match=r"b\.json: the answer of another solver \(sources 0123456789abcdef"):
        answers.answer_all(tmp_path, "answers", {"a": (), "b": ()}, 1, print, run.solve)
    assert len(list((tmp_path / "answers").iterdir())) == 2  # nothing is lost
