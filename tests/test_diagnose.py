"""Diagnosis: injected effects are found, a clean aircraft is not blamed, the answer has its form and takes no hints."""

import json
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from icing_env import scenario
from icing_env.effects import LIBRARY
from icing_env.errors import InputError
from icing_env.record import FlightRecord, RecordMeta, write
from sim2real.actuators.timing import in_step
from sim2real.answer import credible
from sim2real.closing import gap
from sim2real.diagnosis import Diagnosis, diagnose
from sim2real.library.candidates import FROM, bank, nodes, nuisances, unbroken
from sim2real.library.sizes import piece_prior, size_prior
from sim2real.prediction.kalman import gains, linearise
from sim2real.records.channels import FED_BACK
from sim2real.records.reconstruct import SHORTEST, reconstruct, unfiltered
from sim2real.signatures.whitening import SETTLE
from testbed.cli import _run
from testbed.commands.diagnose import answer
from testbed.flight import fly

KEYS = {"verdict", "hypotheses", "credible_set_95", "where", "effects", "not_testable", "detection_limits", "unknown",
        "gap", "next_manoeuvre", "resimulate", "data_problems", "provenance", "seconds"}  # fmt: skip


@cache
def flown(effect: str = "", value: float = 0.0, seed: int = 0, sigma: float = 0.5) -> FlightRecord:
    name, _, parameter = effect.partition(":")
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": sigma},
                           effects={name: {parameter: value}} if name else {})  # fmt: skip
    return fly(chosen, seed=seed, observer=False, protection=False).record


@cache
def diagnosed(effect: str = "", value: float = 0.0, seed: int = 0, held_out: int | None = None) -> Diagnosis:
    others = [flown(effect, value, held_out)] if held_out is not None else []
    return diagnose([flown(effect, value, seed)], others)


def first(found: Diagnosis) -> list[str]:
    return found.hypotheses[0]["effects"]


@pytest.mark.parametrize(("effect", "value"), [
    ("lift_slope:change", -0.25),
    *(pytest.param(name, value, marks=pytest.mark.slow) for name, value in (
        ("elevator_lag:extra", 0.1), ("alpha_bias:offset", 0.009), ("aileron_power:change", 0.25),
        ("elevator_rate_limit:reduction", 0.65))),
])  # fmt: skip
def test_an_injected_effect_is_found_with_its_size(effect, value):
    name, _, parameter = effect.partition(":")
    found = diagnosed(effect, value, 3, 13 if name == "lift_slope" else None)
    assert found.verdict == "explained"
    assert first(found) == [name]
    fitted = found.effects[0]["parameters"][parameter]
    half = 0.5 * (fitted["high95"] - fitted["low95"])
    assert abs(fitted["estimate"] - value) < 3.0 * half
    assert half < abs(value)
    assert [found.effects[0][key] for key in ("scope", "history", "sizes")] == ["shared", None, None]


def test_the_gap_of_a_found_effect_closes_on_a_record_not_used():
    held = diagnosed("lift_slope:change", -0.25, 3, 13).gap["held_out"]
    assert held["before"] > held["after"]
    assert held["closure"] > 0.6
    assert held["closure_low95"] <= held["closure"] <= held["closure_high95"]


def test_a_clean_aircraft_is_not_blamed_and_there_is_nothing_to_close():
    found = diagnosed("", 0.0, 5, 6)
    assert found.verdict == "no_gap"
    assert found.gap["held_out"]["closure"] in (None, 0.0)  # one record in twenty lies above the 95 % quantile
    assert found.resimulate["command"] == "icing fly clear_air"
    assert "lift_slope" in found.detection_limits


def test_an_effect_left_out_of_the_library_is_not_named():
    found = diagnose([flown("alpha_bias:offset", 0.014, 3)], without=["alpha_bias"])
    assert found.verdict != "no_gap"
    assert all("alpha_bias" not in h["effects"] for h in found.hypotheses)


@pytest.mark.parametrize(("effect", "value", "component", "term"), [
    ("rudder_power:change", -0.35, "yawing_moment", "rudder"),
    pytest.param("dihedral_effect:change", 0.6, "rolling_moment", "beta", marks=pytest.mark.slow),
])  # fmt: skip
def test_a_neighbour_that_helps_the_models_own_numbers_within_their_range_is_not_the_cause(effect, value, component,
                                                                                         term):
    """No number may be so far off; any effect that takes what is beyond would explain all, if that were held for it."""
    found = diagnose([flown(effect, value, 3)], without=[effect.partition(":")[0]])
    assert found.verdict == "unknown" and found.unknown["component"] == component
    assert any(term in told["term"] for told in found.unknown["terms"])


