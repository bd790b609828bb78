"""The plant against the real aircraft: lift, stall, ice, failures, limits, and the standard atmosphere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plant import coefficients, flown_from_trim, level, loads, rates

from icing_env import atmosphere
from icing_env.aircraft import changed, load
from icing_env.simulate import Fleet
from icing_env.trim import trim
from icing_env.types import CURRENT, DERIVATIVE_NAMES, SURFACES

AIRCRAFT = load()
SETS = {name: load(name) for name in ("twin_otter", "twin_otter_flight")}
FLAP = float(AIRCRAFT["flap_max"][0])
LBS12500, KNOT = 5669.9, 0.514444



# ---- what the air does to the aircraft


def test_finite_and_bounded_over_the_whole_range() -> None:
    alpha, beta = np.meshgrid(np.radians(np.arange(-30, 41)), np.radians(np.arange(-20, 21, 4)))
    alpha, beta = alpha.ravel(), beta.ravel()
    n = len(alpha)
    for corner in range(32):
        s = level(n, 60.0, alpha, beta)
        for bit, name in enumerate(("elevator", "aileron", "rudder")):
            s[name] = AIRCRAFT[f"{name}_max" if corner >> bit & 1 else f"{name}_min"][0]
        s["flap"] = FLAP * (corner >> 3 & 1)
        for surface in SURFACES:
            s[f"eta_{surface}"] = 0.5 * (corner >> 4 & 1)
        c = coefficients(s, AIRCRAFT)
        for name, limit in (("CL", 3.2), ("CY", 0.5), ("Cl", 0.4), ("Cm", 2.0), ("Cn", 0.2)):
            assert np.isfinite(c[name]).all() and np.abs(c[name]).max() < limit, (name, np.abs(c[name]).max())
        assert c["CD"].min() > 0.02, c["CD"].min()
        assert c["CD"].max() < 2.0


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize(("flap", "low", "high"), [(0.0, 1.4, 1.8), (FLAP, 2.2, 3.0)])
def test_lift_curve(name: str, flap: float, low: float, high: float) -> None:
    alpha = np.radians(np.arange(-30.0, 40.0, 0.02))
    lift = coefficients(level(len(alpha), 60.0, alpha, flap=flap), SETS[name])["CL"]
    top = int(lift.argmax())
    assert low <= lift[top] <= high
    assert 9.0 <= math.degrees(alpha[top]) <= 17.0
    assert np.abs(np.diff(lift)).max() < 0.008  # continuous: no more than its steepest slope, 0.02 deg apart
    slopes = np.diff(lift) / np.diff(alpha)
    assert np.abs(np.diff(slopes)).max() < 0.2  # and smooth
    before_stall = (alpha > np.radians(-8.0)) & (alpha < alpha[top] - np.radians(4.0))
    assert (np.diff(lift[before_stall]) > 0.0).all()


@pytest.mark.parametrize(("flap", "knots"), [(0.0, 74.0), (FLAP, 58.0)])
def test_stall_speed_of_the_flight_manual(flap: float, knots: float) -> None:
    """74 kt flap up, 58 kt full flap at 12,500 lb at sea level (YASim dhc6.xml), within 4 %."""
    alpha = np.radians(np.arange(0.0, 25.0, 0.1))
    lift = coefficients(level(len(alpha), 60.0, alpha, flap=flap), AIRCRAFT)["CL"].max()
    speed = math.sqrt(2 * LBS12500 * 9.80665 / (1.225 * float(AIRCRAFT["wing_area"][0]) * lift))
    assert speed / KNOT == pytest.approx(knots, rel=0.04)


@pytest.mark.parametrize("flap", [0.0, FLAP])
def test_pitching_moment_is_stable_up_to_the_stall(flap: float) -> None:
    alpha = np.radians(np.arange(-6.0, 14.0, 0.1))
    moment = coefficients(level(len(alpha), 60.0, alpha, flap=flap), AIRCRAFT)["Cm"]
    assert (np.diff(moment) < 0.0).all()


def test_below_the_stall_the_published_derivatives_come_back() -> None:
    """The plant's coefficients in body axes are the published sums, to rounding."""
    rng = np.random.default_rng(4)
    n, p = 200, changed(AIRCRAFT, CT_reference=0.0)
    alpha, beta = rng.uniform(-0.1, 0.15, n), rng.uniform(-0.2, 0.2, n)
    s = level(n, 70.0, alpha, beta, altitude=4000.0)
    for name in ("p", "q", "r"):
        s[name] = rng.uniform(-0.1, 0.1, n)
    for name in ("elevator", "aileron", "rudder"):
        s[name] = rng.uniform(-0.1, 0.1, n)
    f = loads(s, p)
    v = {k: float(p[k][0]) for k in (*DERIVATIVE_NAMES, "span", "chord", "wing_area", "Cm_alphadot")}
    qs = 0.5 * f["density"] * 70.0**2 * v["wing_area"]
    ph, qh, rh = s["p"] * v["span"] / 140.0, s["q"] * v["chord"] / 140.0, s["r"] * v["span"] / 140.0
    de, da, dr = s["elevator"], s["aileron"], s["rudder"]
    expected = {
        "fx": v["CX_0"] + v["CX_alpha"] * alpha + v["CX_alpha2"] * alpha**2,
        "fz": v["CZ_0"] + v["CZ_alpha"] * alpha + v["CZ_q"] * qh + v["CZ_elevator"] * de,
        "fy": v["CY_beta"] * beta + v["CY_p"] * ph + v["CY_r"] * rh + v["CY_rudder"] * dr,
    }
    for name, value in expected.items():
        np.testing.assert_allclose(f[name] / qs, value, rtol=0, atol=2e-6, err_msg=name)  # ground effect at 4000 m
    moments = {
        "roll": (v["span"], v["Cl_beta"] * beta + v["Cl_p"] * ph + v["Cl_r"] * rh + v["Cl_aileron"] * da
                 + v["Cl_rudder"] * dr),
        "yaw": (v["span"], v["Cn_beta"] * beta + v["Cn_p"] * ph + v["Cn_r"] * rh + v["Cn_aileron"] * da
                + v["Cn_rudder"] * dr),
        "pitch": (v["chord"], v["Cm_0"] + v["Cm_alpha"] * alpha + (v["Cm_q"] - v["Cm_alphadot"]) * qh
                  + v["Cm_elevator"] * de),
    }  # fmt: skip
    for name, (length, value) in moments.items():
        np.testing.assert_allclose(f[name] / (qs * length), value, rtol=0, atol=2e-6, err_msg=name)


