"""The scorer: right answers score right, dealt answers at chance, classes count only where they are true."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks import diagnosis as run
from testbed.withheld import files, score

NAMES = [f"effect_{i}" for i in range(20)]


def key(tier: str, parts: list[str], sigma: float, none: float = 20.0, pair: float = 10.0, **changes) -> dict:
    return {"tier": tier, "sigma_w": sigma, "effects": parts, "forms": ["same"] * len(parts), "D_none": none,
            "parameters": {n: {"size": 1.0} for n in parts}, "where": [f"place_{n}" for n in parts], "D_pair": pair,
            "D": {n: 0.0 if n in parts else 15.0 for n in NAMES}, "salt": "x",
            "held_out": {"before": 0.5, "oracle": 0.1, "spread": 0.2, "own_before": 0.5, "own_oracle": 0.1,
                         "noise": 0.1}} | changes  # fmt: skip


def answer(parts: list[str], unknown: bool = False, p: float = 0.97, near: tuple[str, ...] = ()) -> dict:
    hypotheses = [{"effects": parts, "unknown": unknown, "probability": p},
                  {"effects": [], "unknown": not unknown, "probability": 1.0 - p}]
    told = {"size": {"estimate": 1.0, "low95": 0.9, "high95": 1.1, "unit": "1"}}
    return {"verdict": "explained" if parts else "unknown" if unknown else "no_gap", "hypotheses": hypotheses,
            "credible_set_95": [0], "where": {"components": {f"place_{n}": p for n in parts}}, "seconds": 2.0,
            "effects": [{"name": n, "probability": p, "indistinguishable_from": list(near), "parameters": told}
                        for n in parts], "gap": {"held_out": {"closure": 0.9 if parts else None}}}  # fmt: skip


def write(folder: Path, pairs: list[tuple[dict, dict]], prefix: str = "c") -> tuple[Path, Path]:
    for part in ("answers", "keys"):
        (folder / part).mkdir()
    for i, (told, true) in enumerate(pairs):
        (folder / "answers" / f"{prefix}{i:03}.json").write_text(json.dumps(told))
        (folder / "keys" / f"{prefix}{i:03}.json").write_text(json.dumps(true))
    return folder / "answers", folder / "keys"


def test_singles_that_cannot_be_told_have_an_ideal_observer_beside(tmp_path):
    """One stands 3.5 from none, half are told; one is as near to a rival, half are named; one in another form."""
    alike = {n: 0.0 if n == NAMES[0] else 15.0 for n in NAMES}
    pairs = [(answer([NAMES[0]]), key("single", [NAMES[0]], 0.0)),  # can be told
             (answer([]), key("single", [NAMES[0]], 0.0, none=score.SAME)),
             (answer([NAMES[1]]), key("single", [NAMES[0]], 0.5, D=alike | {NAMES[1]: 0.0})),
             (answer([NAMES[0]]), key("single", [NAMES[0]], 1.5, D=dict.fromkeys(NAMES, 15.0) | {
                 NAMES[0]: 3.0, NAMES[1]: 5.0}))]
    found = score.score(*write(tmp_path, pairs))
    assert found["identifiable_singles"] == 1 and found["elsewhere_top1"] == pytest.approx(1.0 / 3.0)
    other = 0.9772  # of a normal deviate, below half of the root of 5^2 - 3^2
    assert found["elsewhere_ideal"] == pytest.approx((0.5 + 0.5 + other) / 3.0, abs=1e-4)


@pytest.fixture
def perfect(tmp_path) -> tuple[Path, Path]:
    return perfect_of(tmp_path)


def perfect_of(tmp_path) -> tuple[Path, Path]:
    """Answers to a set of the usual tiers, all right."""
    pairs = []
    for i in range(120):
        sigma, name, second = (0.0, 0.5, 1.5)[i % 3], NAMES[i % 20], NAMES[(i + 7) % 20]
        tier = ("null", "single", "single", "pair", "unknown")[(i // 3) % 5]
        parts = {"null": [], "unknown": ["never"], "single": [name], "pair": [name, second]}[tier]
        told = [] if tier == "unknown" else parts
        pairs.append((answer(told, tier == "unknown"), key(tier, parts, sigma)))
    return write(tmp_path, pairs)


def test_right_answers_score_right(perfect):
    found = score.score(*perfect)
    for name in ("top1", "top3", "pair_exact_set", "unknown_auroc_above_8", "where_f1", "coverage95",
                 "mean_set_size", "parameter_coverage95", "unknown_tpr_at_5_fpr"):  # fmt: skip
        assert found[name] == 1.0, name
    assert found["null_false_alarm"] == 0.0 and found["closure_told_median"] == 0.9 and found["seconds_per_case"] == 2.0
    assert found["top1_by_gust"] == {"0": 1.0, "0.5": 1.0, "1.5": 1.0}
    assert found["unknown_auroc_5_to_8"] is None and found["closure_median"] is None
    assert found["intervals95"]["top1"] == [1.0, 1.0]
    assert {"cases", "top1", "by_tier", "mismatched_form", "baselines", "ece"} <= set(found)


def test_permuted_keys_score_at_chance(perfect):
    dealt = score.score(*perfect)["baselines"]["permuted_keys"]
    assert dealt["top1"] < 0.2  # a twentieth of the effects, and only where a single meets a single
    assert abs(dealt["unknown_auroc_above_8"] - 0.5) < 0.2
    assert dealt["null_false_alarm"] > 0.6
    silent = score.score(*perfect)["baselines"]["always_no_gap"]
    assert silent["top1"] == 0.0 and silent["null_false_alarm"] == 0.0


def test_a_class_counts_only_where_every_member_is_truly_near():
    told = answer(["effect_1"], near=("effect_2", "effect_3"))
    near = {n: 2.0 if n in ("effect_1", "effect_2", "effect_3") else 15.0 for n in NAMES} | {"effect_2": 0.0}
    assert score.flat(told, key("single", ["effect_2"], 0.0, D=near))["top1"]
    assert not score.flat(told, key("single", ["effect_2"], 0.0, D=near | {"effect_3": 4.0}))["top1"]
    assert not score.flat(told, key("single", ["effect_4"], 0.0, D=near))["top1"]


def test_identifiable_means_that_the_own_name_is_nearest():
    assert score.identifiable(key("single", ["effect_1"], 0.0))
    assert not score.identifiable(key("single", ["effect_1"], 0.0, none=5.0))
    bent = dict.fromkeys(NAMES, 30.0) | {"effect_1": 29.8}
    assert not score.identifiable(key("single", ["effect_1"], 0.0, none=40.0, D=bent))


def test_a_pair_is_identifiable_where_no_other_set_comes_as_near():
    pair = ["effect_1", "effect_2"]
    assert score.identifiable(key("pair", pair, 0.0, D_own_set=1.0, D_rival_set=5.2))
    assert not score.identifiable(key("pair", pair, 0.0, D_own_set=12.0, D_rival_set=12.9))  # another form than ours
    assert not score.identifiable(key("pair", pair, 0.0))  # a key that does not tell
    assert not score.identifiable(key("unknown", ["never"], 0.0, D_own_set=None, D_rival_set=None))
    told = [(answer(pair), key("pair", pair, 0.0, D_own_set=0.0, D_rival_set=r)) for r in (6.0, 2.0)]
    told.append((answer(["effect_1"]), key("pair", pair, 0.0, D_own_set=0.0, D_rival_set=6.0)))
    found = score.figures([score.flat(*one) for one in told])
    assert found["identifiable_pairs"] == 2 and found["identifiable_pair_exact_set"] == 0.5
    assert found["pair_exact_set"] == pytest.approx(2.0 / 3.0) and found["identifiable_singles"] == 0


def test_a_refused_record_is_wrong_and_counted():
    case = score.flat({"error": "no"}, key("null", [], 0.0))
    assert case["alarm"] and case["failed"] and not case["top3"] and not case["covered"]


def test_closure_is_that_of_the_answer_flown_again_and_counts_where_there_is_a_gap(tmp_path):
    held = {"before": 1.0, "oracle": 0.2, "spread": 0.5, "own_before": 0.8, "own_oracle": 0.0, "noise": 0.1}
    small = held | {"before": 0.4, "own_before": 0.05}
    pairs = [(answer(["effect_1"]), key("single", ["effect_1"], 0.0, held_out=h)) for h in (held, held, small)]
    folders = write(tmp_path, pairs)
    (tmp_path / "refly").mkdir()
    for name, after, alone, own in (("c000", 0.2, 0.4, 0.0), ("c001", 0.6, 0.8, 0.4), ("c002", 0.0, 0.0, 0.0)):
        left = {"after": after, "effects_after": alone, "own_after": own}
        (tmp_path / "refly" / f"{name}.json").write_text(json.dumps(left))
    found = score.score(*folders, tmp_path / "refly")
    assert found["closure_median"] == pytest.approx(0.6)  # of 0.8 and 0.4; the third has no gap to close
    assert found["oracle_fraction"] == pytest.approx(0.6)  # the true aircraft, its own derivatives too, closes all
    assert found["closure_effects_median"] == pytest.approx(0.4)  # of 0.6 and 0.2
    assert found["oracle_fraction_effects"] == pytest.approx(0.5)
    assert found["closure_own_median"] == pytest.approx(0.75) and found["oracle_fraction_own"] == pytest.approx(0.75)
    assert found["closure_told_median"] == 0.9


def test_an_unknown_is_placed_where_it_is_one_of_the_components_that_it_enters_at(tmp_path):
    told = [answer([], unknown=True) | {"unknown": {"component": f"place_{n}"}} for n in ("a", "a", "b")]
    true = [key("unknown", ["a"], 0.0), key("unknown", ["a", "c"], 0.0), key("unknown", ["a"], 0.0)]
    found = score.score(*write(tmp_path, [*zip(told, true, strict=True), (answer([]), key("unknown", ["a"], 0.0))]))
    assert found["unknown_placed"] == pytest.approx(2 / 3)  # of those told as unknown


def test_an_effect_beside_an_unknown_one_is_told_where_both_are(tmp_path):
    """Each counts by itself, too; a place is the unknown one's alone."""
    def true(known: float, strange: float) -> dict:
        return key("beside", ["a", "x"], 0.5, known=["a"], D_known=known, D_strange=strange, where_strange=["place_x"])

    told = [(answer(["a"], unknown=True) | {"unknown": {"component": "place_x"}}, true(20.0, 9.0)),
            (answer(["b"], unknown=True) | {"unknown": {"component": "place_a"}}, true(20.0, 9.0)),
            (answer(["a"]), true(20.0, 4.0)), (answer([], unknown=True), true(5.0, 9.0)),
            (answer([]), key("null", [], 0.5))]  # fmt: skip
    found = score.score(*write(tmp_path, told))
    tier = found["by_tier"]["beside"]
    assert (tier["cases"], tier["right"], tier["exact_if_able"]) == (4, 0.25, 0.5)
    assert (tier["has_known"], tier["has_unknown"], tier["placed"]) == (0.5, 0.75, 0.25)
    assert found["unknown_auroc_above_8"] is None and found["pair_exact_set"] is None
    (tmp_path / "usual").mkdir()
    assert "beside" not in score.score(*perfect_of(tmp_path / "usual"))["by_tier"]
    shown = [row[0] for row in run.tables(found | {"set": "x", "failures": []})[0][2]]
    assert "beside: has known" in shown and "beside: placed" in shown