def test_the_answer_has_its_form():
    result = answer(diagnosed("lift_slope:change", -0.25, 3, 13))
    assert set(result) == KEYS
    assert sum(h["probability"] for h in result["hypotheses"]) == pytest.approx(1.0, abs=1e-9)
    assert set(result["where"]) == {"channels", "components", "regimes"}
    assert set(result["gap"]["held_out"]) == {"before", "after", "closure", "closure_low95", "closure_high95",
                                              "after_effects_alone", "closure_effects_alone", "worst_channel",
                                              "by_channel"}  # fmt: skip
    tested = {e for h in result["hypotheses"] for e in h["effects"]}
    untested = {n["effect"] for n in result["not_testable"]}
    assert tested.isdisjoint(untested) and tested | untested == set(LIBRARY)
    assert set(result["detection_limits"]) == tested


def test_a_record_in_which_the_filter_does_not_settle_is_refused():
    assert SHORTEST > SETTLE
    record = flown("alpha_bias:offset", 0.014, 3)
    with pytest.raises(InputError, match=r"lasts 3 s; at least 5 are needed"):
        diagnose([record.slice(0.0, 3.0)])
    assert diagnose([record.slice(0.0, 5.2)]).verdict in ("no_gap", "explained", "unknown")


def test_names_and_notes_of_a_record_change_nothing():
    record = flown("alpha_bias:offset", 0.014, 3).slice(0.0, 20.0)
    lying = replace(record, meta=replace(record.meta, name="mass_error", notes="mass_error 0.2", flight="thrust_loss"))
    honest, told = diagnose([record]), diagnose([lying])
    assert told.verdict == honest.verdict
    assert [h["effects"] for h in told.hypotheses[:3]] == [h["effects"] for h in honest.hypotheses[:3]]
    # sums of half a million products differ in their last digits with where the arrays lie in memory
    assert [h["probability"] for h in told.hypotheses] == pytest.approx(
        [h["probability"] for h in honest.hypotheses], rel=1e-3, abs=1e-6)  # fmt: skip
    assert told.provenance["records"][0]["sha256"] == honest.provenance["records"][0]["sha256"]


def test_commands_absent_means_actuators_are_not_testable():
    record = flown("elevator_lag:extra", 0.1, 3)
    bare = replace(record, channels={n: v for n, v in record.channels.items() if not n.endswith("_command")})
    found = diagnose([bare.slice(0.0, 30.0)])
    missing = {n["effect"] for n in found.not_testable}
    assert {"elevator_lag", "aileron_gearing", "rudder_lag"} <= missing
    assert found.verdict == "no_gap"


