"""Turbulence: variances, spectra, correlation, independence of the step, calm air, discrete gusts, wind."""

import math

import numpy as np
import pytest
from scipy import signal

from icing_env import turbulence
from icing_env.jit import kernel
from icing_env.types import STATE, structured
from icing_env.wind import WIND_PARAMETERS, wind

V, SPAN, ARM = 72.0, 19.81, 7.5
PARAMETERS = structured([*turbulence.TURBULENCE_PARAMETERS, ("span", "m", ""), ("tail_arm", "m", "")])
GUSTS = [f"gust_{name}" for name in ("u", "v", "w", "p", "q", "r", "w_tail")]


@kernel
def fly(states, parameters, airspeed, dt, out):
    s, p = states[0], parameters[0]
    for i in range(out.shape[0]):
        turbulence.advance_turbulence(s, p, airspeed, dt)
        s.step += 1
        out[i] = s.gust_u, s.gust_v, s.gust_w, s.gust_p, s.gust_q, s.gust_r, s.gust_w_tail


@kernel
def start(states, parameters, airspeed):
    for i in range(states.shape[0]):
        turbulence.start_turbulence(states[i], parameters[0], airspeed)


def setting(n: int = 1, altitude: float = 2000.0, **values: float) -> tuple[np.ndarray, np.ndarray]:
    states, parameters = np.zeros(n, STATE).view(np.recarray), np.zeros(1, PARAMETERS).view(np.recarray)
    states["seed"], states["altitude"] = np.arange(n) + 3, altitude
    parameters["span"], parameters["tail_arm"], parameters["turbulence_sigma_w"] = SPAN, ARM, 1.0
    for name, value in {"turbulence_rotation": 1.0, **values}.items():
        parameters[name] = value
    return states, parameters


def history(n: int, dt: float, altitude: float = 2000.0, **values: float) -> dict[str, np.ndarray]:
    states, parameters = setting(altitude=altitude, **values)
    start(states, parameters, V)
    out = np.empty((n, 7))
    fly(states, parameters, V, dt, out)
    return dict(zip(GUSTS, out.T, strict=True))


def filters(states: np.ndarray) -> np.ndarray:
    return np.array([states[name] for name in STATE.names if name.startswith(("dryden_", "gust_"))])


@pytest.mark.parametrize("dt", [0.02, 0.5, 20.0])
@pytest.mark.parametrize("altitude", [150.0, 2000.0])
def test_variance_is_the_stated_one_at_any_step(dt: float, altitude: float) -> None:
    states, parameters = setting(20_000, altitude)
    start(states, parameters, V)
    one_row = np.empty((1, 7))
    gusts = np.empty((states.size, 7))
    for i in range(states.size):  # one step each, from the stationary start
        fly(states[i : i + 1], parameters, V, dt, one_row)
        gusts[i] = one_row
    ratio = (0.177 + 0.000823 * altitude / 0.3048) ** -0.4 if altitude < 304.8 else 1.0
    assert np.allclose(gusts[:, :3].std(axis=0), [ratio, ratio, 1.0], rtol=0.025)
    length = turbulence.scales(altitude)[1]
    expected_p = math.sqrt(0.8 * (math.pi * length / (4 * SPAN)) ** (1 / 3) * math.pi**2 / (8 * SPAN * length))
    assert gusts[:, 3].std() == pytest.approx(expected_p, rel=0.025)


@pytest.mark.parametrize("rotation", [0.0, 1.0])
@pytest.mark.parametrize("delay", [0.0, 1.0])
def test_start_is_stationary(delay: float, rotation: float) -> None:
    states, parameters = setting(20_000, turbulence_tail_delay=delay, turbulence_rotation=rotation)
    start(states, parameters, V)
    before = np.cov(filters(states))
    out = np.empty((25, 7))
    for i in range(states.size):
        fly(states[i : i + 1], parameters, V, 0.02, out)
    after = np.cov(filters(states))
    scale = np.sqrt(np.outer(np.diag(after), np.diag(after))) + 1e-30
    assert np.abs((after - before) / scale).max() < 0.04


def dryden(f: np.ndarray) -> dict[str, np.ndarray]:
    """One-sided spectra per Hz of MIL-F-8785C for sigma_w 1 m/s above 2000 ft."""
    w, length = 2 * math.pi * f, 533.4
    t = length / V
    u = 2 * t / math.pi / (1 + (t * w) ** 2)
    vw = t / math.pi * (1 + 3 * (t * w) ** 2) / (1 + (t * w) ** 2) ** 2
    roll = 0.8 * (math.pi * length / (4 * SPAN)) ** (1 / 3) / (V * length) / (1 + (4 * SPAN * w / (math.pi * V)) ** 2)
    pitch = (w / V) ** 2 / (1 + (4 * SPAN * w / (math.pi * V)) ** 2) * vw
    yaw = (w / V) ** 2 / (1 + (3 * SPAN * w / (math.pi * V)) ** 2) * vw
    per_rad = {"gust_u": u, "gust_v": vw, "gust_w": vw, "gust_p": roll, "gust_q": pitch, "gust_r": yaw}
    return {name: 2 * math.pi * value for name, value in per_rad.items()}


@pytest.mark.parametrize("name", GUSTS[:6])
def test_spectrum(name: str) -> None:
    gusts = history(500_000, 0.02)
    f, measured = signal.welch(gusts[name], fs=50.0, nperseg=8192, window="hann")
    expected = dryden(f)[name]
    for low, high in ((0.03, 0.1), (0.1, 0.5), (0.5, 2.0), (2.0, 5.0)):
        band = (f >= low) & (f < high)
        assert measured[band].mean() == pytest.approx(expected[band].mean(), rel=0.12), (low, high)


