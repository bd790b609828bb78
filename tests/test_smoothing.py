"""Optimal Fourier smoothing: exact on what it is exact on, better than what it replaces, honest about the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flights import longitudinal
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.signals.boom_filter import without_boom
from estimators.signals.differentiate import low_pass, slope
from estimators.signals.fourier_smoothing import fourier_smooth, smooth_together
from icing_env.errors import InputError

DT = 0.02


def doublet_response(n: int = 1001) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A damped oscillation after a smooth start, with its derivative."""
    t = np.arange(n) * DT
    lag = t - 3.0
    on = lag > 0
    value = np.where(on, lag**2 * np.exp(-1.5 * np.maximum(lag, 0)) * np.sin(3.0 * lag), 0.0)
    rate = np.where(on, np.exp(-1.5 * np.maximum(lag, 0)) * (
        (2 * lag - 1.5 * lag**2) * np.sin(3 * lag) + 3 * lag**2 * np.cos(3 * lag)), 0.0)  # fmt: skip
    return t, value, rate


@settings(max_examples=30)
@given(st.floats(-5, 5), st.floats(-5, 5), st.integers(16, 300))
def test_a_straight_line_passes_unchanged(a: float, b: float, n: int) -> None:
    t = np.arange(n) * DT
    found = fourier_smooth(a + b * t, DT)
    np.testing.assert_allclose(found.value, a + b * t, atol=1e-8)
    np.testing.assert_allclose(found.rate, b, atol=1e-7)
    assert found.noise < 1e-8


def test_a_clean_signal_is_kept_and_differentiated() -> None:
    _, value, rate = doublet_response()
    found = fourier_smooth(value, DT)
    assert np.max(np.abs(found.value - value)) < 1e-3 * np.max(np.abs(value))
    assert np.sqrt(np.mean((found.rate - rate) ** 2)) < 5e-3 * np.std(rate)


@pytest.mark.parametrize("noise", [0.003, 0.01, 0.03])
def test_noise_is_measured_and_removed(noise: float) -> None:
    _, value, rate = doublet_response()
    for seed in range(5):
        measured = value + noise * np.random.default_rng(seed).standard_normal(len(value))
        found = fourier_smooth(measured, DT)
        assert found.noise == pytest.approx(noise, rel=0.2)
        inside = slice(5, -5)
        local = slope(measured, DT, 5)
        assert np.std((found.value - value)[inside]) < 0.5 * noise
        assert np.std((found.rate - rate)[inside]) < 0.75 * np.std((local - rate)[inside])


def test_more_noise_is_cut_lower() -> None:
    _, value, _ = doublet_response()
    noise = np.random.default_rng(1).standard_normal(len(value))
    cuts = [fourier_smooth(value + size * noise, DT).cutoff for size in (1e-4, 1e-3, 1e-2, 1e-1)]
    assert cuts == sorted(cuts, reverse=True) and cuts[0] > 1.5 * cuts[-1]


def test_together_all_are_cut_alike() -> None:
    record = longitudinal(3)
    found = smooth_together({name: record[name] for name in ("alpha", "q", "elevator")}, DT)
    assert len({smoothed.cutoff for smoothed in found.values()}) == 1
    alone = max(fourier_smooth(record[name], DT).cutoff for name in ("alpha", "q", "elevator"))
    assert found["q"].cutoff == alone


def test_smoothing_is_linear_once_the_cut_is_given() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.standard_normal((2, 200))
    sum_of, alone = fourier_smooth(2 * a - 3 * b, DT, 4.0), [fourier_smooth(x, DT, 4.0) for x in (a, b)]
    np.testing.assert_allclose(sum_of.rate, 2 * alone[0].rate - 3 * alone[1].rate, atol=1e-9)


def test_what_cannot_be_smoothed_is_refused() -> None:
    with pytest.raises(InputError, match="at least 16"):
        fourier_smooth(np.zeros(5), DT)
    with pytest.raises(InputError, match="1 of them missing"):
        fourier_smooth(np.where(np.arange(50) == 7, np.nan, 0.0), DT)


def test_the_ten_hertz_filter_treats_every_channel_alike() -> None:
    """At 10 Hz half the amplitude is left after both passes; the boom's 7 Hz lies below and loses only a fifth."""
    t = np.arange(0, 20, DT)
    gain = {f: np.std(low_pass(np.sin(2 * np.pi * f * t), DT)[100:-100]) * np.sqrt(2) for f in (1.0, 7.0, 10.0, 20.0)}
    assert gain[1.0] == pytest.approx(1.0, abs=1e-3)
    assert gain[10.0] == pytest.approx(0.5, abs=0.02)
    assert 0.7 < gain[7.0] < 0.9 and gain[20.0] < 0.01


def test_without_the_boom_every_fast_channel_is_filtered_and_gaps_stay() -> None:
    record = longitudinal(4)
    alpha = record["alpha"] + 0.02 * np.sin(2 * np.pi * 18.0 * record.time)
    alpha[100:140] = np.nan
    found = without_boom(replace(record, channels={**record.channels, "alpha": alpha}))
    clean = low_pass(record["alpha"], DT)
    far = np.r_[20:80, 170:580]
    assert np.max(np.abs(found["alpha"] - clean)[far]) < 1e-3 and np.isnan(found["alpha"][110:130]).all()
    np.testing.assert_allclose(found["elevator"], low_pass(record["elevator"], DT), atol=1e-12)
    np.testing.assert_array_equal(found["airspeed"], record["airspeed"])
