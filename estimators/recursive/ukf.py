"""Unscented Kalman filter for states and parameters together; the vectors and dynamics: estimators.recursive.joint.

Sigma points x +- sqrt(N) L_j with L the lower Cholesky factor of P and equal weights 1/(2N), without a central one
(Julier and Uhlmann, Proc. IEEE 92, 2004, with kappa = 0; the cubature rule of Arasaratnam and Haykin, IEEE TAC 54,
2009). The states come first in the vector, so that only the first three columns of L move them, and the dynamics are
linear in the parameters at a given state: seven states are evaluated instead of 2N, and the sums over all other points
need no more of L than its first three columns, as sum over j > 3 of L_j L_j' = P - L_1 L_1' - L_2 L_2' - L_3 L_3'.
The measured states are linear in the vector and need no points.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from estimators.observer import record as runs
from estimators.observer.layout import ACCELEROMETER, COUNT, FIRST
from estimators.observer.rows import incidence
from estimators.observer.sample import close_sample, open_sample
from estimators.observer.tuning import Tuning
from estimators.recursive.joint import (
    FIELDS,
    OFFSET,
    PARAMETERS,
    begin,
    init,
    open_for,
    read_states,
    remember_measurement,
    rows_at,
    settle,
    update,
    wander,
)
from icing_env.jit import block, entry, kernel

default_tuning = Tuning("ukf", *FIELDS).default


@block
def factorise(ob: Any, p: Any, size: int) -> bool:
    """First three columns of the lower Cholesky factor of P, into ob["columns"]. False if a pivot is not positive."""
    low = ob["columns"]
    for j in range(3):
        total = p[j, j]
        for k in range(j):
            total -= low[j, k] * low[j, k]
        if not total > 0.0:
            return False
        low[j, j] = math.sqrt(total)
        inverse = 1.0 / low[j, j]
        for i in range(j + 1, size):
            total = p[i, j]
            for k in range(j):
                total -= low[i, k] * low[j, k]
            low[i, j] = total * inverse
    return True


@kernel
def place(ob: Any, axis: int, s: int) -> None:
    """ob["try"] = sigma point s, states and parameters: the mean (s = 0), or off it along one of three columns."""
    j, sign = (s + 1) // 2 - 1, 1.0 if s % 2 == 1 else -1.0
    size = 3 + PARAMETERS[axis]
    root = sign * math.sqrt(float(size))
    for i in range(size):
        centre = ob["x"][3 * axis + i] if i < 3 else ob["theta"][i + OFFSET[axis] - 3]
        ob["try"][i] = centre + (root * ob["columns"][i, j] if s > 0 and i >= j else 0.0)


@block
def others(ob: Any, p: Any, row: Any, axis: int, c: int, k: int) -> None:
    """ob["wide"][k, 3:] = M row of channel c, M the covariance of the parameters given the states."""
    low, wide, size, b = ob["columns"], ob["wide"], 3 + PARAMETERS[axis], OFFSET[axis] - 3
    w0, w1, w2 = 0.0, 0.0, 0.0
    for i in range(FIRST[c], FIRST[c] + COUNT[c]):
        w0, w1, w2 = w0 + row[i] * low[i - b, 0], w1 + row[i] * low[i - b, 1], w2 + row[i] * low[i - b, 2]
    for j in range(3, size):
        wide[k, j] = -(w0 * low[j, 0] + w1 * low[j, 1] + w2 * low[j, 2])
    for i in range(FIRST[c], FIRST[c] + COUNT[c]):
        for j in range(3, size):
            wide[k, j] += row[i] * p[i - b, j]


@kernel
def meet(ob: Any, row: Any, axis: int, c: int, k: int) -> float:
    """row' of channel c with ob["wide"][k]."""
    total = 0.0
    for i in range(FIRST[c], FIRST[c] + COUNT[c]):
        total += row[i] * ob["wide"][k, i - OFFSET[axis] + 3]
    return total


@kernel
def tried(ob: Any, row: Any, axis: int, c: int) -> float:
    """row' of channel c with the parameters of the point in ob["try"]."""
    total = 0.0
    for i in range(FIRST[c], FIRST[c] + COUNT[c]):
        total += row[i] * ob["try"][i - OFFSET[axis] + 3]
    return total


@block
def carry(ob: Any, m: Any, af: Any, axis: int, s: int, alpha: float, beta: float, dt: float) -> None:
    """Carry sigma point s over a sample by Heun's rule into ob["points"][s]; of the mean, keep the row over dt."""
    at, point, a = ob["at"], ob["try"], 3 * axis
    place(ob, axis, s)
    rows_at(at, ob["before"], af, axis, point[0], point[1], point[2], ob["alpha_before"], ob["beta_before"])
    for k in range(3):
        ob["slope"][k] = at["rest"][a + k] + tried(ob, at["row"], axis, a + k)
        for i in range(FIRST[a + k], FIRST[a + k] + COUNT[a + k]):
            if s == 0:
                ob["row_kept"][i] = 0.5 * dt * at["row"][i]
    f = ob["slope"]
    rows_at(at, m, af, axis, point[0] + dt * f[0], point[1] + dt * f[1], point[2] + dt * f[2], alpha, beta)
    for k in range(3):
        c = a + k
        ob["points"][s, k] = point[k] + 0.5 * dt * (f[k] + at["rest"][c] + tried(ob, at["row"], axis, c))
        for i in range(FIRST[c], FIRST[c] + COUNT[c]):
            if s == 0:
                ob["row_kept"][i] += 0.5 * dt * at["row"][i]


