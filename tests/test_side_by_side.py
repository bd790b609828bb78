"""Records side by side give what they give one after another."""

from __future__ import annotations

import os
import threading

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from sim2real.records.side_by_side import algebra_in_one_thread, each, threads


@pytest.mark.parametrize("told", ["1", "3"])
def test_results_keep_their_order_and_errors_come_out(monkeypatch, told):
    monkeypatch.setenv("OMP_NUM_THREADS", told)
    assert threads() == int(told)
    assert each(lambda a, b: a - b, range(20), [1] * 20) == list(range(-1, 19))
    with pytest.raises(ZeroDivisionError):
        each(lambda a: 1 / a, [1, 0])
    with pytest.raises(ValueError, match="argument 2"):
        each(lambda a, b: a, [1, 2], [1])


def test_two_are_under_way_at_once_where_two_may_be(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    meeting = threading.Barrier(2, timeout=20.0)
    assert sorted(each(lambda _: meeting.wait(), range(2))) == [0, 1]


def test_linear_algebra_starts_no_threads_within_and_may_again_afterwards():
    def of_algebra():
        np.linalg.inv(np.eye(2))
        return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}

    with threadpool_limits(2, user_api="blas"):  # whatever the machine and its environment allow
        assert of_algebra() == {2}
        assert algebra_in_one_thread(of_algebra)() == {1}
        assert of_algebra() == {2}


def test_a_number_that_is_none_is_one_a_core(monkeypatch):
    for told in ("", "0", "all"):
        monkeypatch.setenv("OMP_NUM_THREADS", told)
        assert threads() == os.cpu_count()
