"""Equation error against the textbook's printed values, against known derivatives, and its statistics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flights import LATERAL, META, PITCH, V, flight_data, lateral, longitudinal
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.regression.equation_error import identify
from estimators.regression.least_squares import least_squares
from estimators.signals.coefficients import Airframe, airframe_of
from estimators.signals.data_checks import check
from estimators.signals.differentiate import low_pass, matched_kernel, slope, smooth
from estimators.signals.gust_level import gust_level
from estimators.signals.resample import common_grid
from icing_env import scenario as scenarios
from icing_env.errors import InputError
from icing_env.record import read
from testbed.flight import fly

# Klein & Morelli, Aircraft System Identification (AIAA 2006), examples 5.1 and 5.2 as SIDPAC prints them: value,
# standard error corrected for coloured residuals, decimals of each.
BOOK_LATERAL = {
    "CY_beta": (-0.8451, 0.0074, 4, 4), "CY_r": (0.9631, 0.0553, 4, 4), "CY_rudder": (0.3426, 0.0289, 4, 4),
    "Cl_beta": (-0.1051, 0.0025, 4, 4), "Cl_p": (-0.5283, 0.0099, 4, 4), "Cl_r": (0.1926, 0.0083, 4, 4),
    "Cl_aileron": (-0.2117, 0.0034, 4, 4), "Cl_rudder": (0.0299, 0.0039, 4, 4),
    "Cn_beta": (0.08544, 0.00116, 5, 5), "Cn_p": (-0.05151, 0.0040, 5, 4), "Cn_r": (-0.19758, 0.0037, 5, 4),
    "Cn_aileron": (0.00234, 0.0013, 5, 4), "Cn_rudder": (-0.13054, 0.0019, 5, 4),
}  # fmt: skip
# SIDPAC's demonstration on the longitudinal record 13 Feb 2002 #18.
BOOK_PITCH = {
    "CZ_alpha": (-6.349, 0.020, 3, 3), "CZ_q": (-18.41, 0.55, 2, 2), "CZ_elevator": (-0.626, 0.015, 3, 3),
    "Cm_alpha": (-1.4762, 0.022, 4, 3), "Cm_q": (-36.35, 0.69, 2, 2), "Cm_elevator": (-1.8688, 0.020, 4, 3),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "book"), [("totter_f1_017_data.mat", BOOK_LATERAL), ("totter_demo_data.mat", BOOK_PITCH)]
)
def test_textbook_mode_prints_the_textbook_values(name: str, book: dict[str, tuple[float, float, int, int]]) -> None:
    found = identify(read(flight_data(name)), "textbook")
    for key, (value, error, digits, error_digits) in book.items():
        assert abs(found[key].estimate - value) <= 0.51 * 10**-digits, key
        assert abs(found[key].std_error - error) <= 0.51 * 10**-error_digits, key


def test_textbook_fit_quality() -> None:
    found = identify(read(flight_data("totter_f1_017_data.mat")), "textbook")
    assert [round(found[key].r2, 4) for key in ("CY_beta", "Cl_beta", "Cn_beta")] == [0.9907, 0.9551, 0.9962]
    assert round(found["Cn_0"].estimate, 5) == 0.00046


def test_textbook_lift_without_pitch_rate() -> None:
    record = read(flight_data("totter_demo_data.mat"))
    mass, area = record["mass"], record.meta.geometry.wing_area
    target = mass * record["az"] / (record["qbar"] * area)
    fit = least_squares(np.column_stack([record["alpha"], record["elevator"], np.ones(len(record))]), target)
    assert abs(fit.theta[0] + 6.604) <= 0.0005 and abs(fit.theta[1] + 0.193) <= 0.0005
    assert abs(fit.std_error[0] - 0.097) <= 0.0005 and abs(fit.std_error[1] - 0.062) <= 0.0005


def test_textbook_lift_at_zero_is_of_the_stored_column() -> None:
    record = read(flight_data("totter_demo_data.mat"))
    regressors = np.column_stack([record["alpha"], record["q_hat"], record["elevator"], np.ones(len(record))])
    assert round(float(least_squares(regressors, record["CZ"]).theta[-1]), 3) == -0.448


def test_matched_filters_on_flight_agree_with_independent_figures() -> None:
    """Figures found independently by matched filters on the raw channels; the book's are 5 to 8 % smaller."""
    pitch = identify(read(flight_data("totter_pred_data.mat")))
    roll = identify(read(flight_data("totter_f1_017_data.mat")))
    assert pitch["Cm_q"].estimate == pytest.approx(-38.21, rel=0.01)
    assert roll["Cl_p"].estimate == pytest.approx(-0.573, rel=0.01)
    assert roll["Cl_beta"].estimate == pytest.approx(-0.1136, rel=0.01)


