"""The recursive H-infinity identifier against theory, an independent Kalman filter, and an independent aircraft."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from small_aircraft import fly, noisy

from estimators import hinf
from estimators.airframe import airframe_from, published_airframe
from estimators.hinf.channel import learn
from estimators.hinf.tuning import default_tuning, tuning_from
from estimators.observer.layout import DIAGONAL, FIRST, PACKED, PARAMETER_NAMES, clean_values
from icing_env.configuration import folder
from icing_env.errors import InputError
from icing_env.types import ESTIMATE, ESTIMATED_NAMES

DT = 0.02
PITCH, ROLL = slice(FIRST[2], FIRST[2] + 4), slice(FIRST[4], FIRST[4] + 6)


@cache
def flight() -> np.ndarray:
    """Twenty seconds of doublets on all surfaces, free of error, by the tests' own aircraft."""
    return fly(published_airframe(), 20.0, DT)


def always_on(gamma: float = np.inf, k0: float = 0.0) -> np.ndarray:
    """Tuning without the excitation gate."""
    tuning = default_tuning()
    tuning["gamma"], tuning["k0"], tuning["share_high"] = gamma, k0, 0.0
    return tuning


def run(measurement: np.ndarray, tuning: np.ndarray, start: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Estimates (N,), memory (N,), and the observer at the end."""
    airframe = published_airframe()
    observer, now = hinf.init(airframe, tuning, 1, start), np.zeros(1, ESTIMATE)
    estimates, memory = np.zeros(len(measurement), ESTIMATE), np.zeros(len(measurement), hinf.OBSERVER)
    for k in range(len(measurement)):
        hinf.step(observer, now, measurement[k : k + 1], airframe, tuning, DT)
        estimates[k], memory[k] = now[0], observer[0]
    return estimates, memory, observer


def covariance(packed: np.ndarray, channel: int, m: int) -> np.ndarray:
    """B3 of one channel as a matrix."""
    out = np.zeros((m, m))
    out[np.tril_indices(m)] = packed[PACKED[channel] : PACKED[channel] + m * (m + 1) // 2]
    return out + np.tril(out, -1).T


@pytest.mark.parametrize(("channel", "part"), [(2, PITCH), (4, ROLL)])
def test_gamma_infinite_is_a_kalman_filter(channel: int, part: slice) -> None:
    """Discrete Kalman filter of the state and the parameters, process d^2 h, measurement n^2/h, S1 at rest."""
    tuning = always_on()
    _, memory, _ = run(noisy(flight(), 1), tuning)
    d, n, m = tuning["d"][0, channel], tuning["n"][0, channel], part.stop - part.start
    rows, rest, y = memory["row"][:, part], memory["rest"][:, channel], memory["y"][:, channel]
    x = np.concatenate([[y[0]], clean_values(published_airframe())[0, part]])
    p = np.diag(np.concatenate([[d * n], memory["scale"][0, part] ** 2 / tuning["q0"][0, channel]]))
    for k in range(1, len(y)):
        f = np.eye(m + 1)
        f[0, 1:] = DT * 0.5 * (rows[k - 1] + rows[k])
        x = f @ x
        x[0] += DT * 0.5 * (rest[k - 1] + rest[k])
        p = f @ p @ f.T
        p[0, 0] += d * d * DT
        gain = p[:, 0] / (p[0, 0] + n * n / DT)
        x = x + gain * (y[k] - x[0])
        p = p - np.outer(gain, p[0])
    scale = memory["scale"][0, part]
    mine = memory["theta"][-1, part]
    moved = np.abs(x[1:] - clean_values(published_airframe())[0, part]) / scale
    assert np.all(np.abs(mine - x[1:]) / scale < 0.01), (mine, x[1:])
    assert moved.max() > 0.005  # otherwise the prior alone would agree
    deviation = np.sqrt(np.diag(covariance(memory["b3"][-1], channel, m)))
    assert deviation == pytest.approx(np.sqrt(np.diag(p))[1:], rel=0.05)


def test_channel_solves_the_sigma_equations() -> None:
    """Sigma and (xhat, thetahat) integrated as published, in full 5 x 5 form, end on the same estimate and B3."""
    tuning = always_on(gamma=2.0)
    tuning["q0"][0, 2] = 10.0  # so that the full form is not stiff
    _, memory, _ = run(flight()[:300], tuning, start=0.6)
    d, n, gamma = tuning["d"][0, 2], tuning["n"][0, 2], 2.0
    rows, rest, y = memory["row"][:, PITCH], memory["rest"][:, 2], memory["y"][:, 2]
    sigma = np.diag(np.concatenate([[1.0 / (d * n)], 10.0 / memory["scale"][0, PITCH] ** 2]))
    x = np.concatenate([[y[0]], 0.6 * clean_values(published_airframe())[0, PITCH]])
    c = np.zeros((5, 5))
    c[0, 0] = 1.0

    def rhs(x: np.ndarray, sigma: np.ndarray, a: np.ndarray, b: float, y: float) -> tuple[np.ndarray, np.ndarray]:
        big = np.zeros((5, 5))
        big[0, 1:] = a
        q = np.zeros((5, 5))
        q[1:, 1:] = np.outer(sigma[0, 1:], sigma[0, 1:]) / (sigma[0, 0] ** 2 * n * n)
        sigma_dot = -sigma @ big - big.T @ sigma - d * d * sigma @ c @ sigma + c / (n * n) - q / gamma**2
        x_dot = big @ x + np.linalg.solve(sigma, c[0]) * (y - x[0]) / (n * n)
        x_dot[0] += b
        return x_dot, sigma_dot

    fine = 8
    for k in range(1, len(y)):
        for j in range(fine):
            h, s = DT / fine, [(j + part / 2) / fine for part in range(3)]
            u = [((1 - z) * rows[k - 1] + z * rows[k], (1 - z) * rest[k - 1] + z * rest[k],
                  (1 - z) * y[k - 1] + z * y[k]) for z in s]  # fmt: skip
            k1 = rhs(x, sigma, *u[0])
            k2 = rhs(x + h / 2 * k1[0], sigma + h / 2 * k1[1], *u[1])
            k3 = rhs(x + h / 2 * k2[0], sigma + h / 2 * k2[1], *u[1])
            k4 = rhs(x + h * k3[0], sigma + h * k3[1], *u[2])
            x = x + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
            sigma = sigma + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
    scale = memory["scale"][0, PITCH]
    assert np.all(np.abs(memory["theta"][-1, PITCH] - x[1:]) / scale < 0.01), (memory["theta"][-1, PITCH], x[1:])
    mine = covariance(memory["b3"][-1], 2, 4)
    assert np.linalg.norm((mine - np.linalg.inv(sigma)[1:, 1:]) / np.outer(scale, scale)) < 0.02 * np.linalg.norm(
        mine / np.outer(scale, scale))  # fmt: skip


@pytest.mark.parametrize("gamma", [1.0, 1.1, 2.0, np.inf])
def test_information_grows_as_the_identity_says(gamma: float) -> None:
    """Pidot = (1 - gamma^-2) Q, exactly, for a row held over the sample: gamma* = 1."""
    random, kappa = np.random.default_rng(3), 1.0 - 1.0 / gamma**2
    theta, b3, row, gain = np.zeros(26), np.zeros(78), np.zeros(26), np.zeros(6)
    half = random.normal(size=(4, 4))
    b3[PACKED[2] : PACKED[2] + 10] = (half @ half.T + np.eye(4))[np.tril_indices(4)]
    row[PITCH] = random.normal(size=4)
    before = np.linalg.inv(covariance(b3, 2, 4))
    assert learn(theta, b3, gain, FIRST[2], PACKED[2], 4, row, 1.0, 0.7, 5.0, kappa)
    growth = np.linalg.inv(covariance(b3, 2, 4)) - before
    expected = kappa * 5.0 * np.outer(row[PITCH], row[PITCH])
    assert growth == pytest.approx(expected, abs=1e-9)


def test_gamma_below_the_optimum_is_flagged() -> None:
    """Below gamma* = 1 the solution escapes in finite time: health 0, the last estimate held, nothing spread."""
    estimates, memory, _ = run(flight(), always_on(gamma=0.9))
    health = estimates["health"]
    assert health[0] == 1.0 and health[-1] == 0.0 and memory["failed"][-1] == 1.0
    last = np.flatnonzero(health)[-1]
    assert all(np.isfinite(estimates[n]).all() and estimates[n][-1] == estimates[n][last] for n in ESTIMATED_NAMES)
    assert run(flight(), always_on(gamma=1.0))[0]["health"].all()


def test_where_it_starts_does_not_matter() -> None:
    """Seven starts from 0.4 to 1.6 of truth, no noise: ends within 2 % of one another and of truth."""
    truth = dict(zip(PARAMETER_NAMES, clean_values(published_airframe())[0], strict=True))
    ends = [run(flight(), default_tuning(), start)[0][-1] for start in np.linspace(0.4, 1.6, 7)]
    for name in ESTIMATED_NAMES:
        if name not in ("CY_0", "Cl_0", "Cn_0", "Cn_aileron"):  # truth is zero, or too small to be seen
            values = np.array([end[name] for end in ends]) / truth[name]
            assert np.ptp(values) < 0.02 and np.all(np.abs(values - 1.0) < 0.02), (name, values)
    assert all(abs(end["excess_drag"]) < 1e-3 for end in ends)


def test_sensor_noise_does_not_bias() -> None:
    truth = dict(zip(PARAMETER_NAMES, clean_values(published_airframe())[0], strict=True))
    ends = [run(noisy(flight(), seed), default_tuning(), 0.8)[0][-1] for seed in range(12)]
    for name in ("Cm_alpha", "Cm_q", "Cm_elevator", "CL_alpha"):
        values = np.array([end[name] for end in ends]) / truth[name] - 1.0
        assert abs(values.mean()) < 0.02, (name, values.mean())


def test_single_equals_batch_bit_for_bit() -> None:
    airframe, tuning = published_airframe(), default_tuning()
    flights = [noisy(flight(), seed)[:200] for seed in range(5)]
    observer, now = hinf.init(airframe, tuning, 5, 0.7), np.zeros(5, ESTIMATE)
    for k in range(200):
        hinf.step(observer, now, np.array([f[k] for f in flights]), np.repeat(airframe, 5), tuning, DT)
    for i, one in enumerate(flights):
        estimates, _, alone = run(one, tuning, 0.7)
        assert alone.tobytes() == observer[i : i + 1].tobytes()
        assert estimates[-1:].tobytes() == now[i : i + 1].tobytes()


def test_calm_flight_teaches_nothing_about_moments() -> None:
    """Sensor noise and gusts on the vane without any control: moment derivatives stay where they were."""
    m = np.repeat(flight()[:1], 3000)
    gust = np.cumsum(np.random.default_rng(1).normal(size=3000)) * 0.001
    m["alpha"] += gust - gust.mean()
    m["q"] += 0.3 * np.gradient(m["alpha"], DT)
    estimates, _, _ = run(noisy(m, 2), default_tuning())
    clean = dict(zip(PARAMETER_NAMES, clean_values(published_airframe())[0], strict=True))
    assert estimates["excitation_longitudinal"][-1] < 0.1
    for name in ("Cm_alpha", "Cm_q", "Cm_elevator", "Cl_p", "Cn_beta"):
        assert np.all(np.abs(estimates[name] / clean[name] - 1.0) < 0.02), name


@pytest.mark.parametrize("change", [{"CX_0": -0.08}, {"CZ_alpha": -4.8}])
def test_a_change_in_flight_is_followed(change: dict[str, float]) -> None:
    """Clean for 20 s, then another aircraft for 20 s: the estimate goes there, and so does the excess drag."""
    iced = published_airframe()
    for name, value in change.items():
        iced[name] = value
    estimates, _, _ = run(np.concatenate([flight(), fly(iced, 20.0, DT)[1:]]), default_tuning())
    target = dict(zip(PARAMETER_NAMES, clean_values(iced)[0], strict=True))
    assert estimates["CL_alpha"][-1] == pytest.approx(target["CL_alpha"], rel=0.03)
    clean = clean_values(published_airframe())[0, 0]
    assert estimates["excess_drag"][-1] == pytest.approx(estimates["CD_0"][-1] - clean, abs=0.002)
    if "CX_0" in change:
        assert estimates["excess_drag"][-1] == pytest.approx(target["CD_0"] - clean, rel=0.05)


@pytest.mark.parametrize("name", ["alpha", "q", "az", "airspeed", "elevator", "pressure"])
def test_an_unreadable_sample_is_flagged_and_does_not_spread(name: str) -> None:
    m = flight().copy()
    m[name][300:310] = np.nan
    estimates, _, _ = run(m, default_tuning(), 0.7)
    assert not estimates["health"][300:310].any() and estimates["health"][310:].all()
    for parameter in ESTIMATED_NAMES:
        assert np.all(estimates[parameter][300:310] == estimates[parameter][299])
    truth = clean_values(published_airframe())[0, PARAMETER_NAMES.index("Cm_alpha")]
    assert estimates["Cm_alpha"][-1] == pytest.approx(truth, rel=0.02)


def test_tuning_file_is_checked(tmp_path) -> None:
    path = tmp_path / "hinf.toml"
    text = (folder() / "estimators" / "hinf.toml").read_text()
    path.write_text(text.replace("gamma =", "gama ="))
    with pytest.raises(InputError, match="gamma"):
        tuning_from(path)
    with pytest.raises(InputError, match="wing_area"):
        airframe_from({"span": 1.0})
    assert len(DIAGONAL) == len(PARAMETER_NAMES) == 26
