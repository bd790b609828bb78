"""The autopilot: signs of every loop, limits, anti-windup, rows that do not see one another, and closed loop."""

from __future__ import annotations

import numpy as np
import pytest
from controlled import cruise, free, requested, scattered, steer, targets
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.laws import autopilot
from controllers.parameters import read_parameters
from icing_env.errors import InputError
from icing_env.types import COMMAND, TARGET

DT = 0.02


def one_step(m, advisory=None, gains=None, start=None, **target):
    """Engage in cruise (or at `start`), then one step with the measurement `m`; returns command and autopilot."""
    t = np.zeros(1, TARGET)
    level = {"pitch_mode": 1, "altitude": 2200.0, "speed_mode": 1, "airspeed": 72.0, "theta": 0.02, "throttle": 0.6}
    for name, value in {**level, **target}.items():
        t[name] = value
    a, c = autopilot.init(1), np.zeros(1, COMMAND)
    advisory = free() if advisory is None else advisory
    gains = autopilot.default_gains() if gains is None else gains
    steer(autopilot, a, c, cruise() if start is None else start, t, advisory, gains, DT)
    steer(autopilot, a, c, m, t, advisory, gains, DT)
    return c[0], a[0]


def test_engaging_in_trim_moves_nothing():
    c, _ = one_step(cruise())
    assert c["elevator"] == pytest.approx(0.01, abs=1e-3)
    assert c["throttle_left"] == c["throttle_right"] == pytest.approx(0.6, abs=1e-3)
    assert c["aileron"] == pytest.approx(0.0, abs=1e-12) and c["rudder"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("channel", "value", "target", "surface", "sign"),
    [
        ("theta", -0.03, {"pitch_mode": 0}, "elevator", -1),  # too little pitch: trailing edge up
        ("q", 0.05, {"pitch_mode": 0}, "elevator", +1),  # pitching up: trailing edge down
        ("altitude", 2200.0, {"altitude": 2250.0}, "elevator", -1),  # too low: pitch up
        ("altitude", 2200.0, {"altitude": 2250.0}, "throttle_left", +1),  # and more power
        ("altitude", 2200.0, {"pitch_mode": 2, "climb_rate": -3.0}, "elevator", +1),
        ("airspeed", 68.0, {}, "throttle_right", +1),
        ("phi", 0.2, {}, "aileron", +1),  # banked right: roll left, positive
        ("p", 0.2, {}, "aileron", +1),
        ("phi", 0.0, {"phi": 0.3}, "aileron", -1),  # right bank wanted: negative
        ("psi", -0.3, {"roll_mode": 1}, "aileron", -1),  # heading to the right: bank right
        ("r", 0.1, {}, "rudder", +1),  # yawing right: yaw left, positive
    ],
)
def test_signs(channel, value, target, surface, sign):
    m = cruise()
    m[channel] = value
    trim = {"elevator": 0.01, "throttle_left": 0.6, "throttle_right": 0.6}.get(surface, 0.0)
    assert (one_step(m, **target)[0][surface] - trim)*sign > 1e-4


def test_coordinated_turn_asks_no_rudder_and_counts_no_pitch_rate():
    m, phi = cruise(), 0.4
    rate = 9.80665*np.tan(phi)/72.0
    m["phi"], m["q"], m["r"] = phi, rate*np.sin(phi), rate*np.cos(phi)
    m["theta"] = 0.0
    c, _ = one_step(m, pitch_mode=0, theta=0.0, phi=phi)
    assert c["rudder"] == pytest.approx(0.0, abs=1e-9)
    assert c["elevator"] == pytest.approx(0.01, abs=5e-4)  # without the turn: 0.017


def test_heading_goes_the_short_way():
    m = cruise()
    m["psi"] = 3.0 + 4*np.pi
    c, _ = one_step(m, start=m, roll_mode=1, heading=-3.0)  # 0.28 rad to the right, not 6 to the left
    assert c["aileron"] < 0


def test_integrators_do_not_wind_up():
    gains = autopilot.default_gains()
    a, c, t, m = autopilot.init(1), np.zeros(1, COMMAND), np.zeros(1, TARGET), cruise()
    t["theta"], t["speed_mode"], t["airspeed"], t["phi"] = 0.35, 1, 120.0, 0.4
    m["theta"], m["phi"] = -0.3, -1.0
    for _ in range(6000):  # two minutes that no surface can mend
        steer(autopilot, a, c, m, t, free(), gains, DT)
    saturated = c.copy()
    assert saturated["elevator"] == gains["elevator_min"] and saturated["throttle_left"] == 1.0
    m["theta"], m["phi"], m["airspeed"] = 0.40, 0.6, 121.0  # just beyond the targets: all leave their limits at once
    steer(autopilot, a, c, m, t, free(), gains, DT)
    assert c["elevator"] > saturated["elevator"]
    assert c["aileron"] > saturated["aileron"]
    m["ax"], m["az"] = 9.80665*np.sin(0.40), -9.80665*np.cos(0.40)  # steady
    for _ in range(300):  # the airspeed filter follows in a few seconds
        steer(autopilot, a, c, m, t, free(), gains, DT)
    assert c["throttle_left"] < 1.0


