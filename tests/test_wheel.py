"""The wheel, installed and used outside the checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LOOK = """
import icing_env.aircraft, icing_env.configuration as c, estimators, controllers, sim2real, testbed.reports.page
assert "site-packages" in str(c.folder()), c.folder()
assert "twin_otter" in c.available("aircraft"), c.available("aircraft")
assert icing_env.aircraft.load() is not None
assert "<html" in testbed.reports.page.Report("title").html()
import gymnasium
env = gymnasium.make("icing_env/TwinOtter-v0", observer=False, management=False, protection=False)
assert env.observation_space.contains(env.reset(seed=1)[0])
assert env.observation_space.contains(env.step(env.action_space.sample())[0])
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return next(folder.glob("*.whl"))


def test_everything_that_is_needed_is_inside(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    for package in ("icing_env", "estimators", "controllers", "sim2real", "testbed"):
        assert f"{package}/py.typed" in names
    inside = {name.removeprefix("icing_env/configs/") for name in names if name.startswith("icing_env/configs/")}
    assert inside == {str(p.relative_to(ROOT / "configs")) for p in (ROOT / "configs").rglob("*.*")}
    assert not [name for name in names if name.startswith(("tests/", "docs/", "configs/"))]


@pytest.mark.slow
def test_it_works_without_the_checkout(wheel, tmp_path):
    python, clean = tmp_path / "venv/bin/python", {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    clean["NUMBA_OPT"] = "0"  # quicker to compile

    def call(*command):
        done = subprocess.run(list(map(str, command)), cwd=tmp_path, env=clean, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[-2000:]
        return done.stdout

    call(sys.executable, "-m", "venv", tmp_path / "venv")
    call(python, "-m", "pip", "install", "-q", "--no-compile", "-c", ROOT / "constraints.txt", wheel)
    call(python, "-c", LOOK)
    assert len(json.loads(call(tmp_path / "venv/bin/icing", "effects", "--json"))) >= 15
    assert "icing" in call(tmp_path / "venv/bin/icing", "--help")
