"""Cloud along the track: the envelopes' nodes, never outside them, lengths, shares, prescribed values."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from icing_env import atmosphere, cloud
from icing_env.jit import kernel
from icing_env.types import STATE, structured

PARAMETERS = structured(cloud.CLOUD_PARAMETERS)
MODES = (cloud.CONTINUOUS_MAXIMUM, cloud.INTERMITTENT_MAXIMUM, cloud.LARGE_DROPS)
NMI = 1852.0


@kernel
def fly(states, parameters, airspeed, dt, out):
    s, p = states[0], parameters[0]
    for i in range(out.shape[0]):
        cloud.advance_cloud(s, p, airspeed, dt)
        s.step += 1
        out[i] = s.lwc, s.mvd, s.temperature, s.cloud_left, s.cloud_lwc_mean


def setting(mode: int, altitude: float = 2500.0, seed: int = 1, **values: float) -> tuple[np.ndarray, np.ndarray]:
    states, parameters = np.zeros(1, STATE).view(np.recarray), np.zeros(1, PARAMETERS).view(np.recarray)
    states["altitude"], states["seed"] = altitude, seed
    defaults = {
        "cloud_mode": mode, "temperature_offset": -8.0, "cloud_length_mean": 5000.0, "cloud_gap_mean": 3000.0,
        "cloud_lwc_share_low": 0.2, "cloud_lwc_share_high": 1.0, "cloud_mvd_low": 15e-6, "cloud_mvd_high": 40e-6,
        "cloud_noise_std": 0.3, "cloud_noise_length": 1000.0,
    }  # fmt: skip
    for name, value in (defaults | values).items():
        parameters[name] = value
    return states, parameters


def history(mode: int, n: int, dt: float = 1.0, **values: float) -> np.ndarray:
    states, parameters = setting(mode, **values)
    out = np.empty((n, 5))
    fly(states, parameters, 72.0, dt, out)
    return out


@pytest.mark.parametrize(
    ("mode", "mvd", "celsius", "grams"),
    [  # 14 CFR 25 Appendix C figures 1 and 4
        (1, 15, 0, 0.80), (1, 25, 0, 0.50), (1, 40, 0, 0.155), (1, 15, -10, 0.60), (1, 40, -30, 0.04),
        (1, 20, -20, 0.21),
        (2, 20, 0, 2.5), (2, 20, -30, 1.0), (2, 30, -10, 1.0), (2, 50, 0, 0.4), (2, 50, -30, 0.1), (2, 20, -40, 0.2),
    ],
)  # fmt: skip
def test_envelope_nodes(mode: int, mvd: float, celsius: float, grams: float) -> None:
    assert cloud.largest_content(mode, mvd * 1e-6, 273.15 + celsius) == pytest.approx(1e-3 * grams, rel=1e-9)


def test_flight_010302f1_lies_at_half_the_envelope() -> None:
    largest = cloud.largest_content(cloud.CONTINUOUS_MAXIMUM, 18e-6, 268.15)
    assert 0.3e-3 / largest == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(
    ("mode", "miles", "factor"),
    [(1, 5.0, 1.34), (1, 17.4, 1.0), (1, 310.0, 0.2), (2, 0.26, 1.35), (2, 2.6, 1.0), (2, 5.2, 0.85)],
)
def test_extent_factor(mode: int, miles: float, factor: float) -> None:
    assert cloud.extent_factor(mode, miles * NMI) == pytest.approx(factor, rel=1e-6)


def test_extent_factor_is_straight_in_the_logarithm() -> None:
    middle = math.sqrt(17.4 * 310.0) * NMI
    assert cloud.extent_factor(cloud.CONTINUOUS_MAXIMUM, middle) == pytest.approx(0.6)


@settings(max_examples=60)
@given(
    mode=st.sampled_from(MODES),
    altitude=st.floats(0.0, 9000.0),
    offset=st.floats(-35.0, 25.0),
    seed=st.integers(0, 2**62),
    mvd_low=st.floats(0.0, 1e-4),
    mvd_high=st.floats(0.0, 1e-4),
)
def test_never_outside_the_envelope(mode, altitude, offset, seed, mvd_low, mvd_high) -> None:
    values = {"temperature_offset": offset, "cloud_mvd_low": mvd_low, "cloud_mvd_high": mvd_high}
    lwc, mvd, temperature, left, _ = history(mode, 300, altitude=altitude, seed=seed, **values).T
    assert np.allclose(temperature, atmosphere.temperature(altitude) + offset)
    assert (lwc >= 0.0).all()
    assert not lwc[left < 0.0].any()
    top = {1: 40e-6, 2: 50e-6, 3: 200e-6}[mode]
    bottom = 100e-6 if mode == cloud.LARGE_DROPS else 15e-6
    inside = left > 0.0
    assert ((mvd[inside] >= bottom - 1e-12) & (mvd[inside] <= top + 1e-12)).all()
    if temperature[0] >= 273.15 or altitude > 22000 * 0.3048:
        assert not lwc.any()
    factor = {1: 1.34, 2: 1.35, 3: 1.0}[mode]
    for content, size, t in zip(lwc, mvd, temperature, strict=True):
        if content > 0.0:
            assert content <= factor * cloud.largest_content(mode, size, t) * (1 + 1e-12)
            assert t >= {1: 243.15, 2: 233.15, 3: 248.15}[mode]


def test_mean_content_of_a_cloud_respects_its_extent() -> None:
    out = history(cloud.CONTINUOUS_MAXIMUM, 40_000, cloud_length_mean=60_000.0)
    begins = np.flatnonzero((out[1:, 3] > 0) & (out[:-1, 3] < 0)) + 1
    assert begins.size > 20
    for i in begins:
        largest = cloud.largest_content(1, out[i, 1], out[i, 2])
        assert out[i, 4] <= cloud.extent_factor(1, out[i, 3]) * largest * (1 + 1e-9)


def test_clouds_and_gaps_have_their_mean_lengths() -> None:
    states, parameters = setting(cloud.CONTINUOUS_MAXIMUM)
    out = np.empty((200_000, 5))
    fly(states, parameters, 10.0, 1.0, out)
    left = out[:, 3]
    changes = np.flatnonzero(np.sign(left[1:]) != np.sign(left[:-1])) + 1
    lengths = left[changes]
    assert lengths[lengths > 0].mean() == pytest.approx(5000.0, rel=0.2)
    assert -lengths[lengths < 0].mean() == pytest.approx(3000.0, rel=0.2)
    assert (out[:, 0] > 0).mean() == pytest.approx(5 / 8, abs=0.08)


def test_a_cloud_without_gaps_goes_on() -> None:
    out = history(cloud.CONTINUOUS_MAXIMUM, 2000, cloud_gap_mean=0.0, cloud_noise_std=0.0)
    assert (out[:, 0] > 0.0).all()


def test_fluctuation_has_its_size_and_the_mean_is_kept() -> None:
    values = {"cloud_length_mean": 1e9, "cloud_gap_mean": 0.0, "cloud_lwc_share_low": 0.1, "cloud_lwc_share_high": 0.1}
    out = history(cloud.CONTINUOUS_MAXIMUM, 100_000, cloud_noise_std=0.2, **values)
    assert out[:, 0].mean() / out[0, 4] == pytest.approx(1.0, abs=0.03)
    assert out[:, 0].std() / out[0, 4] == pytest.approx(0.2, rel=0.1)


def test_flight_begins_in_a_gap_that_was_asked_for() -> None:
    states, parameters = setting(cloud.CONTINUOUS_MAXIMUM)
    states["cloud_left"] = -720.0
    out = np.empty((20, 5))
    fly(states, parameters, 72.0, 1.0, out)
    assert not out[:9, 0].any()
    assert (out[10:, 3] > 0).all()


def test_prescribed_values_are_held_and_no_cloud_is_dry() -> None:
    states, parameters = setting(cloud.PRESCRIBED)
    states["lwc"], states["mvd"], states["temperature"] = 3e-4, 18e-6, 268.15
    out = np.empty((5, 5))
    fly(states, parameters, 72.0, 1.0, out)
    assert (out[:, :3] == [3e-4, 18e-6, 268.15]).all()
    parameters["cloud_mode"] = cloud.NONE
    fly(states, parameters, 72.0, 1.0, out)
    assert not out[:, :2].any()


def test_weather_files_use_only_known_names() -> None:
    folder = Path(__file__).parents[1] / "configs/weather"
    for path in folder.glob("*.toml"):
        text = path.read_text()
        for line in text.split("[cloud]")[-1].splitlines():
            if "=" in line and "value" in line:
                assert line.split(" = ")[0] in PARAMETERS.names, path.name
