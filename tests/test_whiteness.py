"""Innovations of an aircraft that the model knows are white: the filter expects the noise that is there.

Flown by the generator's plant, whose gusts are drawn every 5 ms: between samples they are not the straight lines that
the predictor has.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from generated import written

from icing_env.aircraft import load
from sim2real.baseline.references import Baseline
from sim2real.diagnosis import _reconstructed
from sim2real.prediction.as_predicted import as_predicted
from sim2real.prediction.gusts import KINDS, LATER, Gusts
from sim2real.prediction.kalman import follow, gains, linearise, roughness
from sim2real.prediction.predictor import TANGENT, Predictor, innovations
from sim2real.prediction.readings import apart
from sim2real.prediction.within_steps import within_steps
from sim2real.records.channels import FED_BACK, MEASURED
from sim2real.records.noise import step_noise
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.gust_intensity import SIGMAS, choose_gain
from sim2real.signatures.whitening import SETTLE, whiten, whitening
from testbed.withheld import conditions, instruments
from testbed.withheld import plant as pl
from testbed.withheld.conditions import Conditions
from testbed.withheld.flights import Aircraft, fly, turbulence
from testbed.withheld.manoeuvres import PLANS

SEEDS, LEVEL, BLOCK = 6, 0.5, 100
FELT = MEASURED[:11]
RATES = [MEASURED.index(name) for name in ("p", "q", "r")]


def flown(folder, sigma: float, seed: int, gusts: str = "later") -> Reconstruction:
    """The published aircraft, with good instruments."""
    manoeuvre, rng = PLANS[seed % len(PLANS)][seed % 3], np.random.default_rng(seed)
    flight = fly(Aircraft(), manoeuvre, 1.0, turbulence(manoeuvre, Conditions(sigma, 1.0, 1.0, gusts), rng))
    record = written(folder / "1", instruments.read(flight.channels, LEVEL, rng), flight.commands)
    return _reconstructed([record], Baseline(load(), np.eye(1)), None)[0]


@pytest.mark.parametrize(("sigma", "gusts"), [(SIGMAS[0], "later"), (0.5, "later"), (1.5, "later"), (1.5, "turning"),
                                              *(pytest.param(*air, marks=pytest.mark.slow) for air in (
                                                  (1.5, "at_once"), (0.5, "rolling"), (0.5, "turning"),
                                                  (1.5, "rolling")))])  # fmt: skip
def test_innovations_of_a_known_aircraft_are_white(tmp_path, sigma, gusts):
    white, kind = [], KINDS[conditions.KINDS.index(gusts)]
    for seed in range(SEEDS):
        flight = flown(tmp_path, sigma if sigma > SIGMAS[0] else 0.0, seed, gusts)
        gain = follow(flight, gains(flight, (sigma,), kind)[0])
        left = innovations(flight, flight.parameters, gain.K, (), kind)
        v = whiten(left, whitening(left[:, 0], gain, flight))[round(SETTLE / flight.dt) :, 0, : len(FELT)]
        white.append(v[: len(v) // BLOCK * BLOCK].reshape(-1, BLOCK, len(FELT)))
    blocks = np.concatenate([w.mean(axis=1) for w in white])
    square = dict(zip(FELT, BLOCK * np.mean(blocks**2, axis=0), strict=True))  # one, were it white; to 0.14
    assert all(0.4 < s < 1.6 for s in square.values()), square


def kept(flight: Reconstruction, samples: dict[str, slice]) -> Reconstruction:
    """The record with only some samples of some channels."""
    measured = flight.measured.copy()
    for name, which in samples.items():
        column = np.full(len(measured), np.nan)
        column[which] = measured[which, MEASURED.index(name)]
        measured[:, MEASURED.index(name)] = column
    return replace(flight, measured=measured)


@pytest.mark.parametrize("lost", [
    "beta", "airspeed", *(pytest.param(name, marks=pytest.mark.slow) for name in ("alpha", "r"))])  # fmt: skip
def test_where_a_channel_is_absent_the_others_innovations_stay_white(tmp_path, lost):
    """Without beta nothing held the gusts from the side: means of p had 17 times their variance, and ay was blamed."""
    squares = []
    for seed in range(SEEDS):
        flight = flown(tmp_path, 1.5, seed)
        measured = flight.measured.copy()
        measured[701:1301, MEASURED.index(lost)] = np.nan  # the readings at the ends of steps 700 to 1299
        flight = replace(flight, measured=measured)
        gain = follow(flight, gains(flight, (1.5,))[0])
        left = innovations(flight, flight.parameters, gain.K)
        v = whiten(left, whitening(left[:, 0], gain, flight))[700:1300, 0, : len(FELT)]
        squares.append(v.reshape(-1, BLOCK, len(FELT)).mean(axis=1) ** 2)
    square = dict(zip(FELT, BLOCK * np.mean(np.concatenate(squares), axis=0), strict=True))
    assert square.pop(lost) == 0.0
    assert all(s < 1.8 for s in square.values()), square


@pytest.mark.parametrize("samples", [{"r": slice(0, None, 5)}, {"ay": slice(0, 1200)}, {"airspeed": slice(3, None, 5)},
                                     {name: slice(k % 5, None, 5) for k, name in enumerate(FELT)}])  # fmt: skip
def test_channels_that_are_slow_or_stop_are_worth_their_samples(tmp_path, samples):
    """Their noise is that of the samples there are, and where there is none nothing counts."""
    flight = kept(flown(tmp_path, 0.5, 1), samples)
    gain = choose_gain(flight, SIGMAS)
    assert 0.3 < gain.sigma < 0.8
    gain = follow(flight, gain)
    left = innovations(flight, flight.parameters, gain.K)
    first = round(SETTLE / flight.dt)
    v = whiten(left, whitening(left[:, 0], gain, flight))[first:, 0, : len(FELT)]
    seen = np.isfinite(flight.measured[1 + first :, : len(FELT)])
    assert np.all(v[~seen] == 0.0)
    squares = {name: float(np.mean(v[seen[:, c], c] ** 2)) for c, name in enumerate(FELT)}
    assert all(0.6 < s < 1.7 for s in squares.values()), squares


@pytest.mark.parametrize("slow", [
    ("airspeed", "alpha", "beta"),
    *(pytest.param(names, marks=pytest.mark.slow) for names in (("alpha",), ("beta",), ("p", "q", "r", "alpha"))),
])  # fmt: skip
def test_innovations_beside_slow_channels_are_white_and_of_their_size(tmp_path, slow):
    """With the noise that their samples show; a vane that is believed to have next to none colours the airspeed."""
    squares, means = [], []
    for seed in range(SEEDS):
        flight = slowly(flown(tmp_path, 1.5, seed), slow)
        gain = follow(flight, gains(flight, (1.5,))[0])
        left = innovations(flight, flight.parameters, gain.K)
        v = whiten(left, whitening(left[:, 0], gain, flight))[200:1900, 0, : len(FELT)]
        squares.append(np.sum(v**2, axis=0) / np.count_nonzero(v, axis=0))
        means.append(v.reshape(-1, BLOCK, len(FELT)).mean(axis=1) ** 2)
    square, mean = np.mean(squares, axis=0), BLOCK * np.mean(np.concatenate(means), axis=0)
    for c, name in enumerate(FELT):
        assert 0.85 < square[c] < 1.15, (name, square[c])
        assert mean[c] < (0.35 if name in slow else 1.6), (name, mean[c])  # where a fifth was read the rest are zeros


def slowly(flight: Reconstruction, slow: tuple[str, ...]) -> Reconstruction:
    """The record with every fifth sample of some channels, with the noise that these show: gusts add more to theirs."""
    kept_few = kept(flight, dict.fromkeys(slow, slice(0, None, 5)))
    A, C, _ = (matrix[0] for matrix in linearise(flight))
    columns = [i for i, name in enumerate(TANGENT) if name.startswith("dryden")]
    Qw = Gusts(1.5).noise(flight)
    own, shown = (roughness(A, C[:FED_BACK], A[:, columns], C[:FED_BACK, columns], Qw, apart(f))
                  for f in (flight, kept_few))  # fmt: skip
    noise = flight.noise.copy()
    noise[:FED_BACK] = np.sqrt(noise[:FED_BACK] ** 2 + shown - own)
    return replace(kept_few, noise=noise)


def test_a_slow_channel_whose_samples_differ_by_gusts_is_not_taken_for_exact(tmp_path):
    flight = kept(flown(tmp_path, 1.5, 0), {"alpha": slice(0, None, 5)})
    gain = gains(flight, (1.5,))[0]
    D = gain.model[1][:, [i for i, name in enumerate(TANGENT) if name.startswith("dryden")]]
    Qw = Gusts(1.5).noise(flight)
    own = np.sqrt(0.2 * np.diag(gain.model[3] - D @ Qw @ D.T)[1])
    assert own == pytest.approx(0.5 * flight.noise[1], rel=1e-3)


def test_predictions_between_slow_readings_know_nothing_that_comes_later(tmp_path):
    """A line from one reading to the next knows the later one: a clean aircraft had a z force by its own alpha."""
    flight = kept(flown(tmp_path, 1.5, 0), {"alpha": slice(0, None, 5)})
    gain, later = follow(flight, gains(flight, (1.5,))[0]), 1003  # between two readings of alpha
    measured = flight.measured.copy()
    measured[later:, MEASURED.index("az")] += 3.0
    before, after = (as_predicted(f, innovations(f, f.parameters, gain.K)[:, 0], gain).channel("alpha")
                     for f in (flight, replace(flight, measured=measured)))  # fmt: skip
    np.testing.assert_array_equal(before[: later + 1], after[: later + 1])
    assert np.max(np.abs(before[later + 1 : later + 10] - after[later + 1 : later + 10])) > 1e-3
    every = flown(tmp_path, 1.5, 0).channel("alpha")
    assert np.std(before[200:] - every[200:]) < 2.5 * flight.noise[MEASURED.index("alpha")]


def test_predictions_where_a_slow_altitude_is_absent_are_numbers(tmp_path):
    """What was filled there is predicted, and between the other readings there are none to predict."""
    flight = kept(flown(tmp_path, 0.5, 0), {"altitude": slice(0, None, 5)})
    measured = flight.measured.copy()
    measured[500:700, MEASURED.index("altitude")] = np.nan
    flight = replace(flight, measured=measured)
    gain = follow(flight, gains(flight, (0.5,))[0])
    told = as_predicted(flight, innovations(flight, flight.parameters, gain.K)[:, 0], gain).channel("altitude")
    assert np.max(np.abs(told - flown(tmp_path, 0.5, 0).channel("altitude"))[200:]) < 3.0


def test_gusts_between_samples_disturb_as_much_as_flights_show(tmp_path):
    manoeuvre, rng = PLANS[0][0], np.random.default_rng(1)
    gust = turbulence(manoeuvre, Conditions(1.0, 1.0, 1.0), rng)
    at = np.arange(len(gust))
    straight = np.column_stack([np.interp(at, at[:: pl.SUB], column[:: pl.SUB]) for column in gust.T])
    one, other = (fly(Aircraft(), manoeuvre, 1.0, g).states for g in (gust, straight))
    flight = flown(tmp_path, 0.0, 0)
    A = linearise(flight)[0][0]
    expected = within_steps(A, Gusts(1.0).noise(flight), LATER, 0.0)
    for name, column in (("p", pl.P), ("q", pl.Q), ("r", pl.R)):
        apart = float(np.std(np.diff(one[:, column] - other[:, column])))
        j = TANGENT.index(name)
        assert apart == pytest.approx(np.sqrt(expected[j, j]), rel=0.3), name


def test_what_moves_the_gusts_is_met_at_the_end_of_a_step(tmp_path):
    """The linearised map and the predictor's own flight turn the air alike; the plant starts its lags otherwise."""
    kind = KINDS[conditions.KINDS.index("turning")]
    flight, size = flown(tmp_path, 0.0, 0), 0.1
    A = linearise(flight, [slice(0, 25)], kind)[0][0]
    for gust in ("dryden_v1", "dryden_v2", "dryden_w1", "gust_v", "gust_w"):
        plant = Predictor(flight, np.repeat(flight.parameters, 2), kind=kind)
        plant.place(0)
        column = TANGENT.index(gust)
        plant.correct(np.outer([size, -size], np.arange(len(TANGENT)) == column))
        plant.fly(1)
        one, other = plant.tangent() / (2.0 * size)
        for row in ("dryden_q", "dryden_r", "gust_q", "gust_r"):
            j = TANGENT.index(row)
            assert A[j, column] == pytest.approx(one[j] - other[j], rel=0.01, abs=1e-6), (gust, row)


