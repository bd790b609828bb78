"""Recursive least squares with forgetting, in square-root information form, on matched filters.

Each channel keeps an upper triangular R and a vector z with R'R its information and R thetahat = z. A row of data, over
its noise, is rotated into them (Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapter V):
nothing is squared or inverted, so R'R cannot lose its positive definiteness. Rows are those of the H-infinity observer,
regressors and derivative behind the same filter; without forgetting the two agree at gamma = infinity.

Forgetting multiplies R and z by exp(-dt/(2 memory)), only while the channel is excited, and puts back in turn what the
prior's weight lost, about the present estimate: the information of a direction that is no longer excited falls to the
prior's and not to nothing.

The variance of an estimate is s^2 g (R'R)^-1: s^2 the mean square of the rotated residuals, which makes the scale of
the tuning's noise immaterial, and g = (1 + rho)/(1 - rho) for residuals that follow one another with correlation rho
(variance of a mean of a first-order process; Klein and Morelli, section 5.2, correct for the same in batch).
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.observer import record as runs
from estimators.observer.excitation import hearing
from estimators.observer.layout import ACCELEROMETER, COUNT, DIAGONAL, FIRST, PACKED, SEEN, seat
from estimators.observer.sample import close_sample, open_sample
from estimators.observer.tuning import Tuning
from icing_env.jit import block, entry, kernel

default_tuning = Tuning("rls", per_channel=("memory", "bandwidth", "n", "q0")).default
MEMORY = np.dtype([
    *SEEN,
    ("root", "f8", (78,)),  # R of the six channels, column by column
    ("z", "f8", (26,)),
    ("square", "f8", (6,)), ("lagged", "f8", (6,)),  # mean square of the rotated residuals, and at a lag of one sample
    ("residual", "f8", (6,)),  # of the sample before
    ("samples", "f8"),  # taken in so far
    ("work", "f8", (6,)),  # scratch
])  # fmt: skip
STEADIEST = 0.99  # largest correlation that is believed of residuals (assumed: g is then 199)


def init(parameters: NDArray[np.void], tuning: NDArray[np.void], n: int, start: float = 1.0) -> NDArray[np.void]:
    """Memory of `n` identifiers that start at `start` times the clean aircraft (`MEMORY` array).

    parameters: structured array with the fields of AIRFRAME, one row or n rows. tuning: `TUNING` array of one row.
    """
    memory = np.zeros(n, MEMORY)
    spread = seat(memory, parameters, tuning, tuning["bandwidth"][0], start)
    memory["root"][:, DIAGONAL] = 1.0 / spread
    memory["z"] = memory["theta"] / spread
    memory["square"] = 1.0
    return memory


@block
def rotate(root: Any, z: Any, work: Any, first: int, packed: int, m: int, target: float) -> float:
    """Rotate the row work[:m] theta = target (unit variance) into R and z by Givens rotations; work is destroyed.

    Returns the rotated residual, whose square is what the row adds to the sum of squares. root: (78,), z: (26,).
    """
    for i in range(m):
        if work[i] != 0.0:
            ii = packed + i * (i + 1) // 2 + i
            length = math.sqrt(root[ii] * root[ii] + work[i] * work[i])
            c, s = root[ii] / length, work[i] / length
            root[ii] = length
            for j in range(i + 1, m):
                ij = packed + j * (j + 1) // 2 + i
                above = root[ij]
                root[ij] = c * above + s * work[j]
                work[j] = c * work[j] - s * above
            above = z[first + i]
            z[first + i] = c * above + s * target
            target = c * target - s * above
    return target


@block
def solve(ob: Any, first: int, packed: int, m: int, inflation: float) -> bool:
    """Estimates and standard deviations of a channel from its R and z. False if R is singular or not finite.

    Variances are the squared lengths of the rows of R^-1, built column by column.
    """
    root, z, theta, deviation, column = ob["root"], ob["z"], ob["theta"], ob["deviation"], ob["work"]
    for i in range(m):
        if not (math.isfinite(z[first + i]) and root[packed + i * (i + 1) // 2 + i] > 0.0):
            return False
    for i in range(m - 1, -1, -1):
        total = z[first + i]
        for j in range(i + 1, m):
            total -= root[packed + j * (j + 1) // 2 + i] * theta[first + j]
        theta[first + i] = total / root[packed + i * (i + 1) // 2 + i]
        deviation[first + i] = 0.0
    for k in range(m):
        for i in range(k, -1, -1):
            total = 1.0 if i == k else 0.0
            for j in range(i + 1, k + 1):
                total -= root[packed + j * (j + 1) // 2 + i] * column[j]
            column[i] = total / root[packed + i * (i + 1) // 2 + i]
            deviation[first + i] += column[i] * column[i]
    for i in range(m):
        deviation[first + i] = math.sqrt(inflation * deviation[first + i])
    return True


@kernel
def take(ob: Any, c: int, factor: float, target: float, information: float) -> float:
    """Rotate a channel's filtered row, times `factor`, into it with weight `information`; the rotated residual."""
    weight = math.sqrt(information)
    for i in range(COUNT[c]):
        ob["work"][i] = weight * factor * ob["filtered"][FIRST[c] + i]
    return float(rotate(ob["root"], ob["z"], ob["work"], FIRST[c], PACKED[c], COUNT[c], weight * target))


