"""A recorder's low pass of higher order, brought to the first-order one that the simulated instruments have."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from icing_env import scenario
from icing_env.record import FloatArray
from sim2real.records.channels import MEASURED, SURFACES
from sim2real.records.low_pass import in_first_order
from sim2real.records.reconstruct import reconstruct
from testbed.flight import fly

DT, FINE = 0.02, 20  # s from sample to sample, steps of the truth in one
CUT = 10.0  # Hz


def doublets(seed: int) -> FloatArray:
    """A surface behind its actuator at the fine steps: edges a second apart, and a pilot's unrest."""
    rng = np.random.default_rng(seed)
    asked = np.repeat(rng.uniform(-0.1, 0.1, 40), FINE * 50) + 0.01 * np.cumsum(rng.standard_normal(40_000)) / FINE**1.5
    kept = math.exp(-DT / FINE / 0.05)
    return np.asarray(lfilter([1.0 - kept], [1.0, -kept], asked - asked[0]) + asked[0])


def first_order(values: FloatArray, cut: float) -> FloatArray:
    """As the simulated instruments do it, from sample to sample."""
    kept = math.exp(-2.0 * math.pi * cut * DT)
    return np.asarray(lfilter([1.0 - kept], [1.0, -kept], values, zi=[kept * values[0]])[0])


def late_as(order: int) -> float:
    """Cut-off, Hz, of the first-order one that shows a slow change as late as Butterworth's of CUT."""
    late = 1.0 / math.sin(0.5 * math.pi / order) / (2.0 * math.pi * CUT)
    return math.log1p(DT / late) / (2.0 * math.pi * DT)


@pytest.mark.parametrize("order", [2, 3, 4])
def test_what_one_of_higher_order_passed_is_what_the_first_order_one_passes(order: int) -> None:
    truth = doublets(order)
    level = truth[0]
    passed = (lfilter(*butter(order, CUT, fs=FINE / DT), truth - level) + level)[::FINE]
    wanted = first_order(truth[::FINE], late_as(order))
    inside = slice(50, -50)
    off = np.std((in_first_order(passed, CUT, order, late_as(order), DT) - wanted)[inside])
    assert off < 0.2 * np.std((passed - wanted)[inside])


@pytest.mark.parametrize("order", [2, 4])
def test_steady_values_stay_and_white_noise_stays_white(order: int) -> None:
    """Else what was read before would foretell it, as what rings under an accelerometer does."""
    assert in_first_order(np.full(300, 0.3), CUT, order, late_as(order), DT) == pytest.approx(0.3)
    made = in_first_order(np.random.default_rng(1).standard_normal(20_000), CUT, order, late_as(order), DT)
    assert np.std(made) == pytest.approx(1.0, abs=0.03)
    assert max(abs(float(np.mean(made[k:] * made[:-k]))) for k in range(1, 12)) < 0.03


def test_a_ramp_stays_as_late() -> None:
    """Its ends too: what lies beyond them is the ramp, prolonged."""
    ramp = 0.01 * np.arange(400)
    assert in_first_order(ramp, CUT, 2, late_as(2), DT) == pytest.approx(ramp, abs=2e-3)


def test_a_record_that_declares_one_is_brought_there_but_for_its_attitudes() -> None:
    """And not one that declares a lag, or the first order."""
    record = fly(scenario.load("clear_air", duration=20.0), seed=4, observer=False, protection=False).record
    silent, second, *others = (reconstruct(replace(record, meta=replace(record.meta, sensors=sensors))) for sensors in (
        {}, *({"filter": table} for table in ({"frequency": 5.0, "order": 2}, {"frequency": 5.0, "order": 1},
                                              {"lag": 0.045, "order": 2}))))  # fmt: skip
    for other in others:
        assert np.array_equal(other.measured, silent.measured, equal_nan=True)
    changed = {name for j, name in enumerate(MEASURED)
               if not np.array_equal(second.measured[:, j], silent.measured[:, j], equal_nan=True)}  # fmt: skip
    assert changed == {"alpha", "beta", "p", "q", "r", "ax", "ay", "az"}
    assert all(np.any(second.positions[s] != silent.positions[s]) for s in SURFACES)
    cut, j = float(second.parameters["filter_frequency"][0]), MEASURED.index("q")
    assert np.array_equal(second.measured[:, j], in_first_order(silent.measured[:, j], 5.0, 2, cut, second.dt))
    assert [any("brought to one of first order" in note for note in flight.notes)
            for flight in (silent, second, *others)] == [False, True, False, False]  # fmt: skip
