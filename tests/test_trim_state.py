"""Trim-state analysis on an aircraft that the project does not know, flown steadily, clean and changed."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import small_aircraft
from records_made import record_of

from estimators import trim_state
from estimators.airframe import published_airframe
from icing_env.errors import InputError
from icing_env.record import FlightRecord

CHANGES = {"CX_0": -0.07, "CZ_alpha": -4.9, "Cm_alpha": -1.1}


@cache
def iced() -> np.ndarray:
    airframe = published_airframe()
    for name, value in CHANGES.items():
        airframe[name] = value
    return airframe


@cache
def steady(ice: bool = False, speed: float = 70.0) -> np.ndarray:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(small_aircraft, "controls", lambda t: np.zeros(3))
        return small_aircraft.fly(iced() if ice else published_airframe(), 12.0, speed=speed)


def record(seed: int, ice: bool = False, speed: float = 70.0, without: tuple[str, ...] = ()) -> FlightRecord:
    return record_of(small_aircraft.noisy(steady(ice, speed), seed), published_airframe(), without)


@pytest.mark.parametrize("speed", [55.0, 70.0, 85.0])
def test_the_clean_curve_is_where_the_independent_aircraft_trims(speed: float) -> None:
    m, af = steady(speed=speed)[0], published_airframe()[0]
    force = 0.5 * small_aircraft.DENSITY * speed**2 * af["wing_area"]
    cx = (af["mass"] * m["ax"] - m["thrust_left"] - m["thrust_right"]) / force
    cz = af["mass"] * m["az"] / force
    lift = cx * np.sin(m["alpha"]) - cz * np.cos(m["alpha"])
    clean = trim_state.clean_trim(published_airframe(), float(lift))
    assert clean["alpha"] == pytest.approx(m["alpha"], abs=1e-6)
    assert clean["elevator"] == pytest.approx(m["elevator"], abs=1e-6)
    assert clean["CD"] == pytest.approx(-cx * np.cos(m["alpha"]) - cz * np.sin(m["alpha"]), abs=1e-6)


def test_what_changed_is_found_at_the_same_lift() -> None:
    points = trim_state.analyse(record(1, ice=True))
    assert len(points) >= 2
    lift = points[0].values["CL"].estimate
    truth = {n: trim_state.clean_trim(iced(), lift)[n] - trim_state.clean_trim(published_airframe(), lift)[n]
             for n in ("alpha", "elevator", "CD")}  # fmt: skip
    found = trim_state.combined(points)
    assert truth["alpha"] > 0.004 and truth["CD"] > 0.015
    for name, against in (("delta_alpha", "alpha"), ("delta_elevator", "elevator"), ("delta_CD_0", "CD"),
                          ("delta_CT", "CD")):  # fmt: skip
        assert abs(found[name].estimate - truth[against]) < 4.0 * found[name].std_error, name
        assert found[name].std_error < 0.2 * abs(truth[against]), name


def test_intervals_cover() -> None:
    """Clean against clean: a delta lies within 1.96 standard errors of nothing 19 times in 20."""
    inside, count = 0, 0
    for seed in range(25):
        for point in trim_state.analyse(record(seed)):
            for delta in point.deltas.values():
                inside, count = inside + (abs(delta.estimate) < 1.96 * delta.std_error), count + 1
    assert count >= 200 and 0.90 < inside / count < 0.985, inside / count


def test_a_manoeuvre_is_no_trim_state() -> None:
    m = small_aircraft.noisy(small_aircraft.fly(published_airframe(), 20.0), 1)
    for point in trim_state.analyse(record_of(m, published_airframe()), seconds=2.0):
        for start in (1.0, 11.0):  # elevator doublets of 1.8 and 1.4 s
            assert point.end <= start + 0.1 or point.start >= start + 1.4


def test_references_take_out_what_the_airframe_does_not_know() -> None:
    """An elevator pick-off 1 deg off looks like a change of trim until a clean flight of the same aircraft shows it."""
    off, flights = np.radians(1.0), []
    for flight in (record(1), record(2, speed=60.0), record(3, speed=80.0), record(4, speed=65.0)):
        flight.channels["elevator"][:] += off
        flights.append(flight)
    alone = trim_state.combined(trim_state.analyse(flights[-1]))["delta_elevator"]
    against = trim_state.combined(trim_state.analyse(flights[-1], reference=flights[:-1]))["delta_elevator"]
    assert alone.estimate == pytest.approx(off, abs=3.0 * alone.std_error)
    assert abs(against.estimate) < 4.0 * against.std_error < 0.2 * off


def test_drag_without_thrust_is_refused_and_the_rest_told() -> None:
    points = trim_state.analyse(record(1, ice=True, without=("thrust_left", "thrust_right")))
    for point in points:
        assert not point.deltas["delta_CD_0"].identifiable and "thrust" in point.deltas["delta_CD_0"].why
        assert point.deltas["delta_alpha"].identifiable and "CD" not in point.values
    assert set(trim_state.combined(points)) == {"delta_alpha", "delta_elevator"}


def test_bad_input_is_named() -> None:
    with pytest.raises(InputError, match="elevator"):
        trim_state.analyse(record(1, without=("elevator",)))
    m = small_aircraft.noisy(small_aircraft.fly(published_airframe(), 6.0), 1)
    moving = record_of(m[60:], published_airframe())
    with pytest.raises(InputError, match="no reference record has a steady stretch"):
        trim_state.analyse(record(1), reference=[moving])


def test_an_aircraft_file_that_starts_from_another_has_that_ones_numbers() -> None:
    base, flight = published_airframe(), published_airframe("twin_otter_flight")
    assert flight["span"][0] == base["span"][0] and flight["Cm_alpha"][0] != base["Cm_alpha"][0]