@kernel
def let_go(ob: Any, tn: Any, c: int, heard: float) -> None:
    """Forget over `heard` seconds of excited flight, and put back the prior's share for one parameter, in turn."""
    first, packed, m = FIRST[c], PACKED[c], COUNT[c]
    keep = math.exp(-0.5 * heard / tn["memory"][c])
    for k in range(packed, packed + m * (m + 1) // 2):
        ob["root"][k] *= keep
    for i in range(m):
        ob["z"][first + i] *= keep
        ob["work"][i] = 0.0
    i = int(ob["samples"]) % m
    ob["work"][i] = math.sqrt(m * (1.0 - keep * keep) * tn["q0"][c]) / ob["scale"][first + i]
    rotate(ob["root"], ob["z"], ob["work"], first, packed, m, ob["work"][i] * ob["theta"][first + i])


@kernel
def judge(ob: Any, tn: Any, c: int, residual: float, heard: float) -> float:
    """Factor s^2 (1 + rho)/(1 - rho) of a channel's variances, after this sample's rotated residual."""
    share = max(heard / tn["memory"][c], 1.0 / (1.0 + ob["samples"]) if heard > 0.0 else 0.0)
    ob["square"][c] += share * (residual * residual - ob["square"][c])
    ob["lagged"][c] += share * (residual * ob["residual"][c] - ob["lagged"][c])
    ob["residual"][c] = residual
    rho = min(STEADIEST, max(0.0, ob["lagged"][c] / max(ob["square"][c], 1e-300)))
    return float(ob["square"][c] * (1.0 + rho) / (1.0 - rho))


@kernel
def learn(ob: Any, tn: Any, excited: tuple[float, float, float, float], dt: float) -> bool:
    """All six channels over one sample. False if any of them failed. excited: shares of pitch, turn, lift and side."""
    heard = hearing(tn, excited, dt)
    good = True
    for c in range(6):
        let_go(ob, tn, c, heard[c])
        target = ob["y"][c] - ob["zeta"][c]
        residual = take(ob, c, 1.0, target, heard[c] / (tn["n"][c] * tn["n"][c]))
        a = ACCELEROMETER[c]
        if a >= 0:
            factor = ob["factor"][a] * ob["bandwidth"][c]
            information = heard[c] / (tn["accelerometer"][a] * tn["accelerometer"][a])
            residual = take(ob, c, factor, ob["felt_filtered"][a] * factor, information)
        good &= solve(ob, FIRST[c], PACKED[c], COUNT[c], judge(ob, tn, c, residual, heard[c]))
    ob["samples"] += 1.0
    return good


@kernel
def observe(ob: Any, est: Any, m: Any, af: Any, tn: Any, dt: float) -> None:
    """One aircraft, one sample. See `step`."""
    readable, excited = open_sample(ob, est, m, af, tn, dt)
    if not readable:
        return
    good = True
    if ob["seated"] > 0.0:
        good = learn(ob, tn, excited, dt)
    close_sample(ob, est, af, tn, good, excited, dt)


@entry
def step(memory: Any, estimate: Any, measurement: Any, airframe: Any, tuning: Any, dt: float) -> None:
    """Advance `n` identifiers by one sample of `dt` seconds, in place; arguments as `estimators.hinf.step` has them.

    A sample with a NaN leaves estimates as they are, reports health 0, and the filters start again at the next
    readable one.
    """
    for i in range(len(memory)):
        observe(memory[i], estimate[i], measurement[i], airframe[i if len(airframe) > 1 else 0], tuning[0], dt)


METHOD = runs.Method("recursive least squares", init, step, default_tuning)
identify = partial(runs.identify, METHOD)