def test_correlation_length_of_u() -> None:
    gust = history(1_000_000, 0.1)["gust_u"]
    lag = round(533.4 / V / 0.1)  # one scale length
    assert np.mean(gust[lag:] * gust[:-lag]) / gust.var() == pytest.approx(math.exp(-1.0), abs=0.04)


def test_pitching_and_yawing_air_follow_the_path_derivative() -> None:
    gusts = history(20_000, 0.02)
    for rotation, along, sign in (("gust_q", "gust_w", -1.0), ("gust_r", "gust_v", 1.0)):
        slope = np.gradient(gusts[along], 0.02) / V
        kernel_s = 4 * SPAN / (math.pi * V) * (1.0 if rotation == "gust_q" else 0.75)
        lagged = signal.lfilter([1 - math.exp(-0.02 / kernel_s)], [1, -math.exp(-0.02 / kernel_s)], slope)
        assert np.corrcoef(lagged[100:], sign * gusts[rotation][100:])[0, 1] > 0.95


def test_tail_meets_the_gust_later_and_no_weaker() -> None:
    gusts = history(400_000, 0.01, turbulence_tail_delay=1.0, turbulence_rotation=0.0)
    tail, wing = gusts["gust_w_tail"], gusts["gust_w"]
    assert tail.std() == pytest.approx(wing.std(), rel=0.01)
    low = signal.butter(4, 1.0, fs=100.0, output="sos")
    a, b = signal.sosfiltfilt(low, wing)[1000:-1000], signal.sosfiltfilt(low, tail)[1000:-1000]
    shifts = range(30)
    best = max(shifts, key=lambda k: float(np.mean(a[: a.size - k] * b[k:])))
    assert best * 0.01 == pytest.approx(ARM / V, abs=0.011)
    assert not gusts["gust_p"].any()
    assert not gusts["gust_q"].any()
    assert not gusts["gust_r"].any()


@pytest.mark.parametrize("rotation", [0.0, 1.0])
def test_the_tail_meets_the_gust_at_once_without_a_delay(rotation: float) -> None:
    gusts = history(100, 0.02, turbulence_tail_delay=0.0, turbulence_rotation=rotation)
    assert np.array_equal(gusts["gust_w_tail"], gusts["gust_w"])
    assert all(gusts[name].any() == (rotation > 0.0) for name in ("gust_p", "gust_q", "gust_r"))


def test_the_delay_takes_the_place_of_the_pitching_gust_alone() -> None:
    """Both would count the same variation along the aircraft twice; rolling and yawing gusts are as without it."""
    delayed, turning = (history(100, 0.02, turbulence_tail_delay=delay) for delay in (1.0, 0.0))
    assert not delayed["gust_q"].any() and turning["gust_q"].any()
    assert all(np.array_equal(delayed[name], turning[name]) for name in ("gust_p", "gust_r", "gust_u", "gust_w"))


@pytest.mark.parametrize("delay", [0.0, 1.0])
def test_calm_air_is_exactly_zero(delay: float) -> None:
    gusts = history(50, 0.02, turbulence_sigma_w=0.0, turbulence_tail_delay=delay)
    assert not any(values.any() for values in gusts.values())


def test_low_altitude_scales_join_the_high_ones() -> None:
    foot = 0.3048
    assert turbulence.scales(1000 * foot) == pytest.approx((1000 * foot, 1000 * foot, 1.0))
    assert turbulence.scales(999.999 * foot) == pytest.approx((1000 * foot, 1000 * foot, 1.0), rel=1e-5)
    assert turbulence.scales(2000 * foot) == pytest.approx((1750 * foot, 1750 * foot, 1.0))
    assert turbulence.scales(9000 * foot) == turbulence.scales(2000 * foot)
    assert turbulence.scales(0.0)[1] > 0.0


def test_discrete_gust_has_its_shape() -> None:
    values = {"gust_start_time": 1.0, "gust_length": 36.0, "gust_amplitude_w": 5.0, "gust_amplitude_v": -2.0}
    gusts = history(150, 0.02, turbulence_sigma_w=0.0, turbulence_tail_delay=1.0, **values)
    time = np.arange(1, 151) * 0.02  # the end of each step
    path = V * (time - 1.0)
    shape = np.where((path > 0) & (path < 72.0), 0.5 * (1 - np.cos(math.pi * path / 36.0)), 0.0)
    assert np.allclose(gusts["gust_w"], 5.0 * shape)
    assert np.allclose(gusts["gust_v"], -2.0 * shape)
    assert abs(np.argmax(gusts["gust_w_tail"]) - np.argmax(gusts["gust_w"])) * 0.02 == pytest.approx(ARM / V, abs=0.03)


def test_turbulence_scales_with_its_intensity() -> None:
    one, two = history(500, 0.02), history(500, 0.02, turbulence_sigma_w=2.0)
    for name in GUSTS:
        assert np.allclose(2.0 * one[name], two[name], rtol=1e-12)


def test_wind_shear() -> None:
    p = np.zeros(1, structured(WIND_PARAMETERS)).view(np.recarray)
    p["wind_north"], p["wind_down"], p["wind_east_shear"], p["wind_reference_altitude"] = 5.0, -0.5, 0.01, 1000.0
    assert wind(1000.0, p[0]) == (5.0, 0.0, -0.5)
    assert wind(1200.0, p[0]) == pytest.approx((5.0, 2.0, -0.5))
