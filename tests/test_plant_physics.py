"""The plant against physics: what must be conserved, what must be symmetric, and what the real aircraft does."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from plant import coefficients, continuous, flown_from_trim, level, loads, rates
from scipy.spatial.transform import Rotation

from icing_env import atmosphere
from icing_env.aircraft import broadcast, changed, load
from icing_env.simulate import Fleet
from icing_env.trim import trim
from icing_env.types import COMMAND, CURRENT, DERIVATIVE_NAMES, STATE, SURFACES

AIRCRAFT = load()
SETS = {name: load(name) for name in ("twin_otter", "twin_otter_flight")}
FLAP = float(AIRCRAFT["flap_max"][0])
FIXED = ("north", "east", "altitude")
LBS12500, KNOT = 5669.9, 0.514444


def attitude(s: NDArray) -> Rotation:
    return Rotation.from_quat(np.stack([s["e1"], s["e2"], s["e3"], s["e0"]], axis=1))


def anywhere(n: int, seed: int, parameters: NDArray = AIRCRAFT) -> tuple[NDArray, NDArray]:
    """Random states, in and beyond the envelope, with gusts and ice, and commands."""
    rng = np.random.default_rng(seed)
    speed, alpha, beta = rng.uniform(25, 110, n), rng.uniform(-0.5, 0.7, n), rng.uniform(-0.35, 0.35, n)
    s = level(n, speed, alpha, beta, rng.uniform(5, 6000, n))
    turn = Rotation.random(n, random_state=seed).as_quat()
    s["e1"], s["e2"], s["e3"], s["e0"] = turn.T
    for name, size in (("p", 1.0), ("q", 0.6), ("r", 0.6), ("gust_u", 4.0), ("gust_v", 4.0), ("gust_w", 4.0),
                       ("gust_w_tail", 4.0), ("gust_p", 0.2), ("gust_q", 0.2), ("gust_r", 0.2)):  # fmt: skip
        s[name] = rng.uniform(-size, size, n)
    u = np.zeros(n, COMMAND)
    for name in ("elevator", "aileron", "rudder"):
        low, high = parameters[f"{name}_min"][0], parameters[f"{name}_max"][0]
        s[name], u[name] = rng.uniform(low, high, n), rng.uniform(1.2 * low, 1.2 * high, n)
    s["flap"], u["flap"] = rng.uniform(0, FLAP, n), rng.uniform(0, FLAP, n)
    for side in ("left", "right"):
        s[f"power_{side}"], u[f"throttle_{side}"] = rng.uniform(0, 4e5, n), rng.uniform(0, 1, n)
    s["alpha_downwash"] += rng.uniform(-0.1, 0.1, n)
    for surface in SURFACES:
        s[f"eta_{surface}"] = rng.uniform(0, 0.4, n) * rng.integers(0, 2, n)
        s[f"ice_mass_{surface}"] = rng.uniform(0, 40, n)
    return s, u


# ---- what must be conserved


@settings(max_examples=15, deadline=None)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(20.0, 100.0), st.floats(-300.0, 300.0))
def test_without_air_energy_and_angular_momentum_are_conserved(w: tuple, speed: float, xz: float) -> None:
    p = changed(AIRCRAFT, density_factor=0.0, power_rated=0.0, inertia_xz=1528.0 + xz)
    fleet = Fleet(p)
    fleet.state[:] = level(1, speed, 0.1, 0.1, altitude=4000.0)
    fleet.state["p"], fleet.state["q"], fleet.state["r"] = w
    fleet.start()
    states = [fleet.state.copy()]
    for _ in range(500):
        fleet.step()
        states.append(fleet.state.copy())
    s = np.concatenate(states)
    xx, yy, zz, xz = (float(p[f"inertia_{k}"][0]) for k in ("xx", "yy", "zz", "xz"))
    inertia = np.array([[xx, 0.0, -xz], [0.0, yy, 0.0], [-xz, 0.0, zz]])
    omega = np.stack([s["p"], s["q"], s["r"]], axis=1)
    momentum = attitude(s).apply(omega @ inertia)
    size = np.linalg.norm(momentum[0])
    assert np.abs(momentum - momentum[0]).max() <= 1e-7 * size + 1e-9
    spin = 0.5 * np.einsum("ni,ij,nj->n", omega, inertia, omega)
    assert np.abs(spin - spin[0]).max() <= 1e-7 * spin[0] + 1e-12
    g, radius = p["gravity_sea_level"][0], p["earth_radius"][0]
    energy = 0.5 * (s["u"] ** 2 + s["v"] ** 2 + s["w"] ** 2) - g * radius**2 / (radius + s["altitude"])
    assert np.abs(energy - energy[0]).max() < 1e-4  # J/kg of 5e3 exchanged; what is left is the step's
    assert np.ptp(s["altitude"]) > 400.0


def test_energy_changes_by_the_power_of_the_forces() -> None:
    s, u = anywhere(2000, 1)
    dx, f, p = rates(s, AIRCRAFT, u), loads(s, AIRCRAFT), AIRCRAFT
    mass = p["mass"] + sum(s[f"ice_mass_{k}"] for k in SURFACES)
    g = p["gravity_sea_level"] * (p["earth_radius"] / (p["earth_radius"] + s["altitude"])) ** 2
    rotation = (p["inertia_xx"] * s["p"] - p["inertia_xz"] * s["r"]) * dx["p"] + p["inertia_yy"] * s["q"] * dx["q"]
    rotation += (p["inertia_zz"] * s["r"] - p["inertia_xz"] * s["p"]) * dx["r"]
    translation = mass * (s["u"] * dx["u"] + s["v"] * dx["v"] + s["w"] * dx["w"] + g * dx["altitude"])
    power = f["fx"] * s["u"] + f["fy"] * s["v"] + f["fz"] * s["w"]
    spin = f["roll"] * s["p"] + f["pitch"] * s["q"] + f["yaw"] * s["r"]
    np.testing.assert_allclose(translation, power, rtol=1e-9, atol=1e-4 * mass.max() * 1e-3)
    np.testing.assert_allclose(rotation, spin, rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize("gamma", [-0.05, 0.0, 0.05])
def test_in_steady_flight_excess_thrust_pays_for_the_climb(gamma: float) -> None:
    t = trim(AIRCRAFT, airspeed=65.0, climb_angle=gamma)
    f = loads(t.state, AIRCRAFT)
    climb = float(rates(t.state, AIRCRAFT, t.command)["altitude"][0])
    assert climb == pytest.approx(65.0 * math.sin(gamma), abs=1e-6)
    power = float((f["fx"] * t.state["u"] + f["fy"] * t.state["v"] + f["fz"] * t.state["w"])[0])
    g = 9.80665 * (6356766.0 / (6356766.0 + 2200.0)) ** 2
    assert power == pytest.approx(float(AIRCRAFT["mass"][0]) * g * climb, abs=1.0)  # of 2e5 W


def test_quaternion_keeps_unit_length() -> None:
    s = flown_from_trim(changed(AIRCRAFT, turbulence_sigma_w=2.0), 30.0).state
    assert abs(s["e0"] ** 2 + s["e1"] ** 2 + s["e2"] ** 2 + s["e3"] ** 2 - 1.0)[0] < 1e-14


# ---- what must be symmetric

ODD = ("east", "v", "e1", "e3", "p", "r", "aileron", "rudder", "gust_v", "gust_p", "gust_r")
ODD_PARAMETERS = ("CY_0", "Cl_0", "Cn_0", "Cl_alpha", "cg_shift_y", "wind_east", "wind_east_shear",
                  "aileron_offset", "rudder_offset")  # fmt: skip


def mirrored(rows: NDArray, odd: tuple[str, ...]) -> NDArray:
    """The same flight seen in a mirror that stands in the plane of symmetry."""
    out = rows.copy()
    for name in odd:
        if name in rows.dtype.names:
            out[name] = -rows[name]
    for name in rows.dtype.names:
        if "left" in name and name != "cloud_left":
            other = name.replace("left", "right")
            out[name], out[other] = rows[other], rows[name]
    return out


def lopsided() -> NDArray:
    return changed(AIRCRAFT, CY_0=0.01, Cl_0=0.004, Cn_0=-0.003, Cl_alpha=0.02, cg_shift_y=0.1, wind_east=7.0,
                   wind_north=3.0, wind_east_shear=0.002, aileron_offset=0.01, rudder_offset=-0.02,
                   thrust_factor_left=0.8)  # fmt: skip


def test_left_is_right_in_a_mirror() -> None:
    s, u = anywhere(4000, 2)
    p = lopsided()
    straight = rates(s, p, u)
    mirror = rates(mirrored(s, ODD), mirrored(p, ODD_PARAMETERS), mirrored(u, ODD))
    expected = mirrored(straight, ODD)
    for name in straight.dtype.names:
        scale = np.abs(straight[name]).max() + 1e-30
        assert np.abs(mirror[name] - expected[name]).max() <= 1e-12 * scale, name
    assert np.abs(straight["p"]).max() > 1.0  # the test moves something


def test_a_flight_and_its_mirror_image_stay_mirror_images() -> None:
    p = lopsided()
    t = trim(AIRCRAFT, airspeed=62.0)
    flights = []
    for odd_state, odd_parameters in ((), ()), (ODD, ODD_PARAMETERS):
        fleet = Fleet(mirrored(p, odd_parameters) if odd_parameters else p)
        fleet.state[:], fleet.command[:] = t.state, t.command
        fleet.state["eta_left_wing"], fleet.command["throttle_right"] = 0.2, 0.3
        fleet.command["aileron"], fleet.command["rudder"], fleet.state["p"] = 0.05, -0.06, 0.2
        if odd_state:
            fleet.state[:], fleet.command[:] = mirrored(fleet.state, ODD), mirrored(fleet.command, ODD)
        fleet.start()
        for _ in range(500):
            fleet.step()
        flights.append(continuous(fleet.state))
    straight, mirror = flights
    expected = mirrored(straight, ODD)
    for name in straight.dtype.names:
        assert abs(mirror[name][0] - expected[name][0]) <= 1e-12 * max(abs(expected[name][0]), 1.0), name
    assert abs(straight["p"][0]) > 1e-3


def test_dynamic_similarity() -> None:
    """An aircraft twice as long, Froude-scaled, flies the same flow: accelerations equal, angular ones half."""
    k = 2.0
    s, u = anywhere(1000, 3)
    s["altitude"] = 3000.0
    for surface in SURFACES:
        s[f"ice_mass_{surface}"] = 0.0
    p = changed(AIRCRAFT, ground_altitude=3000.0 - 12.0)
    powers = {"wing_area": 2, "span": 1, "chord": 1, "tail_arm": 1, "mass": 3, "propeller_static_speed": 0.5,
              "engine_arm_y": 1, "engine_arm_z": 1, "power_rated": 3.5, "spool_time": 0.5,
              "hinge_elevator_volume": 3, "hinge_aileron_volume": 3}  # fmt: skip
    powers |= {f"inertia_{a}": 5 for a in ("xx", "yy", "zz", "xz")}
    powers |= {f"hinge_{a}_{b}": 4 for a in ("elevator", "aileron") for b in ("hold", "stiffness")}
    powers |= {f"{a}_lag": 0.5 for a in ("elevator", "aileron", "rudder")}
    powers |= {f"{a}_rate": -0.5 for a in ("elevator", "aileron", "rudder")}
    large = changed(p, ground_altitude=3000.0 - 12.0 * k, **{n: p[n] * k**e for n, e in powers.items()})
    big = s.copy()
    for name in ("u", "v", "w", "gust_u", "gust_v", "gust_w", "gust_w_tail"):
        big[name] *= k**0.5
    for name in ("p", "q", "r", "gust_p", "gust_q", "gust_r"):
        big[name] /= k**0.5
    for name in ("power_left", "power_right"):
        big[name] *= k**3.5
    small_rates, large_rates = rates(s, p, u), rates(big, large, u)
    dimension = {"u": 0, "v": 0, "w": 0, "p": -1, "q": -1, "r": -1, "elevator": -0.5, "aileron": -0.5, "rudder": -0.5,
                 "alpha_downwash": -0.5, "power_left": 3.0, "power_right": 3.0, "altitude": 0.5}  # fmt: skip
    for name, power in dimension.items():
        expected = small_rates[name] * k**power
        assert np.abs(large_rates[name] - expected).max() <= 1e-11 * np.abs(expected).max(), name


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


def test_random_flight_stays_finite() -> None:
    n = 256
    s, u = anywhere(n, 5)
    fleet = Fleet(broadcast(changed(AIRCRAFT, turbulence_sigma_w=5.0), n), n)
    fleet.state[:], fleet.command[:] = s, u
    fleet.start()
    for _ in range(500):
        fleet.step()
    for rows in (fleet.state, fleet.measurement, fleet.current, fleet.outcome):
        for name in rows.dtype.names:
            assert np.isfinite(rows[name]).all(), name
    for name in ("elevator", "aileron", "rudder"):
        assert (fleet.state[name] >= AIRCRAFT[f"{name}_min"] - 1e-12).all()
        assert (fleet.state[name] <= AIRCRAFT[f"{name}_max"] + 1e-12).all()


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
@settings(deadline=None)
def test_pressure_altitude_inverts_pressure(altitude: float) -> None:
    assert atmosphere.pressure_altitude(atmosphere.pressure(altitude)) == pytest.approx(altitude, abs=1e-6)


def test_rows_of_state_are_as_long_as_they_say() -> None:
    """The equations leave no field of the coefficients unwritten: none is zero in flight but those that may be."""
    fleet = Fleet(load("twin_otter_flight"))
    fleet.state[:] = level(1, 70.0)
    fleet.start()
    for name in CURRENT.names:
        if float(fleet.current[name][0]) == 0.0:
            assert name in ("CD_parasite", "CY_p"), name
    assert fleet.state.dtype == STATE
