"""The compiled loop of the predictor flies what the simulator's own step flies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from icing_env import scenario
from sim2real.library.candidates import bank
from sim2real.library.pushes import pushes
from sim2real.prediction.along import REST
from sim2real.prediction.correction import STATES
from sim2real.prediction.gusts import Kind
from sim2real.prediction.predictor import Predictor, Push
from sim2real.records.channels import MEASURED, SURFACES
from sim2real.records.powers import thrust_per_power
from sim2real.records.reconstruct import Reconstruction, reconstruct
from testbed.flight import fly

SIDES = ("left", "right")


@pytest.fixture(scope="module")
def flight() -> Reconstruction:
    chosen = scenario.load("clear_air", duration=20.0, parameters={"turbulence_sigma_w": 0.5})
    return reconstruct(fly(chosen, seed=3, observer=False, protection=False).record)


@pytest.mark.parametrize("rows", [1, 8, 11])
def test_free_flight_is_the_simulators(flight: Reconstruction, rows: int) -> None:
    """Ten seconds, every row another aircraft: the simulator's own step, fed the same controls, goes the same way."""
    parameters = np.repeat(flight.parameters, rows)
    parameters["Cm_alpha"] *= np.linspace(0.7, 1.3, rows)
    parameters["scale_alpha"] = np.linspace(-0.1, 0.1, rows)
    steps = round(10.0 / flight.dt)
    ours, theirs = Predictor(flight, parameters), Predictor(flight, parameters)
    for one in (ours, theirs):
        one.place(0)
    found = ours.fly(steps)
    fleet, expected = theirs.fleet, np.empty_like(found)
    for k in range(steps):
        for name in SURFACES:
            now, then = flight.controls[name][k], flight.controls[name][k + 1]
            fleet.state[name], fleet.command[name] = now, now + (then - now) / REST
        fleet.state["flap"] = fleet.command["flap"] = flight.controls["flap"][k + 1]
        for side in SIDES:
            fleet.state[f"power_{side}"] = flight.controls[f"power_{side}"][k + 1]
        fleet.step()
        expected[k] = theirs.read()
    size = np.abs(expected).max(axis=(0, 1)) + 1e-3
    assert np.abs((found - expected) / size).max() < 1e-9


def test_a_row_flies_alone_as_in_a_batch(flight: Reconstruction) -> None:
    """To the bit, with feedback and with pushes."""
    from sim2real.library.candidates import bank, parameter_rows
    from sim2real.library.pushes import pushes
    from sim2real.prediction.kalman import gains
    from sim2real.prediction.predictor import innovations

    gain, candidates = gains(flight, (0.5,))[0].with_start(), bank()
    rows, pushed = parameter_rows(flight, candidates), pushes(flight, candidates.terms)
    together = innovations(flight, rows, gain.K, pushed)
    for row in (0, 7, 100, candidates.terms[20].row):
        own = tuple(type(q)(0, q.target, q.series, q.sensor) for q in pushed if q.row == row)
        alone = innovations(flight, rows[row : row + 1], gain.K, own)
        np.testing.assert_array_equal(alone[:, 0], together[:, row])
    assert together.shape[2] == len(MEASURED)


@pytest.mark.parametrize(("rate", "angle"), [("p", "phi"), ("q", "theta")])
def test_what_turns_all_through_a_step_turns_by_half_of_its_end(flight: Reconstruction, rate: str, angle: str) -> None:
    """Constant angular acceleration a: rate a dt and angle a dt^2/2 (but for damping, a twentieth in such a step)."""
    two, size = Predictor(flight, np.repeat(flight.parameters, 2)), 0.4
    two.place(0)
    two.fly(1, pushes=(Push(1, rate, np.full(len(flight.time), size), False),))
    plain, pushed = two.tangent()
    at, turned = STATES.index(rate), len(STATES) + ("phi", "theta").index(angle)
    assert pushed[at] - plain[at] == pytest.approx(size * flight.dt, rel=0.1)
    assert pushed[turned] - plain[turned] == pytest.approx(0.5 * size * flight.dt**2, rel=0.1)


