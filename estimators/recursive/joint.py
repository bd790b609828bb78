"""State and parameters in one vector: what the extended and the unscented Kalman filter share.

Two vectors per aircraft: airspeed, alpha, q with the 9 parameters of drag, lift and pitch; and sideslip,
p - (Ixz/Ixx) r, r - (Ixz/Izz) p with the 17 of side force, roll and yaw. What one vector needs of the other's states it
takes as measured. The dynamics are the rows of `estimators.observer.rows` at the states of the vector, not at measured
ones: xdot = row(x)'theta + rest(x) + w, w white of density d^2, parameters wandering with k0 (scale)^2.
Measured are the three states (white noise of density n^2: variance n^2/dt a sample) and the accelerometers, as
0 = factor (row(x)'theta - felt(x)) + v.

Sources: Jazwinski, Stochastic Processes and Filtering Theory (1970), chapter 8, for parameters as states;
Schmidt's consider filter (Bierman 1977, chapter VIII) for parameters that a sample may not move: where excitation is
too small its gain on them is taken away, and the covariance is that of the gain then used.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.observer.excitation import hearing
from estimators.observer.layout import COUNT, FIRST, SEEN, seat
from estimators.observer.rows import force_rows, incidence, moment_rows
from icing_env.jit import block, kernel
from icing_env.types import MEASUREMENT

FIELDS = ("bandwidth",), ("d", "n", "q0", "k0")  # of both tunings: numbers, and those of each channel
PARAMETERS = (9, 17)  # of each vector, after its three states
OFFSET = (0, 9)  # first of them in PARAMETER_NAMES
AT = np.dtype([
    ("row", "f8", (26,)), ("rest", "f8", (6,)), ("y", "f8", (6,)), ("felt", "f8", (3,)), ("factor", "f8", (3,)),
])  # fmt: skip
MEMORY = np.dtype([
    *SEEN,
    ("x", "f8", (6,)),  # states of the first and of the second vector
    ("long", "f8", (12, 12)), ("lat", "f8", (20, 20)),  # covariances of the two vectors
    ("open", "f8", (26,)),  # how far this sample may move each parameter, 0..1
    ("before", MEASUREMENT), ("alpha_before", "f8"), ("beta_before", "f8"),  # the last sample, incidence corrected
    ("at", AT),  # rows at a state that is being tried
    ("row_kept", "f8", (26,)), ("jacobian", "f8", (6, 3)),  # of the channels by the vector's own states
    ("bends", "f8", (3, 26)),  # the rows by the vector's own states
    ("curve", "f8", (6, 2)),  # what products of state and parameter errors add to row'theta: variance and mean
    ("cross", "f8", (20,)), ("gain", "f8", (20,)), ("left", "f8", (20,)), ("slope", "f8", (3,)),
    ("wide", "f8", (3, 20)),  # scratch
    ("columns", "f8", (20, 3)), ("points", "f8", (7, 3)), ("try", "f8", (20,)),  # scratch of the unscented filter
])  # fmt: skip


def init(parameters: NDArray[np.void], tuning: NDArray[np.void], n: int, start: float = 1.0) -> NDArray[np.void]:
    """Memory of `n` filters that start at `start` times the clean aircraft (`MEMORY` array).

    parameters: structured array with the fields of AIRFRAME, one row or n rows. tuning: `TUNING` array of one row.
    """
    memory = np.zeros(n, MEMORY)
    spread = seat(memory, parameters, tuning, np.repeat(tuning["bandwidth"], 6), start)
    for name, first, count in zip(("long", "lat"), OFFSET, PARAMETERS, strict=True):
        index = np.arange(3, 3 + count)
        memory[name][:, index, index] = spread[:, first : first + count] ** 2
    return memory


@block
def rows_at(
    at: Any, m: Any, af: Any, axis: int, x0: float, x1: float, x2: float, alpha: float, beta: float
) -> None:  # fmt: skip
    """Fill `at` with the rows at the states (x0, x1, x2) of a vector; the rest as measured in `m`, alpha, beta."""
    if axis == 0:
        qbar = force_rows(at, m, af, x0, x1, beta, m["p"], x2, m["r"])
        moment_rows(at, m, af, qbar, x0, x1, beta, m["p"], x2, m["r"])
    else:
        xx, zz, xz = af["inertia_xx"], af["inertia_zz"], af["inertia_xz"]
        scale = 1.0 / (1.0 - xz * xz / (xx * zz))
        p, r = (x1 + xz / xx * x2) * scale, (x2 + xz / zz * x1) * scale
        qbar = force_rows(at, m, af, m["airspeed"], alpha, x0, p, m["q"], r)
        moment_rows(at, m, af, qbar, m["airspeed"], alpha, x0, p, m["q"], r)


@kernel
def product(row: Any, theta: Any, c: int) -> float:
    """row'theta of channel c."""
    total = 0.0
    for i in range(FIRST[c], FIRST[c] + COUNT[c]):
        total += row[i] * theta[i]
    return total


