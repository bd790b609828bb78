"""Extended Kalman filter for states and parameters together; its vectors and dynamics: estimators.recursive.joint.

Prediction by Heun's rule with the inputs of the last sample and of this one; its Jacobian by states from differences,
by parameters the rows themselves. Products of an error of state with one of a parameter, which a first-order filter
takes for certain, add their variance P_xx row_x' P_theta row_x to xdot and to what the accelerometers should show, as
in the second-order filter (Jazwinski 1970, section 9.3): without it the first noise of a manoeuvre, met with parameters
known to a factor of two, throws them far off. Their mean, sum over i of (d row/dx_i)'P_theta,x_i, is added likewise:
without it noise in the states biases the parameters. Unlike the H-infinity observer it trusts its noise statistics:
where d and n are not those of the flight,
neither are its gain and its covariance (Ding et al., Acta Aerodyn. Sinica, 2016).
"""

from __future__ import annotations

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
    product,
    read_states,
    remember_measurement,
    rows_at,
    settle,
    update,
    wander,
)
from icing_env.jit import block, entry, kernel

STEPS = ((0.1, 1e-4, 1e-4), (1e-4, 1e-4, 1e-4))  # m/s, rad, rad/s: differences for the Jacobian (assumed)
default_tuning = Tuning("ekf", *FIELDS).default


@block
def predict(ob: Any, m: Any, af: Any, tn: Any, p: Any, axis: int, alpha: float, beta: float, dt: float) -> None:
    """Carry one vector and its covariance over a sample; leaves the rows at the predicted state in ob["at"].

    F = [I + dt J, dt row'; 0, I] with J of the sample before and the row in the mean of both.
    """
    at, x, theta, size = ob["at"], ob["x"], ob["theta"], 3 + PARAMETERS[axis]
    a, b = 3 * axis, OFFSET[axis] - 3
    bend(ob, p, axis)
    rows_at(at, ob["before"], af, axis, x[a], x[a + 1], x[a + 2], ob["alpha_before"], ob["beta_before"])
    for k in range(3):
        ob["slope"][k] = at["rest"][a + k] + product(at["row"], theta, a + k)
        for i in range(FIRST[a + k], FIRST[a + k] + COUNT[a + k]):
            ob["row_kept"][i] = at["row"][i]
    s = ob["slope"]
    rows_at(at, m, af, axis, x[a] + dt * s[0], x[a + 1] + dt * s[1], x[a + 2] + dt * s[2], alpha, beta)
    for k in range(3):
        c = a + k
        x[c] += 0.5 * dt * (s[k] + at["rest"][c] + product(at["row"], theta, c)) + dt * ob["curve"][c, 1]
        for j in range(size):
            total = p[k, j]
            for i in range(3):
                total += dt * ob["jacobian"][c, i] * p[i, j]
            for i in range(FIRST[c], FIRST[c] + COUNT[c]):
                total += 0.5 * dt * (ob["row_kept"][i] + at["row"][i]) * p[i - b, j]
            ob["wide"][k, j] = total
    spread(ob, tn, p, axis, dt)


@block
def spread(ob: Any, tn: Any, p: Any, axis: int, dt: float) -> None:
    """P = F P F' + Q from ob["wide"], the first three rows of F P."""
    at, wide, size = ob["at"], ob["wide"], 3 + PARAMETERS[axis]
    for k in range(3):
        c = 3 * axis + k
        for j in range(3):
            total = wide[j, k]
            for i in range(3):
                total += dt * ob["jacobian"][c, i] * wide[j, i]
            for i in range(FIRST[c], FIRST[c] + COUNT[c]):
                total += 0.5 * dt * (ob["row_kept"][i] + at["row"][i]) * wide[j, i - OFFSET[axis] + 3]
            p[j, k] = total
    for k in range(3):
        for j in range(k):
            p[k, j] = 0.5 * (p[k, j] + p[j, k])
            p[j, k] = p[k, j]
        for j in range(3, size):
            p[k, j], p[j, k] = wide[k, j], wide[k, j]
        c = 3 * axis + k
        p[k, k] += tn["d"][c] ** 2 * dt + ob["curve"][c, 0] * dt * dt
    wander(ob, tn, p, axis, dt)