def test_calibration_and_auroc_against_numbers_worked_out_by_hand():
    assert score.auroc([2.0, 3.0], [1.0, 2.0]) == pytest.approx(0.875)
    rng = np.random.default_rng(1)
    p = rng.uniform(0.05, 0.95, 30_000)
    cases = [{"inclusion": list(zip(p, rng.random(len(p)) < p, strict=True))}]
    assert score.calibration_error(cases) < 0.02
    assert score.calibration_error([{"inclusion": [(0.9, False)] * 100}]) == pytest.approx(0.9)


def test_luck_makes_as_much_of_calibrated_probabilities_as_is_said():
    rng = np.random.default_rng(3)
    told = rng.uniform(0.02, 0.98, (100, 400))
    sets = [[{"inclusion": list(zip(row, rng.random(400) < row, strict=True))}] for row in told]
    found = np.mean([score.calibration_error(cases) for cases in sets])
    assert score.calibration_error(sets[0], by_luck=True) == pytest.approx(found, rel=0.05)


def test_the_scorer_imports_nothing_but_numpy_beside_what_python_has():
    tree = ast.parse(Path(score.__file__).read_text())
    names = {n.module if isinstance(n, ast.ImportFrom) else a.name for n in ast.walk(tree)
             if isinstance(n, ast.Import | ast.ImportFrom) for a in n.names}  # fmt: skip
    assert names <= {"__future__", "json", "math", "re", "sys", "collections.abc", "pathlib", "statistics", "typing",
                     "numpy"}


