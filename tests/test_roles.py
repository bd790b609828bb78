"""What a record is for: as its side file has it, or as the command line does."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from icing_env import scenario
from icing_env.errors import InputError
from icing_env.record import FlightRecord, write
from testbed.cli import _run
from testbed.commands.common import repeated
from testbed.commands.diagnose import by_role
from testbed.flight import fly

LISTS = ("--held-out", "--reference")


@pytest.fixture(scope="module")
def record() -> FlightRecord:
    chosen = scenario.load("clear_air", duration=20.0, parameters={"turbulence_sigma_w": 0.0})
    return fly(chosen, seed=1, observer=False, protection=False).record


def written(record: FlightRecord, folder: Path, **roles: str) -> list[Path]:
    for name, role in roles.items():
        write(replace(record, meta=replace(record.meta, role=role)), folder / f"{name}.csv")
    return [folder / f"{name}.csv" for name in roles]


@pytest.mark.parametrize(("typed", "meant"), [
    ("a --held-out b c", "a --held-out b --held-out c"),
    ("a --held-out b --reference c d --json", "a --held-out b --reference c --reference d --json"),
    ("a b --reference c --out folder --held-out d e", "a b --reference c --out folder --held-out d --held-out e"),
    ("a --held-out b --held-out c", "a --held-out b --held-out c"),
    ("--held-out b a", "--held-out b a"),  # else no RECORD would be left
    ("a --json b", "a --json b"),
    ("", ""),
])  # fmt: skip
def test_an_option_may_list_its_files(typed, meant):
    """The second file was diagnosed with the others, in silence, where its author had held it out."""
    assert repeated(typed.split(), LISTS) == meant.split()


def test_side_files_say_what_records_are_for(tmp_path, record):
    """All were diagnosed together, clean reference flights with those of the gap."""
    paths = written(record, tmp_path, a="diagnose", b="held_out", c="reference", d="diagnose")
    found = by_role(tuple(paths))
    assert [[r.meta.name for r in some] for some in found] == [["a", "d"], ["b"], ["c"]]


def test_something_has_to_be_left_to_diagnose(tmp_path, record):
    (path,) = written(record, tmp_path, a="held_out")
    with pytest.raises(InputError, match="role is 'held_out', and none of the given records has the role"):
        by_role((path,))


def test_the_command_line_takes_both(tmp_path, record, capsys):
    a, b, c, d = written(record, tmp_path, a="diagnose", b="diagnose", c="diagnose", d="held_out")
    assert _run(["diagnose", str(a), str(d), "--held-out", str(b), str(c), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [len(found["provenance"][what]) for what in ("records", "held_out")] == [1, 3]