@pytest.mark.parametrize("rate", ["p", "q", "r"])
def test_a_known_acceleration_turns_as_one_that_pushes(flight: Reconstruction, rate: str) -> None:
    """Ten steps: the same flight to rounding, whichever way it is told."""
    known, size = np.zeros((len(flight.time), 6)), np.full(len(flight.time), 0.2)
    known[:, STATES.index(rate)] = size
    told = Predictor(replace(flight, known=known), flight.parameters)
    pushed = Predictor(flight, flight.parameters)
    for one in (told, pushed):
        one.place(0)
    found, expected = told.fly(10), pushed.fly(10, pushes=(Push(0, rate, size, False),))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("component", "moment"), [("rolling_moment", (1.0, 0.0)), ("yawing_moment", (0.0, 1.0))])
def test_a_generic_moment_turns_the_aircraft_as_its_inertias_have_it(flight: Reconstruction, component: str,
                                                                      moment: tuple[float, float]) -> None:
    term = next(t for t in bank().terms if (t.component, t.name) == (component, "1"))
    made = {push.target: push.series for push in pushes(flight, [term])}
    p = flight.parameters[0]
    inertia = np.array([[p["inertia_xx"], -p["inertia_xz"]], [-p["inertia_xz"], p["inertia_zz"]]])
    roll, yaw = np.linalg.solve(inertia, moment)
    assert set(made) == {"p", "r"}
    np.testing.assert_allclose(made["r"] * roll, made["p"] * yaw, rtol=1e-9)
    assert made["p" if moment[0] else "r"].min() > 0.0


def test_a_watt_pulls_as_in_the_simulator(flight: Reconstruction) -> None:
    """Slow, at a large angle of attack: by the part of the airspeed along the propellers' axis."""
    one = Predictor(flight, flight.parameters)
    one.place(0)
    one.fleet.state["u"], one.fleet.state["v"], one.fleet.state["w"] = 38.0, 0.0, 9.0
    read = dict(zip(MEASURED, one.read()[0], strict=True))
    per_power = thrust_per_power(flight.parameters[0], np.hypot(38.0, 9.0), np.arctan2(9.0, 38.0))
    assert read["thrust_left"] == pytest.approx(per_power * one.fleet.state["power_left"][0], rel=1e-6)


def test_thrust_is_read_through_the_wind(flight: Reconstruction) -> None:
    """A steady wind shows nowhere: what the engines are said to push depends on the air, not on the ground."""
    parameters = np.repeat(flight.parameters, 4)
    parameters["wind_north"], parameters["wind_east"] = [0.0, 12.0, 0.0, -5.0], [0.0, 0.0, 9.0, 4.0]
    parameters["wind_down"] = [0.0, -2.0, 1.0, 3.0]
    flown = Predictor(flight, parameters)
    flown.place(0)
    np.testing.assert_allclose(flown.read(), np.repeat(flown.read()[:1], 4, axis=0), rtol=1e-12, atol=1e-9)
    thrust = [MEASURED.index(f"thrust_{side}") for side in SIDES]
    found = flown.fly(round(5.0 / flight.dt))[:, :, thrust]
    np.testing.assert_allclose(found, np.repeat(found[:, :1], 4, axis=1), rtol=1e-3)  # a little: they climb apart


def test_rows_that_share_parameters_are_not_flown(flight: Reconstruction) -> None:
    """Enough to linearise; the loop would read past their one row."""
    shared = Predictor(flight, flight.parameters, 3)
    shared.place(0)
    with pytest.raises(ValueError, match="3 rows need a PARAMETERS row each"):
        shared.fly(1)


@pytest.mark.parametrize(("rotation", "alike"), [(1.0, True), (0.0, False)])
def test_air_that_turns_is_met_at_the_records_speed(flight: Reconstruction, rotation: float, alike: bool) -> None:
    """Whatever the airspeed of a row: gains and noise are of one speed, and most gusts are drawn for one."""
    rows = np.repeat(flight.parameters, 2)
    plant = Predictor(flight, rows, kind=Kind(tail_delay=rotation == 0.0, rotation=rotation == 1.0))
    plant.place(0)
    plant.fleet.state["u"][1] += 15.0
    plant.fleet.state["dryden_w1"] = 1.0
    plant.fly(50)
    gust = plant.fleet.state["gust_q" if rotation else "gust_w_tail"]
    assert gust[0] != 0.0 and (gust[0] == pytest.approx(gust[1], rel=1e-9)) == alike