def test_downwash_lag_and_pitch_damping_add_up_to_the_published_one() -> None:
    """With alpha growing at the rate q, the tail meets the downwash of l_t/V ago, and the sum is Cm_q."""
    p, q, speed = AIRCRAFT, 0.1, 70.0
    still, moving = level(1, speed, 0.05), level(1, speed, 0.05, q=q)
    moving["alpha_downwash"] = 0.05 - q * p["tail_arm"] / speed
    change = coefficients(moving, p)["Cm"] - coefficients(still, p)["Cm"]
    np.testing.assert_allclose(change, p["Cm_q"] * q * p["chord"] / (2 * speed), rtol=1e-9)


def test_ground_effect_lifts_and_fades() -> None:
    height = np.array([0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 500.0])
    c = coefficients(level(len(height), 50.0, 0.1, altitude=height), AIRCRAFT)
    assert (np.diff(c["CL"]) < 0.0).all()
    assert (np.diff(c["CD"]) > 0.0).all()
    assert (np.diff(c["Cm"]) > 0.0).all()
    far = coefficients(level(1, 50.0, 0.1, altitude=3000.0), AIRCRAFT)
    assert c["CL"][0] / far["CL"][0] == pytest.approx(1.08, abs=0.02)
    assert c["CL"][-1] == pytest.approx(far["CL"][0], rel=1e-4)


# ---- how ice and failures bite


def test_one_iced_wing_stalls_first_and_drops() -> None:
    degrees = np.array([2.0, 6.0, 12.0, 14.0])
    clean = level(4, 50.0, np.radians(degrees))
    iced = clean.copy()
    iced["eta_left_wing"] = 0.3
    roll = rates(iced, AIRCRAFT)["p"] - rates(clean, AIRCRAFT)["p"]
    assert (roll < 0.0).all()  # left wing down
    assert abs(roll[0]) < 0.3
    assert roll[2] < -0.5
    assert roll[3] < 3.0 * roll[1]


def test_asymmetric_ice_at_high_alpha_snatches_the_aileron() -> None:
    """Roselawn (NTSB/AAR-96/01): flow separates ahead of one aileron and draws it, rolling into the stalled wing."""
    p = AIRCRAFT
    held = float(p["hinge_aileron_hold"][0])
    iced = level(2, 80.0, np.radians([3.0, 12.0]), eta_left_wing=0.4)
    moment = loads(iced, p)["hinge_aileron"]
    assert abs(moment[0]) < 0.2 * held  # held in ordinary flight
    assert moment[1] > held
    assert rates(iced, p)["aileron"][0] == 0.0
    assert rates(iced, p)["aileron"][1] > 0.0  # rolls left, though nobody moves the wheel
    clean = level(1, 80.0, np.radians(12.0))
    assert abs(loads(clean, p)["hinge_aileron"][0]) < 1e-6


