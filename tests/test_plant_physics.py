"""The plant against physics: what must be conserved, what must be symmetric, what must stay finite."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from plant import continuous, flown_from_trim, level, loads, rates
from scipy.spatial.transform import Rotation

from icing_env.aircraft import broadcast, changed, load
from icing_env.simulate import Fleet
from icing_env.trim import trim
from icing_env.types import COMMAND, SURFACES

AIRCRAFT = load()
FLAP = float(AIRCRAFT["flap_max"][0])


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


@settings(max_examples=15)
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


# ---- what must stay finite


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
