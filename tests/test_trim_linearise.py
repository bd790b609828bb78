"""Steady flight and the linear view: residuals, refusals, agreement with the flight, the published modes."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from numpy.typing import NDArray
from plant import fleet_at, rates
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from icing_env.aircraft import broadcast, changed, load
from icing_env.errors import InputError
from icing_env.linearise import BODY, INPUTS, LAGS, LATERAL, LONGITUDINAL, linearise, modes
from icing_env.trim import Trim, conditions, trim, trim_rows
from icing_env.types import COMMAND, CURRENT, STATE, SURFACES

AIRCRAFT = load()
FLIGHT = load("twin_otter_flight")
RECORD = {"airspeed": 236.0 * 0.3048, "altitude": 7204.0 * 0.3048}
CONDITIONS: dict[str, dict[str, float]] = {
    "level": {},
    "slow": {"airspeed": 45.0},
    "climb": {"airspeed": 60.0, "climb_angle": 0.05},
    "descent": {"climb_angle": -0.08},
    "turn": {"turn_rate": math.radians(3.0)},
    "left turn": {"turn_rate": -math.radians(3.0), "heading": 2.0},
    "sideslip": {"beta": 0.05},
    "flap": {"airspeed": 40.0, "flap": 0.6545, "altitude": 300.0},
    "one engine": {"airspeed": 52.0, "altitude": 300.0, "share_left": 0.0},
}


def accelerations(t: Trim, p: NDArray) -> NDArray:
    dx = rates(t.state, p, t.command)
    return np.array([dx[name][0] for name in ("u", "v", "w", "p", "q", "r", "elevator", "aileron", "rudder", "flap")])


@pytest.mark.parametrize("name", CONDITIONS)
def test_nothing_accelerates_in_trim(name: str) -> None:
    t = trim(AIRCRAFT, **CONDITIONS[name])
    assert np.abs(accelerations(t, AIRCRAFT)).max() < 1e-9
    dx, k = rates(t.state, AIRCRAFT, t.command), t.condition[0]
    assert dx["altitude"][0] == pytest.approx(k["airspeed"] * math.sin(k["climb_angle"]), abs=1e-8)
    assert dx["alpha_downwash"][0] == pytest.approx(0.0, abs=1e-12)
    assert dx["power_left"][0] == pytest.approx(0.0, abs=1e-6)
    speed = math.sqrt(sum(float(t.state[v][0]) ** 2 for v in "uvw"))
    assert speed == pytest.approx(k["airspeed"])
    assert t.beta == k["beta"]


def test_turning_rate_is_about_the_vertical_and_the_turn_coordinated() -> None:
    t = trim(AIRCRAFT, turn_rate=math.radians(3.0))
    s = t.state
    body = np.array([s["p"][0], s["q"][0], s["r"][0]])
    turn = Rotation.from_quat([s["e1"][0], s["e2"][0], s["e3"][0], s["e0"][0]])
    np.testing.assert_allclose(turn.apply(body), [0.0, 0.0, math.radians(3.0)], atol=1e-12)
    assert math.tan(t.phi) == pytest.approx(72.0 * math.radians(3.0) / 9.80, rel=0.03)


@pytest.mark.parametrize("turn", [math.radians(3.0), -math.radians(3.0)])
def test_a_trimmed_turn_keeps_turning(turn: float) -> None:
    t = trim(AIRCRAFT, turn_rate=turn)
    fleet = fleet_at(t, AIRCRAFT)
    for _ in range(500):
        fleet.step()
    assert fleet.state["altitude"][0] == pytest.approx(2200.0, abs=1e-4)
    s = fleet.state[0]
    heading = Rotation.from_quat([s["e1"], s["e2"], s["e3"], s["e0"]]).as_euler("ZYX")[0]
    assert heading == pytest.approx(10.0 * turn, abs=1e-6)


def test_wind_changes_the_track_not_the_trim() -> None:
    calm, windy = trim(AIRCRAFT), trim(changed(AIRCRAFT, wind_north=-8.0, wind_east=11.0, wind_down=0.5))
    for name in ("alpha", "theta", "elevator", "throttle"):
        assert getattr(windy, name) == pytest.approx(getattr(calm, name), abs=1e-9), name
    assert windy.state["v"][0] == pytest.approx(11.0)


def test_iced_trim_needs_more_alpha_and_power() -> None:
    clean, iced = trim(AIRCRAFT), trim(AIRCRAFT, dict.fromkeys(SURFACES, 0.05))
    assert np.abs(accelerations(iced, AIRCRAFT)).max() < 1e-9
    assert iced.alpha > clean.alpha
    assert iced.throttle > clean.throttle
    lopsided = trim(AIRCRAFT, {"left_wing": 0.1})
    assert lopsided.aileron < -0.001  # rolls right against the iced left wing
    assert np.abs(accelerations(lopsided, AIRCRAFT)).max() < 1e-9


@pytest.mark.parametrize(("condition", "message"), [
    ({"airspeed": 20.0}, "no steady flight"), ({"airspeed": 0.0}, "no steady flight"),
    ({"airspeed": float("nan")}, "no steady flight"), ({"turn_rate": 0.5}, "no steady flight"),
    ({"share_left": 0.0, "share_right": 0.0}, "no steady flight"), ({"airspeed": 120.0}, "% power: climb less"),
    ({"climb_angle": 0.3}, "% power: climb less"), ({"climb_angle": -0.4}, "% power: descend less"),
    ({"climb_angle": -0.4, "share_left": 0.0}, "% power: descend less"),
    ({"airspeeed": 60.0}, "did you mean 'airspeed'"),
])  # fmt: skip
def test_impossible_flight_is_refused_in_one_line(condition: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        trim(AIRCRAFT, **condition)
    assert "\n" not in str(caught.value)


def test_a_rudder_too_small_for_the_dead_engine_is_told() -> None:
    with pytest.raises(InputError, match=r"needs rudder -.* deg: beyond its travel"):
        trim(changed(AIRCRAFT, rudder_min=-0.05), **CONDITIONS["one engine"])


def test_unknown_surface_is_named() -> None:
    with pytest.raises(InputError, match="did you mean 'left_wing'"):
        trim(AIRCRAFT, {"leftwing": 0.1})


def test_a_hopeless_row_spoils_no_other() -> None:
    n = 5
    state, current, command = np.zeros(n, STATE), np.zeros(n, CURRENT), np.zeros(n, COMMAND)
    airspeed = np.array([72.0, 0.0, np.nan, 60.0, 20.0])
    left_over = trim_rows(state, current, command, conditions(n, airspeed=airspeed), AIRCRAFT)
    assert (left_over < 1e-8).tolist() == [True, False, False, True, False]
    for row, speed in ((0, 72.0), (3, 60.0)):
        alone = trim(AIRCRAFT, airspeed=speed)
        assert state[row]["w"] == alone.state["w"][0]
        assert command[row]["elevator"] == alone.command["elevator"][0]


def test_rows_are_trimmed_to_their_own_parameters() -> None:
    p = broadcast(AIRCRAFT, 3)
    p["mass"] = [4500.0, 5000.0, 5500.0]
    state, current, command = np.zeros(3, STATE), np.zeros(3, CURRENT), np.zeros(3, COMMAND)
    assert (trim_rows(state, current, command, conditions(3), p) < 1e-8).all()
    assert (np.diff(state["alpha_downwash"]) > 0.005).all()
    assert (np.diff(command["throttle_left"]) > 0.0).all()


# ---- the linear view


def book(state: NDArray) -> NDArray:
    """Airspeed, alpha, beta, p, q, r, phi, theta, psi, altitude and lags of STATE rows in still air [n, 13]."""
    u, v, w = state["u"], state["v"], state["w"]
    speed = np.sqrt(u * u + v * v + w * w)
    turn = Rotation.from_quat(np.stack([state[e] for e in ("e1", "e2", "e3", "e0")], axis=1)).as_euler("ZYX")
    columns = [speed, np.arctan2(w, u), np.arcsin(v / speed), state["p"], state["q"], state["r"], *turn[:, ::-1].T]
    return np.stack([*columns, state["altitude"], *(state[lag] for lag in LAGS)], axis=1)


def response(t: Trim, p: NDArray, disturb: dict[str, float], steps: int) -> NDArray:
    """Central difference of two flights, disturbed both ways, after `steps` of 0.02 s, per unit of disturbance."""
    fleet = fleet_at(t, p, 2)
    for name, value in disturb.items():
        rows = fleet.command if name.startswith("throttle") else fleet.state
        rows[name] += value * np.array([1.0, -1.0])
        if name in ("elevator", "aileron", "rudder"):
            fleet.command[name] += value * np.array([1.0, -1.0])
    for _ in range(steps):
        fleet.step()
    ends = book(fleet.state)
    return (ends[0] - ends[1]) / 2.0


@pytest.mark.parametrize(("name", "tolerance"), [
    ("level", 1e-5), ("turn", 1e-5), ("sideslip", 1e-5), ("one engine", 1e-5),
    ("climb", 2e-3),  # a climb leads into thinner air: not quite an equilibrium
])  # fmt: skip
def test_linear_model_predicts_the_flight(name: str, tolerance: float) -> None:
    """Disturbances of surfaces, levers and rates grow over 1 s as exp(A t) says."""
    p = AIRCRAFT
    t = trim(p, **CONDITIONS[name])
    system, seconds = linearise(t, p), 1.0
    a, b = np.asarray(system.A), np.asarray(system.B)
    transition = expm(np.block([[a, b], [np.zeros((len(INPUTS), len(a) + len(INPUTS)))]]) * seconds)
    n, size = len(a), 1e-5
    scale = np.array([1.0, *[0.02] * 8, 1.0, 0.02, 1e5, 1e5])
    for column, signal in enumerate((*BODY, *LAGS, *INPUTS)):
        dead = signal == "throttle_left" and t.condition["share_left"][0] == 0.0  # a lever at its stop
        if signal not in ("p", "q", "r", *INPUTS) or dead:
            continue
        flown = response(t, p, {signal: size}, 50)
        predicted = transition[:n, column] * size
        error = np.abs(flown - predicted) / scale
        assert error.max() <= tolerance * np.abs(predicted / scale).max(), (signal, error)


def test_signals_have_names_and_reductions_keep_them() -> None:
    t = trim(AIRCRAFT)
    full = linearise(t, AIRCRAFT)
    assert isinstance(full, control.StateSpace)
    assert tuple(full.state_labels) == (*BODY, *LAGS) == tuple(full.output_labels)
    assert tuple(full.input_labels) == INPUTS
    pitch = linearise(t, AIRCRAFT, LONGITUDINAL)
    assert tuple(pitch.state_labels) == LONGITUDINAL
    kept = [full.state_labels.index(name) for name in LONGITUDINAL]
    np.testing.assert_allclose(pitch.A, np.asarray(full.A)[np.ix_(kept, kept)], atol=1e-7)
    with pytest.raises(InputError, match="did you mean 'alpha'"):
        linearise(t, AIRCRAFT, ("alhpa",))


def test_symmetric_flight_does_not_couple() -> None:
    a = np.asarray(linearise(trim(AIRCRAFT), AIRCRAFT).A)
    labels = [*BODY, *LAGS]
    pitch, roll = ([labels.index(x) for x in group] for group in (LONGITUDINAL, LATERAL))
    assert np.abs(a[np.ix_(pitch, roll)]).max() < 1e-6
    assert np.abs(a[np.ix_(roll, pitch)]).max() < 1e-6


def test_elevator_and_aileron_act_in_the_direction_of_the_signs() -> None:
    system = linearise(trim(AIRCRAFT), AIRCRAFT)
    b = np.asarray(system.B)
    row = {name: i for i, name in enumerate(system.state_labels)}
    assert b[row["q"], 0] < 0.0 and b[row["p"], 1] < 0.0 and b[row["r"], 2] < 0.0
    assert b[row["power_left"], 3] > 0.0


def test_modes_of_the_flown_aircraft() -> None:
    """Short period of the record's aircraft: 4.1 rad/s, damping 0.60 at 236 ft/s and 7204 ft."""
    found = modes(trim(FLIGHT, **RECORD), FLIGHT)
    assert found["short_period"].frequency == pytest.approx(4.1, rel=0.1)
    assert found["short_period"].damping == pytest.approx(0.60, rel=0.1)
    assert found["phugoid"].frequency == pytest.approx(math.sqrt(2.0) * 9.8 / RECORD["airspeed"], rel=0.15)
    assert 0.0 < found["phugoid"].damping < 0.2
    assert 1.5 < found["dutch_roll"].frequency < 2.5 and 0.1 < found["dutch_roll"].damping < 0.4
    assert 0.1 < found["roll"].time_constant < 0.4
    assert abs(found["spiral"].time_constant) > 20.0