def test_truth_beside_a_record_is_never_opened(tmp_path, monkeypatch, capsys):
    import builtins
    import pathlib

    path = tmp_path / "a.csv"
    write(flown("", 0.0, 5).slice(0.0, 20.0), path)
    (tmp_path / "a.truth.csv").write_text("time,lift_slope\n0,1\n")
    opened = []
    genuine_open, genuine_bytes = builtins.open, pathlib.Path.read_bytes
    monkeypatch.setattr(builtins, "open", lambda f, *a, **k: (opened.append(str(f)), genuine_open(f, *a, **k))[1])
    monkeypatch.setattr(pathlib.Path, "read_bytes", lambda p: (opened.append(str(p)), genuine_bytes(p))[1])
    assert _run(["diagnose", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"] == "no_gap"
    assert str(path) in opened
    assert not [f for f in opened if "truth.csv" in f]


@pytest.mark.parametrize(("arguments", "word"), [
    (["diagnose"], "RECORD"), (["diagnose", "no_such.csv"], "no_such.csv"),
    (["diagnose", "{record}", "--without", "lift_slop"], "lift_slope"),
])  # fmt: skip
def test_bad_input_is_one_line_and_exit_2(arguments, word, tmp_path, capsys):
    path = tmp_path / "a.csv"
    write(flown("", 0.0, 5).slice(0.0, 20.0), path)
    assert _run([a.format(record=path) for a in arguments]) == 2
    said = capsys.readouterr().err.strip()
    assert len(said.splitlines()) == 1
    assert word in said


@pytest.mark.slow
def test_misfit_that_nothing_explains_counts_as_noise_and_not_as_proof():
    record = flown("", 0.0, 5).slice(0.0, 30.0)
    rough = np.sin(2.7 * record.time) * np.sign(np.sin(0.9 * record.time))
    spoilt = dict(record.channels) | {"az": record["az"] + 2.0 * rough, "q": record["q"] + 0.03 * np.roll(rough, 7)}
    found = diagnose([replace(record, channels=spoilt)])
    assert found.verdict != "no_gap"
    assert found.provenance["tempering"] > 2.0


def test_a_record_without_what_is_needed_is_refused():
    record = flown("", 0.0, 5)
    short = FlightRecord({n: v for n, v in record.channels.items() if n != "theta"}, RecordMeta(name="x"))
    with pytest.raises(InputError, match="lacks theta"):
        diagnose([short])


def test_the_predictor_forgets_its_start():
    flight = reconstruct(flown("", 0.0, 5))
    A, C, _ = linearise(flight)
    for gain in gains(flight, (0.02, 0.5, 2.0)):
        assert np.max(np.abs(np.linalg.eigvals(A - gain.K[-1] @ C[:, :FED_BACK]))) < 1.0


def test_undoing_the_low_pass_gives_the_positions_back():
    rng = np.random.default_rng(0)
    truth = rng.standard_normal(200)
    share = 1.0 - np.exp(-2.0 * np.pi * 10.0 * 0.02)
    seen = np.empty(200)
    seen[0] = truth[0]
    for k in range(1, 200):
        seen[k] = seen[k - 1] + share * (truth[k] - seen[k - 1])
    assert unfiltered(seen, 10.0, 0.02) == pytest.approx(truth, abs=1e-12)


def test_every_effect_has_sizes_to_try_inside_its_range():
    candidates = bank()
    assert len({row for f in candidates.families for row in f.rows} | {t.row for t in candidates.terms}) == (
        candidates.size - 1 - len(nuisances()))  # fmt: skip
    for family in candidates.families:
        p = family.parameter
        assert all(p.low <= s <= p.high and s != p.neutral for s in nodes(p))
        grid = np.linspace(p.low, p.high, 801)
        assert np.sum(size_prior(p, grid) * np.gradient(grid)) == pytest.approx(1.0, abs=1e-6)
        assert all(p.low <= s <= p.high and s != p.neutral for s in family.nodes)


def test_pieces_of_a_range_cover_it_and_share_its_prior():
    for whole in unbroken(bank().families):
        parts = [f for f in bank().families if f.effect is whole.effect and f.parameter is whole.parameter]
        parts.sort(key=lambda f: f.low)
        name = whole.effect.name, whole.parameter.name
        assert (parts[0].low, parts[-1].high) == (FROM.get(name, whole.low), whole.high)
        assert all(a.high == b.low for a, b in pairwise(parts))
        grids = [np.linspace(f.low, f.high, 2001) for f in parts]
        mass = sum(float(np.sum(piece_prior(f, g) * np.gradient(g))) for f, g in zip(parts, grids, strict=True))
        sizes = np.linspace(whole.low, whole.high, 4001)
        prior = size_prior(whole.parameter, sizes) * np.gradient(sizes)
        less = float(np.sum(prior[sizes < parts[0].low]))  # nothing, but where another effect says as much
        assert mass == pytest.approx(1.0 - less, abs=0.02)


def test_commands_that_act_one_sample_later_are_put_in_step_and_one_lagging_surface_is_not():
    asked = reconstruct(flown("elevator_lag:extra", 0.1))
    assert in_step([asked])[0].commands["elevator_command"] is asked.commands["elevator_command"]
    early = replace(asked, commands={n: np.concatenate([c[1:], c[-1:]]) for n, c in asked.commands.items()})
    (found,) = in_step([early])
    assert found.commands["elevator_command"][2:-2] == pytest.approx(asked.commands["elevator_command"][2:-2])
    assert any("1 samples later" in note for note in found.notes)


def test_the_credible_set_is_the_smallest_that_holds_95_percent():
    assert credible([0.96, 0.04]) == [0]
    assert credible([0.6, 0.34, 0.06]) == [0, 1, 2]


def test_gap_is_zero_for_noise_and_counts_what_exceeds_it():
    alone = np.full((5, 3, 2), 0.04)
    assert gap.g(np.full((3, 2), 0.04), alone) == 0.0
    assert gap.g(np.full((3, 2), 1.04), alone) == pytest.approx(1.0)
