"""Servos of another lag than the aircraft file's, which is assumed: told by all surfaces together, and no gap."""

from __future__ import annotations

from functools import cache

import pytest

from icing_env import scenario
from icing_env.record import FlightRecord
from sim2real.actuators.servos import of_all_servos
from sim2real.diagnosis import diagnose
from sim2real.records.reconstruct import reconstruct
from testbed.flight import fly

SURFACES = ("elevator", "aileron", "rudder")
FILE = 0.05


@cache
def flown(elevator: float, aileron: float, rudder: float, effect: tuple[str, str, float] | None = None) -> FlightRecord:
    """Doublets of all surfaces, in gusts of 0.5 m/s, behind servos of such lags."""
    lags = {f"{s}_lag": lag for s, lag in zip(SURFACES, (elevator, aileron, rudder), strict=True)}
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.5, **lags},
                           effects={} if effect is None else {effect[0]: {effect[1]: effect[2]}})
    return fly(chosen, seed=2, observer=False, protection=False).record


@pytest.mark.parametrize("lag", [0.02, 0.1, 0.17])
def test_the_lag_of_all_servos_is_the_aircrafts(lag):
    (flight,) = of_all_servos([reconstruct(flown(lag, lag, lag))])
    assert all(flight.parameters[f"{s}_lag"][0] == pytest.approx(lag, abs=0.006) for s in SURFACES)
    assert any("all of them, no gap" in note for note in flight.notes)


@pytest.mark.parametrize("lags", [(FILE, FILE, FILE), (0.2, FILE, FILE), (FILE, 0.12, FILE), (FILE, FILE, 0.1)])
def test_one_that_differs_from_the_others_is_not_taken_for_all(lags):
    before = reconstruct(flown(*lags))
    (flight,) = of_all_servos([before])
    assert flight is before


def test_a_clean_aircraft_behind_slow_servos_has_no_gap():
    assert diagnose([flown(0.1, 0.1, 0.1)]).verdict == "no_gap"


def test_what_one_servo_has_beside_them_is_told_alone():
    found = diagnose([flown(0.1, 0.1, 0.1, ("elevator_lag", "extra", 0.1))])
    assert found.hypotheses[0]["effects"] == ["elevator_lag"]
    size = found.effects[0]["parameters"]["extra"]
    assert size["low95"] - 0.01 < 0.1 < size["high95"] + 0.01
