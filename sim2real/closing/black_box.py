"""How far a regressor closes the gap that knows no physics: ridge regression of residual accelerations.

The plant is started at the measured state of every sample and flown a tenth of a second: what its rates and specific
forces then lack is regressed on flow angles, rates, controls, speed and power, their products two by two, and their
values of the last half second. Flown in free windows, the regression sees the simulated state and pushes it. It is a
ceiling to compare an explanation with, and no explanation.
Ridge regression with its strength chosen on blocks of the data left out: Hastie, Tibshirani & Friedman, The Elements of
Statistical Learning, 2nd ed., sections 3.4 and 7.10.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.prediction.predictor import TANGENT, Predictor, put
from sim2real.records.channels import MEASURED, SURFACES
from sim2real.records.reconstruct import Reconstruction

AHEAD = 0.1  # s that the plant flies from a measured state
LAGS = (0.1, 0.25, 0.5)  # s
BLOCKS = 6
STRENGTHS = tuple(np.geomspace(1e-3, 1e4, 15))  # of the ridge, per sample
FEATURES = ("alpha", "beta", "p", "q", "r", "airspeed")
PUSHED = ("u", "v", "w", "p", "q", "r")
FELT = {"u": "ax", "v": "ay", "w": "az"}
_COLUMN = np.array([TANGENT.index(name) for name in PUSHED])


@dataclass(frozen=True)
class BlackBox:
    """A regression of six residual accelerations (m/s2, rad/s2).

    Attributes:
        mean, spread, low, high: of the plain features where it was fitted; beyond low and high it holds its value.
        weights: [features + 1, 6], the constant first.
    """

    mean: FloatArray
    spread: FloatArray
    low: FloatArray
    high: FloatArray
    weights: FloatArray

    def __call__(self, now: FloatArray, before: Sequence[FloatArray]) -> FloatArray:
        """Accelerations [n, 6] at plain features `now` [n, f] with those of LAGS ago."""
        scaled = [(np.clip(values, self.low, self.high) - self.mean) / self.spread for values in (now, *before)]
        return np.asarray(_features(scaled) @ self.weights)


def _features(scaled: Sequence[FloatArray]) -> FloatArray:
    """Constant, features, their products two by two, and what they were."""
    now = scaled[0]
    i, j = np.triu_indices(now.shape[1])
    return np.column_stack([np.ones(len(now)), now, now[:, i] * now[:, j], *scaled[1:]])


def train(flights: Sequence[Reconstruction]) -> BlackBox:
    """Fit the regression on the diagnosed records."""
    parts = [_samples(flight) for flight in flights]
    plain = np.concatenate([p[0][0] for p in parts])
    mean, spread = plain.mean(axis=0), plain.std(axis=0)
    spread = np.where(spread > 1e-9, spread, np.inf)
    X = np.concatenate([_features([(values - mean) / spread for values in p[0]]) for p in parts])
    Y = np.concatenate([p[1] for p in parts])
    size = np.maximum(Y.std(axis=0), 1e-12)
    strength = min(STRENGTHS, key=lambda s: _left_out(X, Y / size, s))
    return BlackBox(mean, spread, plain.min(axis=0), plain.max(axis=0), _ridge(X, Y, strength))


def _ridge(X: FloatArray, Y: FloatArray, strength: float) -> FloatArray:
    """Weights; the constant is not held back."""
    held = np.full(X.shape[1], strength)
    held[0] = 0.0
    return np.asarray(np.linalg.solve(X.T @ X + np.diag(held) + 1e-9 * np.eye(len(held)), X.T @ Y), np.float64)


def _left_out(X: FloatArray, Y: FloatArray, strength: float) -> float:
    """Mean square error on blocks in time that were left out."""
    edges = np.linspace(0, len(X), BLOCKS + 1).astype(int)
    total = 0.0
    for first, last in zip(edges[:-1], edges[1:], strict=True):
        keep = np.r_[0:first, last : len(X)]
        total += float(np.sum((Y[first:last] - X[first:last] @ _ridge(X[keep], Y[keep], strength)) ** 2))
    return total / len(X)


def plain_features(flight: Reconstruction, values: dict[str, FloatArray], k: NDArray[np.intp]) -> FloatArray:
    """Flow angles, rates and speed given, controls of samples `k`: [n, f]."""
    controls = [flight.controls[name][k] for name in (*SURFACES, "flap")]
    power = flight.controls["power_left"][k] + flight.controls["power_right"][k]
    return np.column_stack([*(values[name] for name in FEATURES), *controls, power])


def _samples(flight: Reconstruction) -> tuple[list[FloatArray], FloatArray]:
    """Plain features now and LAGS ago of every sample, and the residual accelerations that follow [n, 6]."""
    lags = [round(lag / flight.dt) for lag in LAGS]
    k, lacking = residual_accelerations(flight, max(lags))
    series = {name: flight.channel(name) for name in FEATURES}
    return [plain_features(flight, {n: series[n][k - lag] for n in FEATURES}, k - lag) for lag in (0, *lags)], lacking


def residual_accelerations(flight: Reconstruction, first: int = 0) -> tuple[NDArray[np.intp], FloatArray]:
    """Samples from `first` on [n], and what rates and specific forces of the plant lack after each [n, 6]."""
    ahead = max(1, round(AHEAD / flight.dt))
    k = np.arange(first, len(flight.time) - ahead - 1)
    series = {name: flight.channel(name) for name in MEASURED[:11]}
    flown = Predictor(flight, np.repeat(flight.parameters, len(k)))
    values: dict[str, float | FloatArray] = {name: series[name][k] for name in MEASURED[:8]}
    values |= {name: control[k] for name, control in flight.controls.items()}
    put(flown.fleet, values | {"altitude": flight.altitude[k]})
    sums = np.zeros((len(k), 6))
    read = flown.fly(ahead, k)
    for j, name in enumerate(PUSHED[:3]):
        felt = FELT[name]
        later = np.stack([series[felt][k + m + 1] for m in range(ahead)])
        sums[:, j] = np.mean(later - read[:, :, MEASURED.index(felt)], axis=0)
    for j, name in enumerate(PUSHED[3:], start=3):
        sums[:, j] = (series[name][k + ahead] - read[-1, :, MEASURED.index(name)]) / (ahead * flight.dt)
    sums[:, [not flight.has(FELT.get(name, name)) for name in PUSHED]] = 0.0
    return k, sums


class Pushed:
    """The plant flown freely with the regression's accelerations added: what `prediction.windows` may fly instead."""

    def __init__(self, box: BlackBox, flight: Reconstruction, lags: Sequence[float] = LAGS) -> None:
        self.box, self.flight = box, flight
        self.lags = [round(lag / flight.dt) for lag in lags]
        self.past: list[FloatArray] = []

    def __call__(self, flown: Predictor, k: NDArray[np.intp]) -> FloatArray:
        """Push the rows of `flown`, which stand at samples `k`; returns what accelerometers feel of it [n, 3]."""
        s = flown.fleet.state  # in still air
        speed = np.sqrt(s["u"] ** 2 + s["v"] ** 2 + s["w"] ** 2)
        values = {"alpha": np.arctan2(s["w"], s["u"]), "beta": np.arcsin(s["v"] / speed), "airspeed": speed,
                  **{name: s[name].copy() for name in "pqr"}}
        self.past.append(plain_features(self.flight, values, k))
        del self.past[: -max(self.lags) - 1]
        before = [self.past[max(0, len(self.past) - 1 - lag)] for lag in self.lags]
        acceleration = self.box(self.past[-1], before)
        change = np.zeros((flown.n, len(TANGENT)))
        change[:, _COLUMN] = acceleration * self.flight.dt
        flown.correct(change)
        return np.asarray(acceleration[:, :3])
