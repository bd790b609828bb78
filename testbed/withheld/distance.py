"""How far an effect stands from no effect and from its rivals, in standard deviations of noise and gust.

A departure is passed through the steady Kalman filter of the plant linearised at the manoeuvre's trim, with the
case's own noise and gust (innovations form), so that what the gust could have done counts as gust. Start of each
manoeuvre, the published spread of derivatives and mass are nuisances, integrated out. Departures are taken as linear
in the size of a rival. Calm air is given 0.05 m/s, without which the filter would not settle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_are

from testbed.withheld import gusts, instruments, trim
from testbed.withheld import plant as pl
from testbed.withheld.compiled import compiled
from testbed.withheld.conditions import Conditions
from testbed.withheld.flights import Flown
from testbed.withheld.published import PUBLISHED, airframe

MOTION = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az", "altitude")
X = (pl.H, pl.U, pl.V, pl.W, pl.PHI, pl.THETA, pl.P, pl.Q, pl.R, pl.ADW)
X_STEP = np.array([1.0, 0.1, 0.1, 0.1, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3])
START = np.array([10.0, 3.0, 3.0, 3.0, 0.1, 0.1, 0.05, 0.05, 0.05, 0.05])  # wide spread of the start (assumed)
INPUTS = (pl.DE, pl.DA, pl.DR, pl.PL, pl.PR)
U_STEP = np.array([1e-3, 1e-3, 1e-3, 1e3, 1e3])
SEEN = (pl.VT, pl.ALPHA, pl.BETA, pl.FX, pl.FY, pl.FZ)
CALM = 0.05  # m/s


@dataclass(frozen=True)
class Whitener:
    """Filter of one manoeuvre: x <- F x + mean_in mean(u) + end_in u + K e; columns `starts` are initial states."""

    F: NDArray
    K: NDArray
    M: NDArray
    mean_in: NDArray
    end_in: NDArray
    root: NDArray  # inverse of the Cholesky factor of the innovations' covariance
    starts: NDArray


def linear(speed: float) -> tuple[NDArray, NDArray]:
    """Jacobians about level flight at `speed`: of the rates of X and of the outputs SEEN.

    Returns:
        A [10, 22] and C [6, 22]; columns: X, INPUTS, gusts.
    """
    row = airframe()
    y, u = trim.trimmed(row, speed)
    d, o = np.empty(pl.STATES), np.empty(pl.OUTPUTS)
    columns: list[NDArray] = []
    steps = [*zip(X, X_STEP, strict=True), *zip(INPUTS, U_STEP, strict=True), *((-1 - j, 0.1) for j in range(pl.GUSTS))]
    for index, step in steps:
        ends = []
        for sign in (1.0, -1.0):
            z, g = y.copy(), np.zeros(pl.GUSTS)
            if index >= 0:
                z[index] += sign * step
            else:
                g[-1 - index] = sign * step
            pl.rates(z, row[0], u, g, 0.0, d, o)
            ends.append(np.concatenate([d[list(X)], o[list(SEEN)]]))
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    J = np.column_stack(columns)
    return J[:10], J[10:]


def whitener(speed: float, given: Conditions) -> Whitener:
    """The filter at one speed in given gusts and noise."""
    A_all, C_all = linear(speed)
    A, B, G = A_all[:, :10], A_all[:, 10:15], A_all[:, 15:]
    Ag, Bg, Cg = gusts.along(given.gusts, max(given.sigma, CALM), given.scale, speed)
    n = 10 + len(Ag)
    Ac, Bc, noise = np.zeros((n, n)), np.zeros((n, 5)), np.zeros((n, Bg.shape[1]))
    Ac[:10, :10], Ac[:10, 10:], Ac[10:, 10:] = A, G @ Cg, Ag
    Bc[:10], noise[10:] = B, Bg
    Fx, Qx = gusts.discrete(Ac, noise, pl.DT)
    wide = np.zeros((n + 5, n + 5))
    wide[:n, :n], wide[:n, n:] = Ac, Bc
    gamma = gusts.discrete(wide, np.zeros((n + 5, 1)), pl.DT)[0][:n, n:]
    Cy, Dy = np.zeros((11, n)), np.zeros((11, 5))  # V alpha beta p q r ax ay az as the sensors meet them, phi theta
    rows = {0: 0, 1: 1, 2: 2, 6: 3, 7: 4, 8: 5}
    for out, seen in rows.items():
        Cy[out, :10] = C_all[seen, :10]
        Cy[out, 10:] = C_all[seen, 15:] @ Cg
        Dy[out] = C_all[seen, 10:15]
    for out, column in ((3, 6), (4, 7), (5, 8)):
        Cy[out, column] = 1.0
    stationary = solve_continuous_lyapunov(Ag, -Bg @ Bg.T)  # of the gust, which nobody knows at the start either
    start = np.linalg.cholesky(stationary + 1e-12 * np.eye(n - 10))
    return _assembled(Fx, Qx, gamma, Cy, Dy, given.level, start)


def _sensors() -> tuple[NDArray, NDArray]:
    """s <- S s + E y: pitot, vanes, recorded alpha beta, recorded p q r ax ay az (11 states, 9 inputs)."""
    record = 1.0 - math.exp(-2.0 * math.pi * PUBLISHED["filter_frequency"] * pl.DT)
    pitot, vane = instruments.gain(PUBLISHED["pitot_lag"]), instruments.gain(PUBLISHED["vane_lag"])
    S, E = np.zeros((11, 11)), np.zeros((11, 9))
    S[0, 0], E[0, 0] = 1.0 - pitot, pitot
    for vane_state, out, channel in ((1, 3, 1), (2, 4, 2)):
        S[vane_state, vane_state], E[vane_state, channel] = 1.0 - vane, vane
        S[out, out], S[out, vane_state], E[out, channel] = 1.0 - record, record * (1.0 - vane), record * vane
    for state, channel in zip(range(5, 11), range(3, 9), strict=True):
        S[state, state], E[state, channel] = 1.0 - record, record
    return S, E


def _assembled(Fx: NDArray, Qx: NDArray, gamma: NDArray, Cy: NDArray, Dy: NDArray, level: float,
               gust: NDArray) -> Whitener:
    S, E = _sensors()
    C9, D9 = Cy[:9], Dy[:9]
    n, total = len(Fx), len(Fx) + 11
    F, spread = np.zeros((total, total)), np.zeros((total, n))
    F[:n, :n], F[n:, :n], F[n:, n:] = Fx, E @ C9 @ Fx, S
    spread[:n], spread[n:] = np.eye(n), E @ C9
    M = np.zeros((len(MOTION), total))
    order = {"airspeed": n, "alpha": n + 3, "beta": n + 4, "p": n + 5, "q": n + 6, "r": n + 7, "phi": 4, "theta": 5,
             "ax": n + 8, "ay": n + 9, "az": n + 10, "altitude": 0}  # fmt: skip
    for i, name in enumerate(MOTION):
        M[i, order[name]] = 1.0
    sizes = instruments.noise_sizes()
    sizes["altitude"] = sizes["pressure"] / 10.6 * math.sqrt(instruments.SLOW_EVERY)  # 10 Hz spread over 50 Hz
    R = np.diag([(level * sizes[name]) ** 2 for name in MOTION])
    Q = spread @ Qx @ spread.T + 1e-14 * np.eye(total)
    P = solve_discrete_are(F.T, M.T, Q, R)
    innovation = M @ P @ M.T + R
    K = F @ P @ M.T @ np.linalg.inv(innovation)
    starts = np.zeros((total, n))
    starts[:10, :10], starts[10:n, 10:] = np.diag(START), gust
    starts[n:] = np.linalg.solve(np.eye(11) - S, E @ C9) @ starts[:n]
    return Whitener(F, K, M, spread @ gamma, np.vstack([np.zeros((n, 5)), E @ D9]),
                    np.linalg.inv(np.linalg.cholesky(innovation)), starts)  # fmt: skip


@compiled
def _filtered(y: NDArray, drive: NDArray, x: NDArray, F: NDArray, K: NDArray, M: NDArray, root: NDArray) -> NDArray:
    out = np.empty_like(y)
    for k in range(y.shape[0]):
        e = y[k] - np.dot(M, x)
        out[k] = np.dot(root, e)
        x = np.dot(F, x) + np.dot(K, e) + drive[k]
    return out


def whiten(w: Whitener, y: NDArray, u: NDArray, x0: NDArray | None = None) -> NDArray:
    """Whitened innovations [samples * 12, columns] of departures y [samples, 12, columns], u [samples, 5, columns]."""
    mean = np.zeros_like(u)
    mean[:-1] = 0.5 * (u[1:] + u[:-1])
    end = np.zeros_like(u)
    end[:-1] = u[1:]
    drive = np.einsum("ij,kjc->kic", w.mean_in, mean) + np.einsum("ij,kjc->kic", w.end_in, end)
    x = np.zeros((len(w.F), y.shape[2]))  # the aircraft's states, then those of the gusts' kind
    if x0 is not None:
        x[: len(x0)] = x0
    arrays = [np.ascontiguousarray(a) for a in (y, drive, x, w.F, w.K, w.M, w.root)]
    return np.asarray(_filtered(*arrays)).reshape(-1, y.shape[2])


@compiled
def _follow(u: NDArray, start: NDArray, p: NDArray) -> NDArray:
    """Positions of the published actuators and spools behind recorded commands [samples, 5] (power over its top)."""
    out = np.empty((len(u), 5))
    x = start.copy()
    out[0] = x
    h = 0.005
    for k in range(1, len(u)):
        for _ in range(4):
            for j in range(3):
                mid = x[j]
                for share in (0.5, 1.0):  # midpoint rule
                    d = pl.surface(mid, 0.0, u[k, j], p[j, 0], p[j, 1], p[j, 2], p[j, 3], 0.0, 0.0)[0]
                    mid = x[j] + share * h * d
                x[j] = mid
            for j in range(3, 5):
                x[j] = u[k, j] + (x[j] - u[k, j]) * math.exp(-h / p[j, 0])
        out[k] = x
    return out


def paths(flown: Flown, level: float) -> NDArray:
    """Recorded positions, torque and thrust less what the published paths make of the commands [samples * 7]."""
    n = PUBLISHED
    p = np.array([[n[f"{s}_min"], n[f"{s}_max"], n[f"{s}_lag"], n[f"{s}_rate"]] for s in
                  ("elevator", "aileron", "rudder")] + [[n["spool_time"], 0, 0, 0]] * 2)  # fmt: skip
    row = airframe({"altitude_start": trim.ALTITUDE})
    full = n["power_rated"] * float(pl.air(trim.ALTITUDE, row[0])[1])
    y = flown.states
    expected = _follow(flown.commands, flown.commands[0].copy(), p)
    record = 1.0 - math.exp(-2.0 * math.pi * n["filter_frequency"] * pl.DT)
    slow = math.sqrt(instruments.SLOW_EVERY)
    sizes = instruments.noise_sizes()
    out = [(flown.channels[s] - instruments.low(expected[:, j], record)) / sizes[s]
           for j, s in enumerate(("elevator", "aileron", "rudder"))]
    per = n["propeller_efficiency"] / np.sqrt(flown.outputs[:, pl.VT] ** 2 + n["propeller_static_speed"] ** 2)
    for j, side in ((3, "left"), (4, "right")):
        power = y[:, INPUTS[j]]
        torque = (power - full * expected[:, j]) * 30.0 / (math.pi * n["propeller_rpm"])
        out.append(torque / sizes["torque_left"] / slow)
        out.append((flown.channels[f"thrust_{side}"] - power * per) / sizes["thrust_left"] / slow)
    return np.concatenate(out) / level
