"""The recursive H-infinity identifier: six decoupled channels, one row of memory per aircraft, compiled.

Each call of `step` takes one sample of measurements per aircraft and returns estimates of the aerodynamic
coefficients with their uncertainty. `hinf_channel` has the mathematics, `hinf_rows` the flight mechanics,
`configs/estimators/hinf.toml` the tuning. The identifier sees measurements and the clean airframe, never truth.

A standard error is the square root of the diagonal of B3: one standard deviation of the estimate if the
unmodelled accelerations and the measurement errors are white with the densities d^2, n^2 and n_a^2 of the tuning.
A finite gamma inflates it, by at most (1 - gamma^-2)^(-1/2).

The moment and side-force channels learn, and their parameters are allowed to wander, only as far as pilot or
autopilot move the aircraft: gusts alone would drag them towards a false ice alarm. Drag and lift are always live.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import literal_unroll

from estimators.airframe import airframe_from
from estimators.hinf_channel import filter_step, forget, learn
from estimators.hinf_excitation import excite, gate, shares
from estimators.hinf_rows import clean_zero_lift_drag, force_rows, moment_rows, readable
from icing_env.jit import entry, kernel
from icing_env.types import ESTIMATED_NAMES

STD_NAMES = tuple(f"{name}_std" for name in ESTIMATED_NAMES)

# First parameter and number of parameters of each channel in ESTIMATED_NAMES, first element in the packed B3.
FIRST = (0, 1, 4, 8, 12, 18)
COUNT = (1, 3, 4, 4, 6, 6)
PACKED = (0, 1, 7, 17, 27, 48)
DIAGONAL = tuple(PACKED[c] + i * (i + 1) // 2 + i for c in range(6) for i in range(COUNT[c]))

OBSERVER = np.dtype([
    ("theta", "f8", (24,)),  # estimates, in the order of ESTIMATED_NAMES
    ("b3", "f8", (69,)),  # their covariance: lower triangles of the six channels
    ("scale", "f8", (24,)),  # size of each parameter, for q0 and k0
    ("filtered", "f8", (24,)),  # f, the regressors behind the observer's filter
    ("zeta", "f8", (6,)),  # the rest of the dynamics behind the same filter
    ("row", "f8", (24,)), ("row_before", "f8", (24,)),  # regressors now and a sample ago
    ("rest", "f8", (6,)), ("rest_before", "f8", (6,)),  # b now and a sample ago
    ("y", "f8", (6,)), ("y_before", "f8", (6,)),  # measured states now and a sample ago
    ("accelerometer", "f8", (3,)), ("factor", "f8", (3,)),  # see hinf_rows
    ("gain", "f8", (6,)),  # scratch
    ("mean", "f8", (7,)), ("energy", "f8", (5,)),  # of the excitation measures
    ("excess_drag", "f8"),
    ("seated", "f8"),  # 0: the next readable sample starts the filters
    ("failed", "f8"),  # 1: a matrix lost its positive definiteness; estimates are held from then on
])  # fmt: skip


def clean_values(airframe: np.ndarray) -> np.ndarray:
    """Coefficients of the clean aircraft in the order of ESTIMATED_NAMES, shape (rows, 24).

    From the body-axis set: CL_0 = -CZ_0, CL_alpha = CX_0 - CZ_alpha (slope at alpha = 0), CL_elevator = -CZ_elevator.
    """
    af = airframe_from(airframe)
    alpha = af["CZ_0"] / (af["CX_0"] - af["CZ_alpha"])
    drag = -(af["CX_0"] + alpha * (af["CX_alpha"] + alpha * af["CX_alpha2"])) / np.cos(alpha)
    own = {"CD_0": drag, "CL_0": -af["CZ_0"], "CL_alpha": af["CX_0"] - af["CZ_alpha"], "CL_elevator": -af["CZ_elevator"]}
    zero = np.zeros(len(af))
    names = af.dtype.names or ()
    return np.stack([own.get(n, af[n] if n in names else zero) for n in ESTIMATED_NAMES], axis=1)


def init(parameters: np.ndarray, tuning: np.ndarray, n: int, start: float = 1.0) -> np.ndarray:
    """Memory of `n` observers that start at `start` times the clean aircraft (`OBSERVER` array).

    parameters: structured array with the fields of AIRFRAME, one row or n rows. tuning: `TUNING` array of one row.
    """
    clean = clean_values(parameters)
    observer = np.zeros(n, OBSERVER)
    observer["theta"] = start * clean
    observer["scale"] = np.maximum(np.abs(clean), tuning["smallest_scale"][0])
    for channel in range(6):
        for i in range(COUNT[channel]):
            diagonal = PACKED[channel] + i * (i + 1) // 2 + i
            observer["b3"][:, diagonal] = observer["scale"][:, FIRST[channel] + i] ** 2 / tuning["q0"][0, channel]
    return observer


@kernel
def advance_filters(ob, tn, dt):  # type: ignore[no-untyped-def]
    """f and zeta of every channel over one sample (RK4), then the rows of now become those of a sample ago."""
    for channel in range(6):
        rate = tn["d"][channel] / tn["n"][channel]
        for i in range(FIRST[channel], FIRST[channel] + COUNT[channel]):
            ob["filtered"][i] = filter_step(ob["filtered"][i], ob["row_before"][i], ob["row"][i], rate, dt)
        before = ob["rest_before"][channel] + rate * ob["y_before"][channel]
        now = ob["rest"][channel] + rate * ob["y"][channel]
        ob["zeta"][channel] = filter_step(ob["zeta"][channel], before, now, rate, dt)


@kernel
def remember(ob, seat):  # type: ignore[no-untyped-def]
    """Keep this sample's rows; with `seat`, start the filters here: xhat = y, nothing filtered yet."""
    for i in range(24):
        ob["row_before"][i] = ob["row"][i]
        if seat:
            ob["filtered"][i] = 0.0
    for i in range(6):
        ob["rest_before"][i], ob["y_before"][i] = ob["rest"][i], ob["y"][i]
        if seat:
            ob["zeta"][i] = ob["y"][i]


