"""A number of the model that no effect changes, far from its published value: unknown, and no inertia in its place."""

from __future__ import annotations

import pytest

from icing_env import scenario
from icing_env.aircraft import load
from icing_env.record import FlightRecord
from sim2real.diagnosis import diagnose
from testbed.flight import fly

COMPONENT = {"Cl": "rolling_moment", "Cn": "yawing_moment"}


def flown(number: str, off: float, seed: int) -> FlightRecord:
    """Doublets of all three surfaces; the number is off by that much."""
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.5},
                           effects={"discrepancy": {number: off}})
    return fly(chosen, seed=seed, observer=False, protection=False).record


@pytest.mark.slow
@pytest.mark.parametrize(("number", "share"), [("Cn_p", 1.2), ("Cl_r", 2.4)])
def test_a_cross_derivative_far_off_is_told_as_that(number: str, share: float):
    """By eight times its spread: beyond five it looked like an inertia, which scales all moments about an axis."""
    off = share * float(load()[number][0])
    found = diagnose([flown(number, off, seed) for seed in (4, 5)])
    assert found.verdict == "unknown" and found.unknown is not None
    assert found.unknown["component"] == COMPONENT[number[:2]]
    told = {term["term"]: term["coefficient"] for term in found.unknown["terms"]}
    assert told[number[3:]] == pytest.approx(off, rel=0.3)
