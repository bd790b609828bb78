"""Compiled flights of many parameter sets through one record: free simulation, and the Kalman filter's innovations."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from estimators.likelihood.equations import (
    FIRST_GUST,
    LATERAL_STATES,
    LONGITUDINAL_STATES,
    OUTPUTS,
    STATES,
    lateral,
    longitudinal,
)
from icing_env.jit import block, entry


@block
def rows(axis: int, t: Any, x: Any, inverse: Any, F: Any, b: Any, H: Any, d: Any, gust: bool) -> None:
    """The equations of an axis (0 longitudinal, 1 lateral) at one sample."""
    if axis == 0:
        longitudinal(t, x, F, b, H, d, gust)
    else:
        lateral(t, x, inverse, F, b, H, d, gust)


@block
def rate(F: Any, b: Any, x: Any, out: Any, n: int) -> None:
    """out = F x + b."""
    for i in range(n):
        total = b[i]
        for j in range(n):
            total += F[i, j] * x[j]
        out[i] = total


@block
def runge_kutta(
    F0: Any, b0: Any, F1: Any, b1: Any, x: Any, k: Any, mid: Any, Fm: Any, bm: Any, dt: float, n: int
) -> None:  # fmt: skip
    """One step of fourth order of x' = F x + b, whose rows go in straight lines from one sample to the next."""
    for i in range(n):
        bm[i] = 0.5 * (b0[i] + b1[i])
        for j in range(n):
            Fm[i, j] = 0.5 * (F0[i, j] + F1[i, j])
    rate(F0, b0, x, k[0], n)
    for i in range(n):
        mid[i] = x[i] + 0.5 * dt * k[0, i]
    rate(Fm, bm, mid, k[1], n)
    for i in range(n):
        mid[i] = x[i] + 0.5 * dt * k[1, i]
    rate(Fm, bm, mid, k[2], n)
    for i in range(n):
        mid[i] = x[i] + dt * k[2, i]
    rate(F1, b1, mid, k[3], n)
    for i in range(n):
        x[i] += dt / 6.0 * (k[0, i] + 2.0 * (k[1, i] + k[2, i]) + k[3, i])


@entry
def free_flight(axis: int, thetas: Any, starts: Any, data: Any, inverse: Any, dt: float) -> Any:
    """Outputs (m, N, OUTPUTS) of parameter sets (m, p) from initial states (m, n) through rows of data (N, c)."""
    m, steps = len(thetas), len(data)
    n = LONGITUDINAL_STATES if axis == 0 else LATERAL_STATES
    y = np.empty((m, steps, OUTPUTS))
    F, b, Fm, bm = np.zeros((2, n, n)), np.zeros((2, n)), np.zeros((n, n)), np.zeros(n)
    H, d, k, mid, x = np.zeros((OUTPUTS, n)), np.zeros(OUTPUTS), np.zeros((4, n)), np.zeros(n), np.zeros(n)
    for i in range(m):
        x[:] = starts[i]
        for s in range(steps):
            now, old = s % 2, 1 - s % 2
            rows(axis, thetas[i], data[s], inverse, F[now], b[now], H, d, False)
            if s > 0:
                runge_kutta(F[old], b[old], F[now], b[now], x, k, mid, Fm, bm, dt, n)
            for j in range(OUTPUTS):
                total = d[j]
                for a in range(n):
                    total += H[j, a] * x[a]
                y[i, s, j] = total
    return y


@block
def transition(F: Any, dt: float, Phi: Any, power: Any, spare: Any, n: int) -> None:
    """exp(F dt) by Taylor's series to fourth order."""
    for i in range(n):
        for j in range(n):
            power[i, j] = 1.0 if i == j else 0.0
            Phi[i, j] = power[i, j]
    factor = 1.0
    for order in range(1, 5):
        factor *= dt / order
        for i in range(n):
            for j in range(n):
                total = 0.0
                for a in range(n):
                    total += power[i, a] * F[a, j]
                spare[i, j] = total
        for i in range(n):
            for j in range(n):
                power[i, j] = spare[i, j]
                Phi[i, j] += factor * spare[i, j]


@block
def predict(Phi: Any, Q: Any, P: Any, spare: Any, n: int) -> None:
    """P = Phi P Phi' + diag(Q)."""
    for i in range(n):
        for j in range(n):
            total = 0.0
            for a in range(n):
                total += Phi[i, a] * P[a, j]
            spare[i, j] = total
    for i in range(n):
        for j in range(i, n):
            total = Q[i] if i == j else 0.0
            for a in range(n):
                total += spare[i, a] * Phi[j, a]
            P[i, j] = total
            P[j, i] = total


