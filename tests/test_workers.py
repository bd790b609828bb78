"""Worker processes start with a core each, and the user's own settings stand."""

from __future__ import annotations

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from icing_env.errors import InputError
from testbed.benchmarks.answers import answered
from testbed.commands.diagnose import cost
from testbed.workers import START, a_core_each, peak_memory_gb


def told(name: str) -> str | None:
    return os.environ.get(name)


def test_workers_start_with_it_and_nobody_else(monkeypatch):
    for name in START:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "1000")
    with a_core_each(), ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert list(pool.map(told, START)) == ["1", START["MALLOC_MMAP_THRESHOLD_"], "1000"]
    assert "OMP_NUM_THREADS" not in os.environ
    assert os.environ["MALLOC_TRIM_THRESHOLD_"] == "1000"


def test_a_case_that_fails_is_an_answer_and_costs_no_other_its_own():
    assert answered(lambda: {"verdict": "no_gap"}) == {"verdict": "no_gap"}
    assert answered(lambda: refused("x")) == {"error": "no number: x"}
    assert answered(lambda: {}["lacking"]) == {"error": "KeyError: 'lacking'"}


def refused(text: str) -> dict[str, object]:
    raise InputError(f"no number: {text}")


@pytest.mark.skipif(sys.platform == "win32", reason="the system does not say")
def test_memory_is_told_in_gigabytes():
    held = np.ones(50_000_000)
    assert held.nbytes / 1e9 <= peak_memory_gb() < 50.0
    assert cost(27.3).startswith("Took 27 s and ") and cost(27.3).endswith(" GB of memory at most.")