@block
def differentiate(ob: Any, m: Any, af: Any, p: Any, axis: int, alpha: float, beta: float) -> None:
    """ob["jacobian"] of the channels, ob["wide"][:, :3] of the accelerometers' h by states, ob["curve"]; moves `at`.

    h = factor (row'theta - felt) is what an accelerometer is expected to differ by from what it shows. On return
    ob["wide"][k, 3] is h of channel k's accelerometer, ob["row_kept"] the row and ob["cross"][k] the factor.
    """
    at, x, theta, a = ob["at"], ob["x"], ob["theta"], 3 * axis
    for k in range(3):
        c = a + k
        ob["slope"][k] = at["rest"][c] + product(at["row"], theta, c)
        if ACCELEROMETER[c] >= 0:
            ob["cross"][k] = at["factor"][ACCELEROMETER[c]]
            ob["wide"][k, 3] = ob["cross"][k] * (product(at["row"], theta, c) - at["felt"][ACCELEROMETER[c]])
        for i in range(FIRST[c], FIRST[c] + COUNT[c]):
            ob["row_kept"][i] = at["row"][i]
    for i in range(3):
        step = STEPS[axis][i]
        d0, d1, d2 = step if i == 0 else 0.0, step if i == 1 else 0.0, step if i == 2 else 0.0
        rows_at(at, m, af, axis, x[a] + d0, x[a + 1] + d1, x[a + 2] + d2, alpha, beta)
        for k in range(3):
            c = a + k
            ob["jacobian"][c, i] = (at["rest"][c] + product(at["row"], theta, c) - ob["slope"][k]) / step
            if ACCELEROMETER[c] >= 0:
                g = ACCELEROMETER[c]
                h = at["factor"][g] * (product(at["row"], theta, c) - at["felt"][g])
                ob["wide"][k, i] = (h - ob["wide"][k, 3]) / step
            for j in range(FIRST[c], FIRST[c] + COUNT[c]):
                ob["bends"][i, j] = (at["row"][j] - ob["row_kept"][j]) / step
    bend(ob, p, axis)


@block
def bend(ob: Any, p: Any, axis: int) -> None:
    """ob["curve"]: variance and mean that products of state and parameter errors add to row'theta of each channel."""
    bends, b = ob["bends"], OFFSET[axis] - 3
    for k in range(3):
        c = 3 * axis + k
        variance, mean = 0.0, 0.0
        for i in range(3):
            for j in range(FIRST[c], FIRST[c] + COUNT[c]):
                mean += bends[i, j] * p[j - b, i]
                for n in range(FIRST[c], FIRST[c] + COUNT[c]):
                    variance += bends[i, j] * bends[i, n] * p[j - b, n - b] * p[i, i]
        ob["curve"][c, 0], ob["curve"][c, 1] = variance, mean


@block
def feel(ob: Any, tn: Any, p: Any, axis: int, dt: float) -> None:
    """The accelerometers of a vector, one after the other, about the predicted state."""
    size, theta = 3 + PARAMETERS[axis], ob["theta"]
    factors = (ob["cross"][0], ob["cross"][1], ob["cross"][2])
    x0, x1, x2 = ob["x"][3 * axis], ob["x"][3 * axis + 1], ob["x"][3 * axis + 2]
    for k in range(3):
        ob["slope"][k] = product(ob["row_kept"], theta, 3 * axis + k)
    for k in range(3):
        c = 3 * axis + k
        g = ACCELEROMETER[c]
        if g < 0:
            continue
        moved = (ob["x"][3 * axis] - x0, ob["x"][3 * axis + 1] - x1, ob["x"][3 * axis + 2] - x2)
        h = ob["wide"][k, 3] + factors[k] * (product(ob["row_kept"], theta, c) - ob["slope"][k] + ob["curve"][c, 1])
        for i in range(3):
            h += ob["wide"][k, i] * moved[i]
        strength = tn["accelerometer"][g] ** 2 / dt + factors[k] * factors[k] * ob["curve"][c, 0]
        for j in range(size):
            total = 0.0
            for i in range(3):
                total += ob["wide"][k, i] * p[i, j]
            for i in range(FIRST[c], FIRST[c] + COUNT[c]):
                total += factors[k] * ob["row_kept"][i] * p[i - OFFSET[axis] + 3, j]
            ob["cross"][j] = total
        for i in range(3):
            strength += ob["wide"][k, i] * ob["cross"][i]
        for i in range(FIRST[c], FIRST[c] + COUNT[c]):
            strength += factors[k] * ob["row_kept"][i] * ob["cross"][i - OFFSET[axis] + 3]
        update(ob, p, axis, strength, -h)


@block
def advance(ob: Any, m: Any, af: Any, tn: Any, p: Any, axis: int, alpha: float, beta: float, dt: float) -> None:
    """One vector over one sample: predict, feel, read."""
    predict(ob, m, af, tn, p, axis, alpha, beta, dt)
    differentiate(ob, m, af, p, axis, alpha, beta)
    feel(ob, tn, p, axis, dt)
    read_states(ob, tn, p, axis, dt)


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
        advance(ob, m, af, tn, ob["long"], 0, alpha, beta, dt)
        advance(ob, m, af, tn, ob["lat"], 1, alpha, beta, dt)
        good = settle(ob)
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


METHOD = runs.Method("extended Kalman filter", init, step, default_tuning, own_errors=True,
                     left_out={"CL_elevator": 0.1})  # fmt: skip
identify = partial(runs.identify, METHOD)