def test_noise_of_recorded_torque_disturbs_as_much_as_flights_show(tmp_path):
    """Samples come every tenth of a second, straight lines between them; each engine has its own."""
    flight, rng, steps = flown(tmp_path, 0.0, 0), np.random.default_rng(2), 200
    every, spread = round(0.1 / flight.dt), 1200.0
    at = np.arange(len(flight.time))

    def rates(noise: dict[str, np.ndarray]) -> np.ndarray:
        plant = Predictor(replace(flight, controls=flight.controls | noise), flight.parameters)
        plant.place(0)
        return plant.fly(steps)[-1, 0, RATES]

    exact, apart = rates({}), []
    for _ in range(300):
        drawn = {name: rng.normal(0.0, spread, len(at[::every])) for name in ("power_left", "power_right")}
        noise = {name: np.interp(at, at[::every], draws) for name, draws in drawn.items()}
        apart.append(rates({name: flight.controls[name] + noise[name] for name in noise}) - exact)
    told = step_noise(noise["power_left"], at % every == 0)
    assert told == pytest.approx(spread * np.sqrt(every), rel=0.25)
    A, _, B = (matrix[0] for matrix in linearise(flight, [slice(0, steps)]))
    covariance = np.zeros_like(A)
    for _ in range(steps):
        covariance = A @ covariance @ A.T + every * spread**2 * B[:, 3:] @ B[:, 3:].T
    expected = np.sqrt(covariance.diagonal()[[TANGENT.index(name) for name in ("p", "q", "r")]])
    assert np.std(apart, axis=0) == pytest.approx(expected, rel=0.25)
    assert flight.power_noise == pytest.approx(LEVEL * 3.0 * 2000.0 * np.pi / 30.0 * np.sqrt(every), rel=0.15)