def test_iced_tailplane_stalls_with_flap_and_push_over() -> None:
    """The tailplane icing programme: flap and a push-over stall an iced tail; nose and elevator are drawn down."""
    p, rows = AIRCRAFT, {"flap": FLAP, "q": -0.1}
    clean, iced, up = (level(1, 45.0, np.radians(-4.0), **rows) for _ in range(3))
    iced["eta_htail"], up["eta_htail"], up["flap"] = 0.4, 0.4, 0.0
    drop = coefficients(iced, p)["Cm"] - coefficients(clean, p)["Cm"]
    assert drop[0] < -0.05
    assert loads(iced, p)["hinge_elevator"][0] > float(p["hinge_elevator_hold"][0])
    assert loads(clean, p)["hinge_elevator"][0] < 0.2 * float(p["hinge_elevator_hold"][0])
    assert rates(iced, p)["elevator"][0] > 0.0  # trailing edge down: pitches further down
    assert rates(clean, p)["elevator"][0] == 0.0
    assert abs(rates(up, p)["elevator"][0]) == 0.0  # not without flap


def test_iced_tail_loses_elevator_power() -> None:
    p = AIRCRAFT
    power = []
    for eta in (0.0, 0.2):
        up, down = (level(1, 45.0, -0.1, flap=FLAP, eta_htail=eta, elevator=e) for e in (-0.1, 0.1))
        power.append((coefficients(up, p)["Cm"] - coefficients(down, p)["Cm"])[0])
    assert 0.25 < power[1] / power[0] < 0.7  # over 30 per cent lost (Ratvasky & Ranaudo, AIAA-93-0398)


@pytest.mark.parametrize(("dead", "sign"), [("left", -1.0), ("right", 1.0)])
def test_aircraft_yaws_towards_the_dead_engine(dead: str, sign: float) -> None:
    t = trim(AIRCRAFT)
    s = t.state.copy()
    s[f"power_{dead}"] = 0.0
    assert sign * rates(s, AIRCRAFT, t.command)["r"][0] > 0.05
    asymmetric = trim(AIRCRAFT, airspeed=50.0, altitude=300.0, **{f"share_{dead}": 0.0})
    assert sign * asymmetric.rudder > 0.02  # against the yaw


def test_ice_costs_lift_drag_and_speed() -> None:
    clean, iced = trim(AIRCRAFT, airspeed=60.0), trim(AIRCRAFT, dict.fromkeys(SURFACES, 0.08), airspeed=60.0)
    assert iced.throttle > 1.1 * clean.throttle
    assert iced.alpha > clean.alpha + 0.005


# ---- limits


def test_without_ice_every_coefficient_is_the_clean_one_bit_for_bit() -> None:
    fleet = Fleet(AIRCRAFT)
    fleet.state[:] = trim(AIRCRAFT).state
    fleet.start()
    fleet.step()
    for name in (*DERIVATIVE_NAMES, "CD_parasite", "mass", "alpha_tail_stall"):
        assert fleet.current[name][0] == AIRCRAFT[name][0], name
    for side in ("left", "right"):
        assert fleet.current[f"CZ_alpha_{side}"][0] == AIRCRAFT["CZ_alpha"][0]
        assert fleet.current[f"alpha_stall_{side}"][0] == AIRCRAFT["alpha_stall"][0]


def test_the_trimmed_aircraft_stays_where_it_is() -> None:
    t = trim(AIRCRAFT)
    s = flown_from_trim(AIRCRAFT, 10.0).state
    assert abs(s["altitude"][0] - 2200.0) < 1e-6
    for name in ("u", "w", "q", "elevator", "alpha_downwash"):
        assert abs(s[name][0] - t.state[name][0]) < 1e-7, name
    assert s["v"][0] == 0.0 and s["p"][0] == 0.0


# ---- the standard atmosphere

US1976 = [  # geometric altitude m, temperature K, pressure Pa, density kg/m3; table I of the standard
    (0.0, 288.150, 1.01325e5, 1.2250), (2000.0, 275.154, 7.9501e4, 1.0066), (5000.0, 255.676, 5.4048e4, 7.3643e-1),
    (11000.0, 216.774, 2.2700e4, 3.6480e-1), (15000.0, 216.650, 1.2111e4, 1.9476e-1),
    (20000.0, 216.650, 5.5293e3, 8.8910e-2),
]  # fmt: skip


@pytest.mark.parametrize(("altitude", "kelvin", "pascal", "rho"), US1976)
def test_standard_atmosphere(altitude: float, kelvin: float, pascal: float, rho: float) -> None:
    assert atmosphere.temperature(altitude) == pytest.approx(kelvin, abs=6e-4)
    assert atmosphere.pressure(altitude) == pytest.approx(pascal, rel=1e-4)
    assert atmosphere.density(altitude) == pytest.approx(rho, rel=6e-5)


@given(st.floats(-300.0, 20000.0))
def test_pressure_altitude_inverts_pressure(altitude: float) -> None:
    assert atmosphere.pressure_altitude(atmosphere.pressure(altitude)) == pytest.approx(altitude, abs=1e-6)


def test_every_coefficient_of_the_moment_is_written() -> None:
    """In flight none is zero but those that may be."""
    fleet = Fleet(load("twin_otter_flight"))
    fleet.state[:] = level(1, 70.0)
    fleet.start()
    zero = {name for name in CURRENT.names if float(fleet.current[name][0]) == 0.0}
    assert zero <= {"CD_parasite", "CY_p", "elapsed"}
