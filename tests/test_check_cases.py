"""NASA's check cases: against NASA's trajectories, closed forms, and a fall over a round Earth of the test's own."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipkinc

from icing_env.atmosphere import density
from icing_env.errors import InputError
from testbed.benchmarks import checkcases
from testbed.benchmarks.checkcases import CASES, GM, START, WGS84, Case, Trajectory, differences, fly, gravity

FOLDER = Path(os.environ.get("ICING_CHECK_CASES") or Path(__file__).resolve().parents[2] / "shared" / "checkcases")
ABSENT = "set ICING_CHECK_CASES to the folder of NASA's trajectories"
TIME = np.arange(301) * 0.1


@cache
def flown(number: str) -> Trajectory:
    return fly(CASES[number])


def tumbling_rates(time: NDArray, inertia: tuple[float, float, float], start: NDArray) -> NDArray:
    """Rates (rad/s, n x 3) of a free rigid body with principal moments that rise.

    Jacobi's solution in elliptic functions (Landau & Lifshitz, Mechanics, section 37, for M^2 > 2 E I2; else with the
    axes counted the other way).
    """
    i, w = np.asarray(inertia, float), np.asarray(start, float)
    energy2, momentum2 = float(i @ w**2), float(i**2 @ w**2)
    order = [0, 1, 2] if momentum2 > energy2 * i[1] else [2, 1, 0]
    (a, b, c), (wa, wb, wc) = i[order], w[order]
    wide, narrow = energy2 * c - momentum2, momentum2 - energy2 * a
    size = np.sqrt([wide / (a * (c - a)), wide / (b * (c - b)), narrow / (c * (c - a))])
    speed = np.sqrt((c - b) * narrow / (a * b * c))
    modulus = (b - a) * wide / ((c - b) * narrow)
    side = np.copysign(1.0, wc)  # this rate never changes sign
    phase = ellipkinc(np.arctan2(wb / size[1], wa / size[0]), modulus)
    sn, cn, dn, _ = ellipj(phase + side * speed * time, modulus)
    rates = np.empty((len(time), 3))
    rates[:, order] = np.stack([size[0] * cn, size[1] * sn, side * size[2] * dn], axis=1)
    return rates


def round_earth(case: Case) -> tuple[NDArray, NDArray, NDArray]:
    """Altitude (m), velocity down (m/s) and body rates (deg/s) of a case, over the equator of its Earth.

    The fall stays in the plane of the equator: polar coordinates, inertial, and Euler's equations; DOP853.
    """
    body, moments, earth = case.body, np.array(case.body.inertia), case.planet
    area = body.area / body.mass

    def rhs(_t: float, y: NDArray) -> NDArray:
        r, radial, turn, w = y[0], y[1], y[2], y[3:]
        h = r - earth.radius
        east = r * (turn - earth.rate) - case.wind[0] - case.wind[1] * h
        speed = np.hypot(east, radial)
        rho = density(h)
        drag = 0.5 * rho * speed * body.drag * area
        pull = GM / r**2 * (1.0 + 1.5 * earth.j2 * (earth.radius / r) ** 2)
        torque = np.array([body.span**2, body.chord**2, body.span**2]) * w * body.damping
        torque *= 0.25 * rho * speed * body.area * (speed / max(speed, 0.1524))
        w_dot = (torque - np.cross(w, moments * w)) / moments
        return np.array([radial, r * turn**2 - pull - drag * radial, -(2 * radial * turn + drag * east) / r, *w_dot])

    start = [earth.radius + START, 0.0, earth.rate, *np.radians(case.rates)]
    y = solve_ivp(rhs, (0, 30), start, method="DOP853", t_eval=TIME, rtol=1e-12, atol=1e-11).y
    return y[0] - earth.radius, -y[1], np.degrees(y[3:].T)


@pytest.mark.parametrize("number", CASES)
def test_nasa_trajectory(number: str) -> None:
    if checkcases.find(number, FOLDER) is None:
        pytest.skip(f"no Atmos_{number}_sim_*.csv in {FOLDER}: {ABSENT}")
    found = checkcases.run(number, FOLDER)
    for name, limit in CASES[number].tolerance.items():
        assert found[name] <= limit, f"{name} differs by {found[name]:.3g}, allowed are {limit:g}"


@pytest.mark.parametrize("number", ["01", "02", "03", "05", "06", "07", "08"])
def test_vertical_channel_and_rates_over_a_round_earth(number: str) -> None:
    altitude, down, rates = round_earth(CASES[number])
    found, limits = flown(number), CASES[number].tolerance
    assert np.abs(found.altitude - altitude).max() < limits["altitude"]
    assert np.abs(found.velocity[:, 2] - down).max() < limits["velocity_down"]
    assert np.abs(found.rates - rates).max() < 1e-5


def test_the_round_earth_of_this_test_falls_as_nasas() -> None:
    path = checkcases.find("06", FOLDER)
    if path is None:
        pytest.skip(f"no Atmos_06_sim_*.csv in {FOLDER}: {ABSENT}")
    nasa, (altitude, down, _) = checkcases.read(path), round_earth(CASES["06"])
    assert np.abs(nasa.altitude - altitude).max() < 1e-3
    assert np.abs(nasa.velocity[:, 2] - down).max() < 5e-5


def test_tumbling_brick_follows_the_closed_form() -> None:
    expected = np.degrees(tumbling_rates(TIME, CASES["02"].body.inertia, np.radians([10.0, 20.0, 30.0])))
    np.testing.assert_allclose(expected[-1], [12.61839078, -17.39747476, 31.11958889], atol=2e-8)
    assert np.abs(flown("02").rates - expected).max() < 1e-8


def test_case_04_agrees_with_the_independent_solution() -> None:
    """Ends of a DOP853 solution of the case (rtol 1e-11) by another author: altitude, velocity down, attitude."""
    path = FOLDER / "digest" / "atmos_04_1hz_si.csv"
    if not path.is_file():
        pytest.skip(f"{path} is absent: {ABSENT}")
    table = np.genfromtxt(path, delimiter=",", names=True)
    found = flown("04")
    assert np.abs(found.altitude[::10] - table["ref_h_m"]).max() < 1e-3
    assert np.abs(found.velocity[::10, 2] - table["ref_vd_mps"]).max() < 1e-4
    for column, name in enumerate(("roll", "pitch", "yaw")):
        assert np.abs(found.attitude[::10, column] - table[f"ref_{name}_deg"]).max() < 1e-4


def test_dropped_sphere_without_drag_falls_by_half_g_t_squared() -> None:
    found, (g0, radius) = flown("01"), gravity(WGS84)
    g = g0 * (radius / (radius + START)) ** 2
    gradient = 2.0 * g / (radius + START)  # gravity grows as the sphere falls: h'' = -g + gradient (h - h0)
    k = np.sqrt(gradient)
    expected = START - g / gradient * (np.cosh(k * TIME) - 1.0)
    assert np.abs(found.altitude - expected).max() < 2e-3  # second order in the fall left out: 1.5e-3 m
    assert np.abs(found.altitude - (START - 0.5 * g * TIME**2)).max() < 1.1
    assert np.abs(found.altitude[:50] - (START - 0.5 * g * TIME[:50] ** 2)).max() < 1e-3
    assert np.abs(found.velocity[:, :2]).max() == 0.0


def test_order_of_the_integration() -> None:
    """Halving a long step cuts the error of the tumbling attitude sixteenfold."""
    truth = fly(CASES["04"], dt=0.02, substeps=8)
    errors = [differences(fly(CASES["04"], dt=0.1, substeps=n), truth)["attitude"] for n in (1, 2)]
    assert 12.0 < errors[0] / errors[1] < 20.0


def test_what_is_absent_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no check case '11'"):
        checkcases.run("11", tmp_path)
    with pytest.raises(InputError, match="no Atmos_04"):
        checkcases.run("04", tmp_path)
    (tmp_path / "Atmos_04_sim_04.csv").write_text("time,altitudeMsl_ft\n" + "".join(f"{t},0\n" for t in TIME))
    with pytest.raises(InputError, match="feVelocity_ft_s_X"):
        checkcases.run("04", tmp_path)