@block
def begin(ob: Any, tn: Any, p: Any, axis: int, dt: float) -> None:
    """Start a vector's states at the measurement: parameters keep their covariance, states know nothing of them."""
    for i in range(3):
        for j in range(3 + PARAMETERS[axis]):
            p[i, j], p[j, i] = 0.0, 0.0
        p[i, i] = tn["n"][3 * axis + i] ** 2 / dt
        ob["x"][3 * axis + i] = ob["y"][3 * axis + i]


@kernel
def open_for(ob: Any, tn: Any, excited: tuple[float, float, float, float]) -> None:
    """How far this sample may move each parameter. excited: shares of pitch, of turn, of lift and of side force."""
    shares = hearing(tn, excited, 1.0)
    for c in range(6):
        for i in range(FIRST[c], FIRST[c] + COUNT[c]):
            ob["open"][i] = shares[c]


@block
def wander(ob: Any, tn: Any, p: Any, axis: int, dt: float) -> None:
    """Add k0 (scale)^2 dt to the parameters' variances as far as they are open, never beyond the prior's."""
    for k in range(3):
        c = 3 * axis + k
        for i in range(FIRST[c], FIRST[c] + COUNT[c]):
            j, unit = 3 + i - OFFSET[axis], ob["scale"][i] * ob["scale"][i]
            p[j, j] += max(0.0, min(tn["k0"][c] * ob["open"][i] * dt * unit, unit / tn["q0"][c] - p[j, j]))


@block
def update(ob: Any, p: Any, axis: int, strength: float, residual: float) -> None:
    """One scalar measurement: ob["cross"] is its covariance with the vector, `strength` its own with noise.

    K_i = w_i c_i/S with w = 1 for states and `open` for parameters; P - K c' - (c - S K) K', positive for any K.
    """
    size, cross, gain, left = 3 + PARAMETERS[axis], ob["cross"], ob["gain"], ob["left"]
    inverse = 1.0 / strength
    for i in range(size):
        w = 1.0 if i < 3 else ob["open"][i + OFFSET[axis] - 3]
        gain[i] = w * cross[i] * inverse
        left[i] = (1.0 - w) * cross[i]
        if i < 3:
            ob["x"][3 * axis + i] += gain[i] * residual
        else:
            ob["theta"][i + OFFSET[axis] - 3] += gain[i] * residual
    for i in range(size):
        for j in range(i + 1):
            p[i, j] -= gain[i] * cross[j] + left[i] * gain[j]
            p[j, i] = p[i, j]


@block
def read_states(ob: Any, tn: Any, p: Any, axis: int, dt: float) -> None:
    """The three measured states of a vector, one after the other."""
    for k in range(3):
        for i in range(3 + PARAMETERS[axis]):
            ob["cross"][i] = p[i, k]
        residual = ob["y"][3 * axis + k] - ob["x"][3 * axis + k]
        update(ob, p, axis, p[k, k] + tn["n"][3 * axis + k] ** 2 / dt, residual)


@kernel
def remember_measurement(ob: Any, m: Any, af: Any, dt: float) -> None:
    """Keep this sample for the next step's first half."""
    ob["before"] = m
    ob["alpha_before"], ob["beta_before"] = incidence(m, af["vane_lag"], af["boom_gain"], dt)


@block
def settle(ob: Any) -> bool:
    """Write the parameters' standard deviations. False if a variance is not positive or an estimate not finite."""
    total = 0.0
    for i in range(6):
        total += ob["x"][i]
    for i in range(26):
        variance = ob["long"][3 + i, 3 + i] if i < OFFSET[1] else ob["lat"][3 + i - OFFSET[1], 3 + i - OFFSET[1]]
        if not variance > 0.0:
            return False
        ob["deviation"][i] = math.sqrt(variance)
        total += variance + ob["theta"][i]
    return math.isfinite(total)