def test_gusts_at_the_stop_of_the_levers_do_not_take_the_power_off():
    a, c, m, t = autopilot.init(1), np.zeros(1, COMMAND), cruise(), np.zeros(1, TARGET)
    t["speed_mode"], t["airspeed"], t["theta"] = 1, 72.0, 0.02
    m["throttle_left"] = m["throttle_right"] = 0.9
    gains, trim = autopilot.default_gains(), []
    for k in range(6000):
        m["airspeed"] = 72.0 + (2.0 if k//250 % 2 else -2.0)
        steer(autopilot, a, c, m, t, free(), gains, DT)
        trim.append(float(a["throttle_trim"][0]))
    assert np.mean(trim[-500:]) == pytest.approx(0.9, abs=0.06)  # without more than the gusts' own 0.04 of drift


def test_a_protection_that_acts_stops_the_pulling_integrator():
    m = cruise()
    m["theta"] = -0.05
    advisory = free()
    before = one_step(m, advisory, pitch_mode=0)[1]["elevator_trim"]
    advisory["intervention"] = 0.01
    assert one_step(m, advisory, pitch_mode=0)[1]["elevator_trim"] > before


def test_advisory_limits_what_is_asked_for():
    advisory = free()
    advisory["bank_limit"], advisory["airspeed_limit"], advisory["flap_limit"] = 0.1, 80.0, 0.35
    gains = autopilot.default_gains()
    a, c, m, t = autopilot.init(1), np.zeros(1, COMMAND), cruise(), np.zeros(1, TARGET)
    t["pitch_mode"], t["altitude"], t["speed_mode"], t["airspeed"] = 1, 2400.0, 1, 60.0
    t["phi"], t["flap"], m["airspeed"] = 0.5, 0.65, 75.0
    for _ in range(200):
        steer(autopilot, a, c, m, t, advisory, gains, DT)
    assert a["bank_command"] == pytest.approx(0.1 - gains["bank_margin"][0])
    assert c["flap"] == 0.35
    assert c["throttle_left"] > 0.6  # towards the limit, not the target
    assert c["elevator"] > 0.05  # the climb yields to the airspeed
    advisory = free()
    advisory["alpha_limit"] = -0.02
    assert one_step(cruise(), advisory, pitch_mode=0, theta=0.2)[0]["elevator"] > 0.01
    advisory = free()
    advisory["pitch_limit"] = 0.02
    assert one_step(cruise(), advisory, pitch_mode=0, theta=0.2)[0]["elevator"] > 0.01


def test_near_the_speed_limit_the_descent_is_the_one_that_full_power_sustains():
    advisory = free(2)
    advisory["airspeed_limit"], advisory["climb_spare"] = 60.0, (-0.05, 0.05)
    a, c, m, t = autopilot.init(2), np.zeros(2, COMMAND), cruise(2), np.zeros(2, TARGET)
    gains = autopilot.default_gains()
    m["airspeed"] = 60.0 + gains["airspeed_margin"][0]
    t["pitch_mode"], t["altitude"], t["speed_mode"], t["airspeed"] = 1, 2200.0, 1, 60.0
    for _ in range(200):
        steer(autopilot, a, c, m, t, advisory, gains, DT)
    assert a["climb_command"] == pytest.approx([-0.05*m["airspeed"][0], 0.0], abs=0.15)


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_finite_in_finite_and_within_limits_out(seed):
    n = 16
    a, c, gains = autopilot.init(n), requested(n, seed), autopilot.default_gains()
    for k in range(4):
        steer(autopilot, a, c, scattered(n, seed + k), targets(n, seed), free(n), gains, DT)
    for row in (a, c):
        assert all(np.isfinite(row[name]).all() for name in row.dtype.names)
    assert (c["elevator"] >= gains["elevator_min"]).all() and (c["elevator"] <= gains["elevator_max"]).all()
    for name in ("aileron", "rudder"):
        assert (np.abs(c[name]) <= gains[f"{name}_max"]).all()
    assert (c["throttle_left"] >= 0).all() and (c["throttle_left"] <= 1).all()


def test_single_equals_batch_bit_for_bit():
    n, gains = 7, autopilot.default_gains()
    t, batch, c = targets(n, 1), autopilot.init(n), requested(n, 1)
    alone, single = autopilot.init(n), requested(n, 1)
    for k in range(20):
        m = scattered(n, k)
        steer(autopilot, batch, c, m, t, free(n), np.repeat(gains, n), DT)
        for i in range(n):
            j = slice(i, i + 1)
            steer(autopilot, alone[j], single[j], m[j], t[j], free(1), gains, DT)
    assert batch.tobytes() == alone.tobytes() and c.tobytes() == single.tobytes()


def test_gains_file_is_checked(tmp_path):
    text = 'K_theta = { value = 1.0, unit = "1", source = "test" }\n'
    fields = [("K_theta", "1", "elevator per pitch error")]
    path = tmp_path / "gains.toml"
    for broken, message in (
        (text + text.replace("K_theta", "K_thetta"), "did you mean 'K_theta'"),
        (text.replace('"1"', '"deg"'), "must be in '1'"),
        (text.replace('"test"', '""'), "names no source"),
        (text.replace("1.0", "nan"), "must be finite"),
        ("", "is missing"),
    ):
        path.write_text(broken)
        with pytest.raises(InputError, match=message):
            read_parameters(path, fields)
    path.write_text(text)
    assert read_parameters(path, fields)["K_theta"] == 1.0
