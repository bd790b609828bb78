"""The command line: verbs, JSON, and errors told in one line."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest
from flights import flight_data, lateral, longitudinal

from icing_env.record import write
from testbed import cli
from testbed.commands.common import plain

NAMES = ["name", "component", "description", "parameters", "source"]


def run(capsys, *args):
    """Exit code, standard output and standard error of one call."""
    with pytest.raises(SystemExit) as end:
        cli.main([str(arg) for arg in args])
    out, err = capsys.readouterr()
    return end.value.code, out, err


IMPORTED = """
import sys
from testbed import cli
try:
    cli.main(sys.argv[1:])
finally:
    print([m for m in ("numba", "scipy", "matplotlib", "control", "torch") if m in sys.modules])
"""


@pytest.mark.parametrize("args", [["--help"], *([verb, "--help"] for verb in cli.VERBS)])
def test_help_imports_nothing_slow(args):
    done = subprocess.run([sys.executable, "-c", IMPORTED, *args], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "[]"


def test_help_lists_every_verb(capsys):
    code, out, err = run(capsys, "--help")
    assert (code, err) == (0, "")
    assert re.findall(r"^  (\w+) ", out.partition("Verbs:\n")[2], re.MULTILINE) == list(cli.VERBS)


@pytest.mark.parametrize("verb", cli.VERBS)
def test_every_verb_has_an_example_json_and_seed(capsys, verb):
    code, out, err = run(capsys, verb, "--help")
    assert (code, err) == (0, "")
    if "Commands:" in out:  # a verb of verbs: each of those has them
        return
    assert "--json" in out
    assert "--seed" in out
    assert f"Example:\n    icing {verb}" in out


def test_no_arguments_show_the_help(capsys):
    code, out, err = run(capsys)
    assert (code, err) == (0, "")
    assert out.startswith("Usage: icing")


@pytest.mark.parametrize("args, says", [
    (["nonsense"], "no verb 'nonsense'"),
    (["efects"], "did you mean 'effects'?"),
    (["effects", "--jsn"], "--json"),
    (["identify"], "RECORD"),
    (["identify", "nowhere.csv"], "nowhere.csv"),
    (["identify", "--method", "guess", "nowhere.csv"], "guess"),
    (["effects", "--seed", "-1"], "--seed"),
])  # fmt: skip
def test_bad_input_is_told_in_one_line(capsys, args, says):
    code, out, err = run(capsys, *args)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert says in err


def test_a_bad_record_is_told_in_one_line(capsys, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("time,alpha\n0,1\n0,x\n")
    code, out, err = run(capsys, "identify", path)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert "bad.csv" in err


@pytest.mark.parametrize("error, expected", [
    (RuntimeError("two\nlines"), 1), (KeyboardInterrupt(), 130), (FileNotFoundError(2, "No such file", "a.csv"), 2),
])  # fmt: skip
def test_other_errors_are_short_too(capsys, monkeypatch, error, expected):
    def fail(*args, **settings):
        raise error

    monkeypatch.setattr(cli.icing, "main", fail)
    monkeypatch.delenv("ICING_DEBUG", raising=False)
    code, out, err = run(capsys, "effects")
    assert (code, out) == (expected, "")
    assert len(err.splitlines()) == (expected != 130)


def test_debug_shows_where_an_error_came_from(capsys, monkeypatch):
    monkeypatch.setenv("ICING_DEBUG", "1")
    code, _, err = run(capsys, "identify", "nowhere.csv")
    assert code == 2
    assert "Traceback" in err
    assert err.splitlines()[-1].startswith("icing: ")


def test_a_closed_pipe_is_no_error_to_show():
    program = "import subprocess, sys; sys.exit(0)"
    command = f"{sys.executable} -m testbed.cli effects | {sys.executable} -c '{program}'"
    done = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert done.stderr == ""


def test_effects_as_json_is_the_library(capsys):
    code, out, err = run(capsys, "effects", "--json")
    library = json.loads(out)
    assert (code, err) == (0, "")
    assert len({effect["name"] for effect in library}) == len(library) >= 15
    assert {effect["component"] for effect in library} == {
        "aerodynamics", "propulsion", "mass", "actuator", "sensor", "environment"}  # fmt: skip
    for effect in library:
        assert list(effect) == NAMES
        for parameter in effect["parameters"]:
            assert list(parameter) == ["name", "unit", "neutral", "typical", "low", "high"]
            assert parameter["low"] <= parameter["neutral"] <= parameter["high"]


def test_identify_refuses_what_a_record_does_not_show(capsys, tmp_path):
    write(longitudinal(), tmp_path / "pitch.csv")
    code, out, err = run(capsys, "identify", tmp_path / "pitch.csv", "--json")
    found = json.loads(out)
    assert (code, err) == (0, "")
    assert found["derivatives"]["Cm_alpha"]["estimate"] < 0
    assert {"estimate", "std_error", "unit", "method"} <= set(found["derivatives"]["Cm_alpha"])
    assert not set(found["refused"]) & set(found["derivatives"])
    assert "records" not in found


def test_several_records_complete_one_another(capsys, tmp_path):
    write(longitudinal(), tmp_path / "pitch.csv")
    write(lateral(), tmp_path / "roll.csv")
    code, out, _ = run(capsys, "identify", tmp_path / "pitch.csv", tmp_path / "roll.csv", "--json")
    found = json.loads(out)
    assert code == 0
    assert {"Cm_q", "Cl_p"} <= set(found["derivatives"])
    assert "Cl_p" not in found["records"][str(tmp_path / "pitch.csv")]["derivatives"]
    assert not set(found["refused"]) & set(found["derivatives"])


def test_identify_reads_recorded_flights(capsys):
    code, out, _ = run(capsys, "identify", flight_data("totter_demo_data.mat"), "--mode", "textbook")
    assert code == 0
    assert "Cm_elevator" in out
    assert "refused" in out


def test_json_has_no_nan_and_knows_numpy():
    value = plain({"a": np.array([1.0, math.nan]), "b": np.float32(2.0), "c": (math.inf, np.int64(3), np.bool_(True))})
    assert value == {"a": [1.0, None], "b": 2.0, "c": [None, 3, True]}
    with pytest.raises(TypeError, match="object"):
        plain(object())