def test_only_what_was_excited_is_reported_as_identified() -> None:
    pitch = identify(read(flight_data("totter_demo_data.mat")))
    turn = identify(read(flight_data("totter_f1_017_data.mat")))
    assert pitch["CL_alpha"].identifiable and pitch["CD_0"].identifiable and not pitch["Cn_beta"].identifiable
    assert turn["Cn_beta"].identifiable and not turn["Cm_alpha"].identifiable
    assert "no longitudinal manoeuvre" in turn["Cm_alpha"].why
    assert not turn["Cn_aileron"].identifiable and "a third" in turn["Cn_aileron"].why


def test_noise_free_derivatives_are_recovered() -> None:
    found = {**identify(longitudinal()), **identify(lateral())}
    for name, truth in {**PITCH, **LATERAL}.items():
        assert found[name].estimate == pytest.approx(truth, rel=0.01, abs=1e-3), name


def test_noisy_derivatives_lie_within_their_errors() -> None:
    scores = []
    for seed in range(6):
        found = {**identify(longitudinal(seed)), **identify(lateral(seed))}
        names = [n for n in (*PITCH, *LATERAL) if found[n].identifiable]
        scores += [(found[n].estimate - {**PITCH, **LATERAL}[n]) / found[n].std_error for n in names]
    assert len(scores) > 120 and np.mean(np.abs(scores) < 1.96) > 0.86 and np.max(np.abs(scores)) < 4.5


def test_unmatched_regressors_shrink_damping_and_matched_do_not() -> None:
    record, half = longitudinal(), 5
    z = slope(record["q"], record.dt, half)[half:-half]
    chord, columns = META.geometry.chord, [record["alpha"], record["q"], record["elevator"]]
    raw = np.column_stack([*(c[half:-half] for c in columns), np.ones(len(z))])
    matched = np.column_stack([*(smooth(c, half)[half:-half] for c in columns), np.ones(len(z))])
    truth = PITCH["Cm_q"] * chord / (2 * V) * 0.5 * 1.03 * V**2 * 39.25 * chord / META.inertia[1]
    assert least_squares(matched, z).theta[1] == pytest.approx(truth, rel=0.005)
    assert abs(least_squares(raw, z).theta[1]) < 0.9 * abs(truth)


def test_slow_and_missing_samples_are_interpolated_and_said() -> None:
    record = longitudinal()
    airspeed, q = record["airspeed"].copy(), record["q"].copy()
    airspeed[np.arange(len(record)) % 50 != 0] = np.nan
    q[200:250] = np.nan
    worn = check(replace(record, channels={**record.channels, "airspeed": airspeed, "q": q}))
    kinds = {(p.channel, p.kind.split(",")[-1].strip()) for p in worn.problems}
    assert {("airspeed", "interpolated"), ("q", "left out")} <= kinds
    found = identify(worn)
    for name in ("Cm_alpha", "Cm_q", "CL_alpha"):
        assert found[name].estimate == pytest.approx(PITCH[name], rel=0.02)


def test_a_record_without_thrust_gives_no_drag() -> None:
    record = longitudinal()
    channels = {k: v for k, v in record.channels.items() if not k.startswith("thrust")}
    found = identify(replace(record, channels=channels))
    assert not found["CD_0"].identifiable and "thrust" in found["CD_0"].why
    assert found["Cm_alpha"].identifiable


def test_what_is_lacking_is_named() -> None:
    record = longitudinal()
    with pytest.raises(InputError, match="longitudinal needs az; lateral needs beta, p, r, ay, aileron, rudder"):
        identify(replace(record, channels={k: v for k, v in record.channels.items() if k != "az"}))
    with pytest.raises(InputError, match="states no mass"):
        airframe_of(replace(record, meta=replace(META, mass=None)))
    with pytest.raises(InputError, match="mode 'book' is unknown"):
        identify(record, "book")
    with pytest.raises(InputError, match="stores no p_dot"):
        identify(record, "textbook")


def test_a_silent_record_takes_the_default_airframe() -> None:
    record, names = longitudinal(), ("mass", "inertia_xx", "inertia_yy", "inertia_zz", "inertia_xz")
    fields = [(name, "f8") for name in (*names, "wing_area", "span", "chord")]
    row = np.array([(META.mass, *META.inertia, 39.25, 19.81, 1.98)], dtype=fields)
    silent = replace(record, meta=replace(META, mass=None, inertia=None, geometry=None))
    for default in (row, row[0]):
        assert identify(silent, default=Airframe.from_parameters(default)) == identify(record)


