"""A free course of time along a record: what its hats can follow, and how many there are of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from sim2real.library.knots import KNOT, MOST, hats, knots, spacing


def record(length: float, since: float = 0.0) -> SimpleNamespace:
    return SimpleNamespace(time=since + 0.02 * np.arange(round(length / 0.02) + 1))


@given(st.floats(5.0, 900.0), st.floats(-50.0, 50.0))
@example(40.0, 0.0)
@example(100.0, 0.0)
@example(100.02, 3.0)
def test_hats_add_up_to_one_everywhere_and_follow_a_ramp(length: float, since: float):
    flight = record(length, since)
    along, at, passed = hats(flight), knots(flight), flight.time - flight.time[0]
    np.testing.assert_allclose(along.sum(axis=1), 1.0, rtol=1e-9)
    np.testing.assert_allclose(along @ at, passed, atol=1e-7)
    assert at[-1] >= passed[-1] - 1e-6


@given(st.floats(5.0, 2000.0))
def test_knots_are_a_second_apart_until_there_are_too_many(length: float):
    flight = record(length)
    assert len(knots(flight)) <= MOST + 2
    assert spacing(flight) == KNOT or length > MOST * KNOT - 1.0