def test_the_scorer_runs_where_it_lies(perfect):
    command = [sys.executable, score.__file__, *map(str, perfect)]
    said = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(said.stdout)["top1"] == 1.0


def test_a_killed_run_goes_on_with_the_answers_it_has(perfect, tmp_path):
    names = [p.stem for p in sorted(perfect[0].iterdir())]
    for name in names:
        files.write_case(tmp_path / "records" / name, {"1.csv": "time\n0\n"})
    sealed = files.manifest(tmp_path / "records", tmp_path / "keys", names) | {
        "count": len(names), "development_seed": run.DEVELOPMENT_SEED}
    files.write_text(tmp_path / "manifest.json", json.dumps(sealed))
    (tmp_path / "keys").chmod(0)  # as a kill leaves it
    (tmp_path / "refly").mkdir()
    for name in names:  # as if flown again before
        (tmp_path / "refly" / f"{name}.json").write_text('{"after": 0.1, "own_after": 0.1, "command": ""}')
    said: list[str] = []
    ledger = tmp_path / "ledger.csv"
    for _ in range(2):
        found = run.measure(tmp_path, len(names), 0, 1, said.append, ledger=ledger)
    assert found["top1"] == 1.0 and found["set"] == "development" and said == ["scoring"] * 2
    lines = [line.split(",") for line in ledger.read_text().splitlines()]
    assert [line[1] for line in lines] == ["set", "development drawn", "development", "development"]
    assert len({line[4] for line in lines[1:]}) == 1 and lines[1][5] == "" and lines[2][5] == "1"
    assert run.tables(found)[0][2][0][1] == "120"
    for cases, seed in ((5, 0), (len(names), 1), (len(names), None)):
        with pytest.raises(run.InputError, match="holds a development set of 120 cases"):
            run.measure(tmp_path, cases, seed, 1, said.append)
    (tmp_path / "keys" / f"{names[0]}.json").write_text("{}")
    with pytest.raises(run.InputError, match="not those of the manifest"):
        run.measure(tmp_path, len(names), 0, 1, said.append)