def test_coloured_covariance_equals_its_double_sum() -> None:
    rng = np.random.default_rng(1)
    x, z = rng.standard_normal((40, 3)), rng.standard_normal(40)
    fit, lags = least_squares(x, z, lags=7), range(-7, 8)
    v = fit.residual
    r = {k: float(np.sum(v[: 40 - abs(k)] * v[abs(k) :])) / 40 for k in lags}
    middle = sum(np.outer(x[i], x[j]) * r[i - j] for i in range(40) for j in range(40) if i - j in r)
    inverse = np.linalg.inv(x.T @ x)
    np.testing.assert_allclose(fit.covariance, inverse @ middle @ inverse, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(fit.covariance_white, inverse * (v @ v) / 37, rtol=1e-9)


def test_coloured_errors_match_the_scatter_and_white_ones_do_not() -> None:
    rng, n = np.random.default_rng(2), 500
    x = np.column_stack([np.sin(np.arange(n) / 25.0), np.ones(n)])
    found = []
    for _ in range(150):
        noise = np.convolve(rng.standard_normal(n + 30), np.exp(-np.arange(31) / 6.0), mode="valid")
        fit = least_squares(x, 2.0 * x[:, 0] + noise)
        found.append((fit.theta[0], fit.std_error[0], np.sqrt(fit.covariance_white[0, 0])))
    theta, coloured, white = np.array(found).T
    assert 0.7 < np.median(coloured) / np.std(theta) < 1.3
    assert np.median(white) < 0.5 * np.std(theta)


def test_faded_errors_hold_for_a_bias_too_and_are_never_below_the_white_ones() -> None:
    rng, n, found = np.random.default_rng(7), 600, []
    x = np.column_stack([np.sin(np.arange(n) / 25.0), np.ones(n)])
    for _ in range(150):
        noise = np.convolve(rng.standard_normal(n + 20), np.exp(-np.arange(21) / 4.0), mode="valid")
        target = 2.0 * x[:, 0] + 1.0 + noise
        faded, whole = least_squares(x, target, fade=True), least_squares(x, target)
        assert (np.diag(faded.covariance) >= np.diag(faded.covariance_white) * (1 - 1e-12)).all()
        found.append((faded.theta[1], faded.std_error[1], whole.std_error[1]))
    theta, few, every = np.array(found).T
    assert 0.8 < np.median(few) / np.std(theta) < 1.2
    assert np.median(every) < 0.7 * np.std(theta)


@settings(max_examples=30)
@given(st.integers(2, 12), st.floats(-3, 3), st.floats(-3, 3))
def test_slope_filter_is_exact_on_parabolas_and_matched_smoother_has_unit_area(half: int, a: float, b: float) -> None:
    t = np.arange(60) * 0.02
    inside = slice(half, -half)
    np.testing.assert_allclose(slope(a * t + b * t**2, 0.02, half)[inside], (a + 2 * b * t)[inside], atol=1e-9)
    assert matched_kernel(half).sum() == pytest.approx(1.0)
    np.testing.assert_allclose(smooth(a + b * t, half)[inside], (a + b * t)[inside], atol=1e-9)


def test_low_pass_keeps_phase_and_removes_the_boom() -> None:
    t = np.arange(0, 10, 0.02)
    slow, boom = np.sin(2 * np.pi * 0.5 * t), np.sin(2 * np.pi * 20.0 * t)
    out = low_pass(slow + boom, 0.02)
    assert np.max(np.abs(out - slow)[50:-50]) < 0.1
    with pytest.raises(InputError, match="10 Hz"):
        low_pass(slow, 0.1)


@pytest.mark.parametrize(
    ("mode", "half", "damping", "power"),  # biases of Cm_q and Cm_elevator: derived for a short period of 3.6 rad/s
    [("unmatched", 5, -0.20, -0.13), ("unmatched_smoothed", 5, -0.15, -0.10), ("matched", 5, 0.0, 0.0),
     ("unmatched", 8, -0.37, -0.24), ("fourier", None, 0.0, 0.0)],
)  # fmt: skip
def test_filters_that_do_not_match_shrink_damping_and_elevator_power(
    mode: str, half: int | None, damping: float, power: float
) -> None:
    found = identify(longitudinal(), mode, half=half)
    for name, bias in (("Cm_q", damping), ("Cm_elevator", power)):
        assert found[name].estimate / PITCH[name] - 1.0 == pytest.approx(bias, abs=0.02 + 0.4 * abs(bias)), name


def test_gusts_are_measured_in_any_record_and_warned_of() -> None:
    for sigma in (0.0, 0.5, 1.0, 2.0):
        scenario = scenarios.load("clear_air", aircraft="twin_otter_flight", duration=29.0,
                                  parameters={"turbulence_sigma_w": sigma})  # fmt: skip
        record = fly(scenario, seed=2, observer=False, protection=False).record
        record = record.take(record.time >= 8.0)
        found = gust_level(common_grid(record))
        for level in found.values():
            assert level == pytest.approx(sigma, rel=0.4, abs=0.15)
        assert ("turbulence of about" in identify(record)["Cm_alpha"].warning) == (sigma > 0.6 or found["w"] > 0.35)
    for name in ("totter_demo_data.mat", "totter_pred_data.mat", "totter_f1_017_data.mat"):
        assert not any(e.warning for e in identify(read(flight_data(name))).values())
