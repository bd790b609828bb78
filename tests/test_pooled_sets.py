"""Sets scored together: the figures are those of all their cases, and only whole sets of one solver are taken."""

from __future__ import annotations

import io
import json
import tarfile
from pathlib import Path

import pytest
from click.testing import CliRunner
from test_withheld_score import answer, key, write

from icing_env.errors import InputError
from testbed.benchmarks.diagnosis import removals, tables
from testbed.benchmarks.failures import failures
from testbed.benchmarks.pooled_sets import pooled
from testbed.benchmarks.published_sets import publish, unpack
from testbed.commands.benchmark import command
from testbed.withheld import files

RIGHT, WRONG = "effect_1", "effect_2"


def a_set(folder: Path, right: int, wrong: int, sources: str = "one solver", **committed) -> Path:
    """A whole set of single effects, so many of them named and so many not, names its own."""
    folder.mkdir()
    pairs = [(answer([RIGHT if i < right else WRONG]) | {"provenance": {"sources": sources}},
              key("single", [RIGHT], 0.0)) for i in range(right + wrong)]  # fmt: skip
    answers, _ = write(folder, pairs, prefix=folder.name)
    names = [path.stem for path in answers.iterdir()]
    (folder / "refly").mkdir()
    for name in names:
        (folder / "refly" / f"{name}.json").write_text(json.dumps({"after": 0.1, "own_after": 0.1}))
        (folder / "records" / name).mkdir(parents=True)
        (folder / "records" / name / "1.csv").write_text("time\n0.0\n")
    told = files.manifest(folder / "records", folder / "keys", names) | {"development_seed": None} | committed
    (folder / "manifest.json").write_text(json.dumps(told))
    return folder


def test_figures_are_those_of_all_cases(tmp_path):
    first, second = a_set(tmp_path / "a", 3, 1), a_set(tmp_path / "b", 1, 3)
    assert pooled([first])["top1"] == 0.75
    found = pooled([first, second])
    assert (found["cases"], found["top1"], found["set"], found["sources"]) == (8, 0.5, "sealed", "one solver")


def test_what_failed_is_listed_with_what_was_there_and_what_was_said(tmp_path):
    found = pooled([a_set(tmp_path / "a", 2, 1)])
    (failed,) = found["failures"]
    assert failed == {"case": "a002", "tier": "single", "sigma_w": 0.0, "D": 20.0, "can_be_told": True,
                      "truth": f"{RIGHT} (same)", "answer": f"{WRONG}, 0.97"}  # fmt: skip
    (_, headers, shown) = tables(found)[-1]
    assert shown == [["single", "0", "20", "yes", f"{RIGHT} (same)", f"{WRONG}, 0.97"]]
    assert len(headers) == len(shown[0])


def test_failures_are_told_by_tier_and_the_farthest_first(tmp_path):
    unlike = {"D": {RIGHT: 0.0, WRONG: 2.0}}  # an ideal observer could not tell the two
    fault = {"fault": {"kind": "stuck", "channel": "az", "excused": []}}
    cases = [(answer([]), key("null", [], 0.0)), (answer([WRONG]), key("null", [], 1.5)),
             (answer([WRONG]), key("single", [RIGHT], 0.0) | unlike),
             (answer([], unknown=True), key("single", [RIGHT], 0.5)),
             (answer([RIGHT]), key("pair", [RIGHT, WRONG], 0.5)),
             (answer([WRONG]), key("unknown", ["never"], 0.0)),
             (answer([]), key("unknown", ["never"], 0.5, pair=30.0)),
             ({"error": "no time"}, key("faults", [], 0.0) | fault)]  # fmt: skip
    found = failures(*write(tmp_path, cases))
    assert [(one["tier"], one["D"], one["answer"]) for one in found] == [
        ("single", 20.0, "something unknown, 0.97"), ("pair", 20.0, f"{RIGHT}, 0.97"),
        ("unknown", 30.0, "no gap, 0.97"), ("unknown", 10.0, f"{WRONG}, 0.97"), ("null", 20.0, f"{WRONG}, 0.97"),
        ("faults", 20.0, "refused: no time")]  # fmt: skip
    assert found[-1]["truth"] == "stuck az, no gap"


def test_a_published_set_is_never_written_over(tmp_path):
    there = tmp_path / "a.tar.xz"
    there.write_text("kept")
    with pytest.raises(InputError, match=r"a\.tar\.xz: is there already"):
        CliRunner().invoke(command, ["diagnosis", "--publish", str(there), "--out", str(tmp_path / "out")],
                           catch_exceptions=False)  # fmt: skip
    assert there.read_text() == "kept" and not (tmp_path / "out").exists()


@pytest.mark.parametrize("asked", [("--pool", "x"), ("--jsbsim",)])
@pytest.mark.parametrize("option", ["--publish", "--ledger"])
def test_a_set_that_is_not_drawn_is_not_entered_or_published(asked, option, tmp_path):
    with pytest.raises(InputError, match=f"{option}: of a set that is drawn and solved; leave it out with {asked[0]}"):
        CliRunner().invoke(command, ["diagnosis", *asked, option, str(tmp_path / "there")], catch_exceptions=False)


def test_only_whole_sets_of_one_solver_and_kind_are_scored_together(tmp_path):
    first = a_set(tmp_path / "a", 2, 0)
    with pytest.raises(InputError, match="different sources"):
        pooled([first, a_set(tmp_path / "b", 2, 0, "another")])
    with pytest.raises(InputError, match="different set"):
        pooled([first, a_set(tmp_path / "c", 2, 0, development_seed=1)])
    with pytest.raises(InputError, match="no manifest"):
        pooled([first, tmp_path / "nowhere"])