def test_an_effect_left_out_of_the_library_is_unknown_or_a_near_rival(tmp_path):
    near = dict.fromkeys(NAMES, 15.0) | {"effect_1": 0.0, "effect_2": 3.0}
    told = [answer([], unknown=True), answer(["effect_2"]), answer(["effect_3"]), answer([]), {"error": "no"}]
    answers, keys = write(tmp_path, [(a, key("single", ["effect_1"], 0.5, D=near)) for a in told])
    found = score.score(answers, keys, None, answers)["by_tier"]["without"]
    assert found["cases"] == 5 and found["right"] == pytest.approx(0.4) == found["right_by_gust"]["0.5"]
    assert (found["told_unknown"], found["near"], found["silent"]) == pytest.approx((0.2, 0.2, 0.2))
    assert found["right_by_gust"]["0"] is None
    assert "without" not in score.score(answers, keys, None, tmp_path / "none")["by_tier"]


def test_every_effect_is_left_out_once_at_every_gust_an_identifiable_case_first(tmp_path):
    blurred = dict.fromkeys(NAMES, 1.0)
    drawn = [key("single", ["effect_1"], 0.0, D=blurred), key("single", ["effect_1"], 0.0),
             key("single", ["effect_1"], 0.0), key("single", ["effect_1"], 1.5),
             key("single", ["effect_2"], 0.0, none=2.0), key("single", ["effect_3"], 0.0, D=blurred),
             key("pair", ["effect_4", "effect_5"], 0.0), key("null", [], 0.0)]  # fmt: skip
    _, keys = write(tmp_path, [({}, k) for k in drawn])
    (keys / "seed.json").write_text("{}")
    assert run.removals(keys) == {"c001": "effect_1", "c003": "effect_1", "c005": "effect_3"}
