"""The examples run as they stand."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parent.parent / "examples"


def run(name: str, *arguments: str) -> str:
    command = [sys.executable, str(EXAMPLES / name), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


LINES = {"first_flight.py": 6, "own_effect.py": 3, "own_simulator.py": 3, "estimator_in_the_loop.py": 2}


@pytest.mark.parametrize("name", LINES)
def test_an_example_prints_what_it_promises(name: str) -> None:
    assert len(run(name).strip().splitlines()) == LINES[name]


def test_the_estimator_finds_the_ice_that_the_blind_one_misses() -> None:
    seeing, blind = run("estimator_in_the_loop.py").splitlines()
    severity = [float(line.split("severity ")[1].split(",")[0]) for line in (seeing, blind)]
    assert severity[0] > 0.2 > 0.05 > severity[1]


def test_training_starts() -> None:
    pytest.importorskip("stable_baselines3", reason="the extra `learning` is not installed")
    assert "value_loss" in run("train_ppo.py", "20000")