@pytest.mark.parametrize("part", ["answers", "refly"])
def test_a_set_whose_run_has_not_ended_is_not_scored(tmp_path, part):
    (a_set(tmp_path / "a", 2, 0) / part / "a001.json").unlink()
    with pytest.raises(InputError, match=f"1 files are not there, the first is {part}/a001.json"):
        pooled([tmp_path / "a"])


def test_changed_keys_are_told(tmp_path):
    changed = a_set(tmp_path / "a", 2, 0) / "keys" / "a000.json"
    changed.write_text(changed.read_text().replace(RIGHT, WRONG))
    with pytest.raises(InputError, match="1 cases are not those of the manifest, the first is a000"):
        pooled([tmp_path / "a"])


def test_a_published_set_is_scored_as_the_folder_was(tmp_path):
    folders = [a_set(tmp_path / "a", 3, 1), a_set(tmp_path / "b", 1, 2)]
    publish(folders[0], tmp_path / "new" / "a.tar.xz")
    assert pooled([tmp_path / "new" / "a.tar.xz", folders[1]]) == pooled(folders)
    restored = unpack(tmp_path / "new" / "a.tar.xz", tmp_path / "restored")
    for sealed in (folders[0] / "keys").iterdir():
        assert (restored / "keys" / sealed.name).read_bytes() == sealed.read_bytes()
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.tar.xz"]


def test_probabilities_are_published_whole_and_the_rest_short(tmp_path):
    folder = a_set(tmp_path / "a", 2, 0)
    path = folder / "answers" / "a000.json"
    told = json.loads(path.read_text())
    told["hypotheses"][0]["probability"] = 0.1234567891234
    places = {"components": {"x_force": 0.98765432}}
    path.write_text(json.dumps(told | {"gap": {"after": 0.1234567891234}, "where": places}))
    publish(folder, tmp_path / "a.tar.xz")
    restored = json.loads((unpack(tmp_path / "a.tar.xz", tmp_path / "b") / "answers" / path.name).read_text())
    assert restored["hypotheses"] == told["hypotheses"]
    assert restored["where"] == places
    assert restored["gap"] == {"after": 0.123457}


def test_effects_left_out_of_the_library_are_published_and_scored_too(tmp_path):
    folder = a_set(tmp_path / "a", 2, 1)
    left_out = removals(folder / "keys")
    assert list(left_out.values()) == [RIGHT]
    (folder / "answers_without").mkdir()
    for name in left_out:
        told = json.dumps(answer([WRONG]) | {"provenance": {"sources": "one solver"}})
        (folder / "answers_without" / f"{name}.json").write_text(told)
    publish(folder, tmp_path / "a.tar.xz")
    found = pooled([tmp_path / "a.tar.xz"])
    assert found == pooled([folder])
    assert found["by_tier"]["without"]["cases"] == 1 and found["by_tier"]["without"]["right"] == 0.0
    assert [one["tier"] for one in found["failures"]] == ["single", "left out"]
    (folder / "answers_without" / f"{name}.json").rename(folder / "answers_without" / "other.json")
    with pytest.raises(InputError, match=f"answers_without/{name}.json"):
        pooled([folder])


def test_keys_changed_before_publishing_are_told(tmp_path):
    changed = a_set(tmp_path / "a", 2, 0) / "keys" / "a000.json"
    changed.write_text(changed.read_text().replace(RIGHT, WRONG))
    publish(tmp_path / "a", tmp_path / "a.tar.xz")
    message = r"a\.tar\.xz: keys of 1 cases are not those of the manifest, the first is a000"
    with pytest.raises(InputError, match=message):
        pooled([tmp_path / "a.tar.xz"])


def test_a_published_set_that_lacks_answers_is_named_as_it_was_given(tmp_path):
    (a_set(tmp_path / "a", 2, 0) / "answers" / "a001.json").unlink()
    publish(tmp_path / "a", tmp_path / "a.tar.xz")
    with pytest.raises(InputError, match=r"a\.tar\.xz: 1 files are not there, the first is answers/a001.json"):
        pooled([tmp_path / "a.tar.xz"])


@pytest.mark.parametrize("name", ["../outside.json", "answers/../../x.json", "/etc/x.json", "answers/a.pkl"])
def test_a_file_with_foreign_members_is_refused(tmp_path, name):
    with tarfile.open(tmp_path / "a.tar.xz", "w:xz") as archive:
        archive.addfile(tarfile.TarInfo(name), io.BytesIO(b""))
    with pytest.raises(InputError, match="no file of a published set"):
        pooled([tmp_path / "a.tar.xz"])


def test_what_is_no_published_set_is_told(tmp_path):
    (tmp_path / "a.tar.xz").write_bytes(b"not a tar file")
    with pytest.raises(InputError, match="not a published set"):
        pooled([tmp_path / "a.tar.xz"])
    whole = a_set(tmp_path / "b", 20, 20)
    publish(whole, tmp_path / "b.tar.xz")
    (tmp_path / "cut.tar.xz").write_bytes((tmp_path / "b.tar.xz").read_bytes()[:400])
    with pytest.raises(InputError, match="not a published set"):
        pooled([tmp_path / "cut.tar.xz"])