@block
def predict(ob: Any, m: Any, af: Any, tn: Any, p: Any, axis: int, alpha: float, beta: float, dt: float) -> bool:
    """Carry one vector and its covariance over a sample. False if P is not positive definite."""
    size = 3 + PARAMETERS[axis]
    if not factorise(ob, p, size):
        return False
    low, points, weight = ob["columns"], ob["points"], 0.5 / size
    root = math.sqrt(float(size))
    for s in range(7):
        carry(ob, m, af, axis, s, alpha, beta, dt)
    for k in range(3):
        total = (2.0 * size - 6.0) * points[0, k]
        for s in range(1, 7):
            total += points[s, k]
        ob["slope"][k] = weight * total
        others(ob, p, ob["row_kept"], axis, 3 * axis + k, k)
    mean = ob["slope"]
    for k in range(3):
        ob["x"][3 * axis + k] = mean[k]
        for i in range(k + 1):
            total = (2.0 * size - 6.0) * (points[0, k] - mean[k]) * (points[0, i] - mean[i])
            for s in range(1, 7):
                total += (points[s, k] - mean[k]) * (points[s, i] - mean[i])
            total = weight * total + meet(ob, ob["row_kept"], axis, 3 * axis + i, k)
            p[k, i], p[i, k] = total, total
        p[k, k] += tn["d"][3 * axis + k] ** 2 * dt
        for i in range(3, size):
            total = 0.0
            for j in range(3):
                total += (points[2 * j + 1, k] - points[2 * j + 2, k]) * low[i, j]
            total = weight * root * total + ob["wide"][k, i]
            p[k, i], p[i, k] = total, total
    wander(ob, tn, p, axis, dt)
    return True


@block
def feel(ob: Any, m: Any, af: Any, tn: Any, p: Any, c: int, alpha: float, beta: float, dt: float) -> bool:
    """The accelerometer of channel c, by sigma points. False if P is not positive definite."""
    axis, g = c // 3, ACCELEROMETER[c]
    size, at, point = 3 + PARAMETERS[axis], ob["at"], ob["try"]
    if not factorise(ob, p, size):
        return False
    low, weight, h = ob["columns"], 0.5 / size, ob["points"]
    factor, certain = 0.0, 0.0
    for s in range(7):
        place(ob, axis, s)
        rows_at(at, m, af, axis, point[0], point[1], point[2], alpha, beta)
        h[s, 0] = at["factor"][g] * (tried(ob, at["row"], axis, c) - at["felt"][g])
        if s == 0:
            factor = at["factor"][g]
            others(ob, p, at["row"], axis, c, 0)
            certain = factor * factor * meet(ob, at["row"], axis, c, 0)
    mean = (2.0 * size - 6.0) * h[0, 0]
    for s in range(1, 7):
        mean += h[s, 0]
    mean *= weight
    strength = (2.0 * size - 6.0) * (h[0, 0] - mean) ** 2
    for s in range(1, 7):
        strength += (h[s, 0] - mean) ** 2
    root = math.sqrt(float(size))
    for i in range(size):
        total = 0.0
        for j in range(min(3, i + 1)):
            total += (h[2 * j + 1, 0] - h[2 * j + 2, 0]) * low[i, j]
        ob["cross"][i] = weight * root * total + (factor * ob["wide"][0, i] if i >= 3 else 0.0)
    update(ob, p, axis, weight * strength + certain + tn["accelerometer"][g] ** 2 / dt, -mean)
    return True


@block
def advance(ob: Any, m: Any, af: Any, tn: Any, p: Any, axis: int, alpha: float, beta: float, dt: float) -> bool:
    """One vector over one sample: predict, feel, read. False if P lost its positive definiteness."""
    if not predict(ob, m, af, tn, p, axis, alpha, beta, dt):
        return False
    for c in range(3 * axis, 3 * axis + 3):
        if ACCELEROMETER[c] >= 0 and not feel(ob, m, af, tn, p, c, alpha, beta, dt):
            return False
    read_states(ob, tn, p, axis, dt)
    return True


@kernel
def observe(ob: Any, est: Any, m: Any, af: Any, tn: Any, dt: float) -> None:
    """One aircraft, one sample. See `step`."""
    readable, excited = open_sample(ob, est, m, af, tn, dt)
    if not readable:
        return
    good = True
    if ob["seated"] > 0.0:
        open_for(ob, tn, excited)
        alpha, beta = incidence(m, af["vane_lag"], af["boom_gain"], dt)
        good = advance(ob, m, af, tn, ob["long"], 0, alpha, beta, dt)
        good = good and advance(ob, m, af, tn, ob["lat"], 1, alpha, beta, dt)
        good = good and settle(ob)
    else:
        begin(ob, tn, ob["long"], 0, dt)
        begin(ob, tn, ob["lat"], 1, dt)
    remember_measurement(ob, m, af, dt)
    close_sample(ob, est, af, tn, good, excited, dt)


@entry
def step(memory: Any, estimate: Any, measurement: Any, airframe: Any, tuning: Any, dt: float) -> None:
    """Advance `n` filters by one sample of `dt` seconds, in place; arguments as `estimators.hinf.step` has them.

    A sample with a NaN leaves estimates as they are, reports health 0, and the states start again at the next readable
    one.
    """
    for i in range(len(memory)):
        observe(memory[i], estimate[i], measurement[i], airframe[i if len(airframe) > 1 else 0], tuning[0], dt)


METHOD = runs.Method("unscented Kalman filter", init, step, default_tuning, own_errors=True, left_out={})
identify = partial(runs.identify, METHOD)