@kernel
def learn_channel(ob, tn, channel, accelerometer, information, wander, wander_first, kappa):  # type: ignore[no-untyped-def]
    """One sample of one channel: state row, accelerometer row (its index, or -1), wandering. False at a failure."""
    first, packed, m = FIRST[channel], PACKED[channel], COUNT[channel]
    theta, b3, gain = ob["theta"], ob["b3"], ob["gain"]
    n = tn["n"][channel]
    good = learn(theta, b3, gain, first, packed, m, ob["filtered"], 1.0,
                 ob["y"][channel] - ob["zeta"][channel], information / (n * n), kappa)
    if accelerometer >= 0:
        n = tn["accelerometer"][accelerometer]
        good = learn(theta, b3, gain, first, packed, m, ob["row"], ob["factor"][accelerometer],
                     ob["accelerometer"][accelerometer], information / (n * n), kappa) and good
    k0 = tn["k0"][channel]
    forget(b3, ob["scale"], first, packed, m, k0 * wander, k0 * wander_first, tn["q0"][channel])
    return good


@kernel
def learn_all(ob, tn, longitudinal, lateral, lively, dt):  # type: ignore[no-untyped-def]
    """All six channels over one sample. Gated channels take in, and wander, only as far as they are excited."""
    kappa = 1.0 - 1.0 / (tn["gamma"] * tn["gamma"])
    pitching = dt * gate(longitudinal, tn["share_low"], tn["share_high"])
    turning = dt * gate(lateral, tn["share_low"], tn["share_high"])
    lifting = dt * (lively if tn["share_high"] > 0.0 else 1.0)
    good = learn_channel(ob, tn, 0, 0, dt, dt, dt, kappa)
    good = learn_channel(ob, tn, 1, 1, dt, lifting, dt, kappa) and good
    good = learn_channel(ob, tn, 2, -1, pitching, pitching, pitching, kappa) and good
    good = learn_channel(ob, tn, 3, 2, turning, turning, turning, kappa) and good
    good = learn_channel(ob, tn, 4, -1, turning, turning, turning, kappa) and good
    return learn_channel(ob, tn, 5, -1, turning, turning, turning, kappa) and good


@kernel
def healthy(ob) -> bool:  # type: ignore[no-untyped-def]
    """True while every estimate is finite and every variance positive."""
    total = 0.0
    lowest = 1.0
    for channel in range(6):
        for i in range(COUNT[channel]):
            variance = ob["b3"][PACKED[channel] + i * (i + 1) // 2 + i]
            total += variance + ob["theta"][FIRST[channel] + i]
            lowest = min(lowest, variance)
    return lowest > 0.0 and math.isfinite(total)


@kernel
def report(ob, est, longitudinal, lateral):  # type: ignore[no-untyped-def]
    """Write estimates, standard errors, excess drag and excitation; health is 1."""
    i = 0
    for name in literal_unroll(ESTIMATED_NAMES):
        est[name] = ob["theta"][i]
        i += 1
    i = 0
    for name in literal_unroll(STD_NAMES):
        est[name] = math.sqrt(ob["b3"][DIAGONAL[i]])
        i += 1
    est["excess_drag"] = ob["excess_drag"]
    est["excitation_longitudinal"], est["excitation_lateral"] = longitudinal, lateral
    est["health"] = 1.0


@kernel
def observe(ob, est, m, af, tn, dt):  # type: ignore[no-untyped-def]
    """One aircraft, one sample. See `step`."""
    est["health"] = 0.0
    if ob["failed"] > 0.0:
        return
    if not readable(m):
        ob["seated"] = 0.0
        return
    moment_rows(ob, m, af, force_rows(ob, m, af))
    excite(ob, m, af, tn["window"], dt)
    longitudinal, lateral, lively = shares(ob, tn, af)
    if ob["seated"] > 0.0:
        advance_filters(ob, tn, dt)
        good = learn_all(ob, tn, longitudinal, lateral, lively, dt)
        if not (good and healthy(ob)):
            ob["failed"] = 1.0
            return
        excess = ob["theta"][0] - clean_zero_lift_drag(af)
        ob["excess_drag"] += min(1.0, dt / tn["drag_smoothing"]) * (excess - ob["excess_drag"])
    remember(ob, ob["seated"] == 0.0)
    ob["seated"] = 1.0
    report(ob, est, longitudinal, lateral)


@entry
def step(observer: Any, estimate: Any, measurement: Any, airframe: Any, tuning: Any, dt: float) -> None:
    """Advance `n` observers by one sample of `dt` seconds, in place.

    observer (OBSERVER), estimate (ESTIMATE), measurement (MEASUREMENT): n rows each. airframe: one row or n rows,
    any structured type that has the fields of AIRFRAME. tuning: one row of TUNING.
    The first sample starts the state estimates at the measurement. A sample with a NaN leaves estimates and
    memory as they are, reports health 0, and the filters start again at the next readable one. Health stays 0
    after a finite escape (gamma below gamma* = 1) until `init`.
    """
    for i in range(len(observer)):
        observe(observer[i], estimate[i], measurement[i], airframe[i if len(airframe) > 1 else 0], tuning[0], dt)