def test_modes_of_the_published_derivatives() -> None:
    """The UIUC set: 3.5 rad/s, damping 0.69 by the short-period approximation at the same condition."""
    found = modes(trim(AIRCRAFT, **RECORD), AIRCRAFT)
    assert found["short_period"].frequency == pytest.approx(3.5, rel=0.03)
    assert found["short_period"].damping == pytest.approx(0.69, rel=0.03)


def test_short_period_seen_in_the_flight_is_that_of_the_model() -> None:
    """An elevator kick, flown: the linear system with named signals reproduces pitch rate over 3 s."""
    t = trim(FLIGHT, **RECORD)
    fleet = fleet_at(t, FLIGHT)
    kick, time = 1e-4, np.arange(151) * 0.02
    fleet.state["elevator"] += kick
    fleet.command["elevator"] += kick
    q = [0.0]
    for _ in range(150):
        fleet.step()
        q.append(float(fleet.state["q"][0]))
    system = linearise(t, FLIGHT, LONGITUDINAL)
    inputs = np.zeros((len(INPUTS), len(time)))
    inputs[0] = kick
    predicted = control.forced_response(system, time, inputs).outputs[LONGITUDINAL.index("q")]
    assert np.abs(np.array(q) - predicted).max() < 5e-3 * np.abs(predicted).max()


def test_ice_softens_the_short_period() -> None:
    clean = modes(trim(FLIGHT, **RECORD), FLIGHT)["short_period"]
    iced = modes(trim(FLIGHT, {"left_wing": 0.1, "right_wing": 0.1, "htail": 0.1}, **RECORD), FLIGHT)["short_period"]
    assert iced.frequency < 0.97 * clean.frequency
