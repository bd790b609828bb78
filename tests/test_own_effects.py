"""Effects of a user's own: twenty lines outside the package are flown, listed and diagnosed; bad ones are refused."""

from __future__ import annotations

import json
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from icing_env import scenario
from icing_env.effects import LIBRARY, own
from icing_env.errors import InputError
from icing_env.record import write
from testbed.cli import _run
from testbed.flight import fly

EXAMPLE = Path(__file__).parent.parent / "examples" / "own_effect.py"
DRAG = 0.012  # twice the example's typical size
GOOD = """
from icing_env.effects import Effect, Parameter
def apply(p, values):
    p["Cm_0"] += values["moment"]
EFFECT = Effect("bent", "aerodynamics", ("pitching_moment",), "A bent tail", "assumed",
                (Parameter("moment", "1", 0.0, 0.02, -0.1, 0.1),), apply)
"""


@pytest.fixture(autouse=True)
def library_as_it_was(monkeypatch):
    kept = dict(LIBRARY)
    yield
    LIBRARY.clear()
    LIBRARY.update(kept)


def test_the_example_is_twenty_lines():
    code = EXAMPLE.read_text().split('if __name__ == "__main__"')[0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 20


def test_a_record_with_an_effect_of_ones_own_is_diagnosed_as_that_effect(tmp_path, capsys):
    path = tmp_path / "a.csv"
    own.from_file(EXAMPLE)
    chosen = scenario.load("clear_air", duration=36.0, effects={"wing_camera": {"drag": DRAG}})
    write(fly(chosen, seed=4, observer=False, protection=False).record, path)
    del LIBRARY["wing_camera"]
    assert _run(["diagnose", str(path), "--effects-from", str(EXAMPLE), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["verdict"] == "explained"
    assert told["hypotheses"][0]["effects"] == ["wing_camera"]
    assert told["effects"][0]["parameters"]["drag"]["estimate"] == pytest.approx(DRAG, rel=0.15)
    assert "wing_camera" in told["detection_limits"]
    del LIBRARY["wing_camera"]
    assert _run(["diagnose", str(path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["verdict"] != "no_gap"
    assert all("wing_camera" not in h["effects"] for h in told["hypotheses"])


def test_the_command_line_flies_and_lists_it(tmp_path, capsys):
    (tmp_path / "mine.py").write_text(GOOD)
    assert _run(["effects", "--effects-from", str(tmp_path / "mine.py"), "--json"]) == 0
    assert "bent" in {e["name"] for e in json.loads(capsys.readouterr().out)}
    assert _run(["fly", "clear_air", "--effects-from", str(tmp_path / "mine.py"), "--effect", "bent:moment=0.01",
                 "--duration", "1", "--json"]) == 0  # fmt: skip


@pytest.mark.parametrize(("old", "new", "word"), [
    ("EFFECT = Effect", "EFFECT = dict", "does not run"),
    (GOOD, "nothing = 1", "no Effect in it"),
    (GOOD, "def f(:", "SyntaxError"),
    ('"bent"', '"tail_ice"', "already in the library"),
    ('"bent"', '"a tail, bent"', "letters, digits"),
    ('"aerodynamics"', '"aerodynamic"', "did you mean 'aerodynamics'"),
    ('"pitching_moment"', '"pitch_moment"', "did you mean 'pitching_moment'"),
    ('p["Cm_0"]', 'p["Cm_zero"]', "Cm_zero"),
    ('+= values["moment"]', '+= 0.01', "neutral values change"),
    ('+= values["moment"]', '+= 0.0*values["moment"]', "typical values change nothing"),
    ('+= values["moment"]', '+= max(values["moment"])', "apply fails"),
    ("0.02, -0.1", "0.2, -0.1", "low <= neutral"),
])  # fmt: skip
def test_a_bad_file_is_one_line_and_exit_2(old, new, word, tmp_path, capsys):
    (tmp_path / "mine.py").write_text(GOOD.replace(old, new))
    assert _run(["effects", "--effects-from", str(tmp_path / "mine.py")]) == 2
    said = capsys.readouterr().err.strip()
    assert len(said.splitlines()) == 1
    assert word in said


def test_a_file_that_is_not_there_is_named(capsys):
    assert _run(["effects", "--effects-from", "no_such.py"]) == 2
    assert "no_such.py" in capsys.readouterr().err


def test_a_file_read_again_replaces_its_own_effects_and_nobody_elses(tmp_path):
    for name in ("mine.py", "yours.py"):
        (tmp_path / name).write_text(GOOD)
    own.from_file(tmp_path / "mine.py")
    effect = LIBRARY["bent"]
    assert own.register(effect) is effect
    own.from_file(tmp_path / "mine.py")
    assert LIBRARY["bent"] is not effect
    with pytest.raises(InputError, match="already"):
        own.from_file(tmp_path / "yours.py")


@pytest.mark.parametrize("value", ["mine_announced", "mine_announced:EFFECT"])
def test_what_a_package_announces_is_registered(value, tmp_path, monkeypatch):
    (tmp_path / "mine_announced.py").write_text(GOOD)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(own, "entry_points", lambda group: [EntryPoint("mine", value, group)])
    assert own.from_packages() == ["bent"]
    assert own.from_packages() == ["bent"]


def test_a_package_that_cannot_be_imported_is_named(monkeypatch):
    monkeypatch.setattr(own, "entry_points", lambda group: [EntryPoint("mine", "no_such_module", group)])
    with pytest.raises(InputError, match=r"'mine'.*no_such_module"):
        own.from_packages()