@block
def learn(H: Any, z: Any, noise: Any, P: Any, gain: Any, s: Any, n: int) -> None:
    """Gains (OUTPUTS, n) and innovation variances for the measurements of one instant, taken one after another."""
    for c in range(OUTPUTS):
        s[c] = noise[c]
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += P[i, j] * H[c, j]
            gain[c, i] = total
            s[c] += H[c, i] * total
        if math.isnan(z[c]):
            continue
        for i in range(n):
            for j in range(i, n):
                P[i, j] -= gain[c, i] * gain[c, j] / s[c]
                P[j, i] = P[i, j]


@block
def correct(H: Any, d: Any, z: Any, gain: Any, s: Any, x: Any, v: Any, n: int) -> None:
    """Move x by the measurements of one instant; writes their innovations, 0 where nothing was measured."""
    for c in range(OUTPUTS):
        v[c] = 0.0
        if not math.isnan(z[c]):
            v[c] = z[c] - d[c]
            for i in range(n):
                v[c] -= H[c, i] * x[i]
            for i in range(n):
                x[i] += gain[c, i] / s[c] * v[c]


@block
def uncertain(axis: int, sigma: float, spread: Any, P: Any, n: int) -> None:
    """Covariance of the first state: what is not known of the aircraft, and the gust's own spread."""
    for a in range(n):
        for c in range(n):
            P[a, c] = 0.0
        P[a, a] = spread[a] * spread[a]
    gust = FIRST_GUST
    P[gust, gust], P[gust + 1, gust + 1] = sigma * sigma, 0.5 * sigma * sigma
    P[gust, gust + 1], P[gust + 1, gust] = 0.5 * sigma * sigma, 0.5 * sigma * sigma
    P[gust + 2, gust + 2] = 0.5 * sigma * sigma if axis == 0 else 0.0


@entry
def filtered_flight(
    axis: int, thetas: Any, noises: Any, drives: Any, start: Any, spread: Any, data: Any, inverse: Any, z: Any,
    thin: int, steady: bool, dt: float
) -> Any:  # fmt: skip
    """Innovations and their variances, (2, m, M, OUTPUTS), of a Kalman filter with the gust among its states.

    The state flies the equations of the instant; its covariance those of the mean row of data, and once the
    innovations' variances change by less than 1e-7 of themselves it is left as it is (`steady`).

    Args:
        thetas: (m, p) parameters.
        noises: (m, OUTPUTS) variances of the measurement noise.
        drives: (m, 3) gust intensity (m/s), and power of unmodelled acceleration across (m2/s3) and of angular
            acceleration (rad2/s3).
        start, spread: (STATES,) first state and its standard deviations.
        z: (N, OUTPUTS) measured, nan where a channel was not sampled; every `thin`-th row is used, M in all.
    """
    m, steps, n = len(thetas), len(data), STATES
    used, gust_rate, rates = (steps + thin - 1) // thin, 16 if axis == 0 else 18, 1 if axis == 0 else 2
    out = np.empty((2, m, used, OUTPUTS))
    F, b, Fm, bm = np.zeros((2, n, n)), np.zeros((2, n)), np.zeros((n, n)), np.zeros(n)
    H, d, Phi, k = np.zeros((OUTPUTS, n)), np.zeros(OUTPUTS), np.zeros((n, n)), np.zeros((4, n))
    power, spare, mid, gain = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n), np.zeros((OUTPUTS, n))
    x, P, Q, mean = np.zeros(n), np.zeros((n, n)), np.zeros(n), np.zeros(data.shape[1])
    Hm, last, now_s = np.zeros((OUTPUTS, n)), np.zeros(OUTPUTS), np.zeros(OUTPUTS)
    for s in range(steps):
        for a in range(len(mean)):
            mean[a] += data[s, a] / steps
    for i in range(m):
        uncertain(axis, drives[i, 0], spread, P, n)
        rows(axis, thetas[i], mean, inverse, Fm, bm, Hm, d, True)
        transition(Fm, dt, Phi, power, spare, n)
        Q[:] = 0.0
        Q[0] = drives[i, 1] * dt
        for a in range(rates):
            Q[1 + a] = drives[i, 2] * dt
        Q[FIRST_GUST] = 2.0 * mean[gust_rate] * drives[i, 0] * drives[i, 0] * dt
        x[:] = start
        last[:] = 0.0
        settled = False
        for s in range(steps):
            now, old = s % 2, 1 - s % 2
            rows(axis, thetas[i], data[s], inverse, F[now], b[now], H, d, True)
            if s > 0:
                runge_kutta(F[old], b[old], F[now], b[now], x, k, mid, Fm, bm, dt, n)
                if not settled:
                    predict(Phi, Q, P, spare, n)
            if s % thin == 0:
                if not settled:
                    learn(Hm, z[s], noises[i], P, gain, now_s, n)
                    change = 0.0
                    for c in range(OUTPUTS):
                        change = max(change, abs(now_s[c] - last[c]) / now_s[c])
                        last[c] = now_s[c]
                    settled = steady and change < 1e-7
                correct(H, d, z[s], gain, now_s, x, out[0, i, s // thin], n)
                out[1, i, s // thin] = now_s
    return out
