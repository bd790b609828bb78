"""The classical fourth-order Runge-Kutta step of the continuous state (Press et al., Numerical Recipes, section 17.1).

A few aircraft advance together, phase by phase (the air they meet, the rates, the sums): the equations of one are a
long chain of dependent operations, and the processor fills waiting time with those of the next (measured: a step of
eight together takes 6 to 12 % less than one after another). Each aircraft's arithmetic is the same in any company.

The equations name the fields of records; the weighted sums run over the same memory as rows of numbers, in vectors.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.dynamics import meet_air, rates
from icing_env.frames import direction_cosines
from icing_env.jit import kernel
from icing_env.types import N_CONTINUOUS

TOGETHER = 8  # aircraft that advance side by side
STAGES = 4
START, TRIAL, SLOPE, TOTAL, AIR = 0, 1, 2, 3, 4  # the records of one aircraft; AIR holds what `meet_air` returns
RECORDS = 5
AHEAD = (0.5, 0.5, 1.0, 0.0)  # where the next slope is taken, in steps
WEIGHT = (1.0/6.0, 1.0/3.0, 1.0/3.0, 1.0/6.0)


@kernel
def put(row: Any, target: int, source: int, size: int) -> None:
    """Copy one record onto another, in one aircraft's row of numbers.

    `size` is N_CONTINUOUS; being an argument it keeps the compiler from unrolling what it can turn into vectors.
    """
    for n in range(size):
        row[n + target*N_CONTINUOUS] = row[n + source*N_CONTINUOUS]


@kernel
def move(row: Any, ahead: float, weight: float, size: int) -> None:
    """Trial = start + ahead slope, total = total + weight slope, in one aircraft's row of numbers; `size` as above."""
    for n in range(size):
        slope = row[n + SLOPE*N_CONTINUOUS]
        row[n + TOTAL*N_CONTINUOUS] += weight*slope
        row[n + TRIAL*N_CONTINUOUS] = row[n + START*N_CONTINUOUS] + ahead*slope


@kernel
def store(row: Any, air: tuple) -> None:
    """Put the numbers of `meet_air` away."""
    for n in range(len(air)):
        row[n] = air[n]


@kernel
def recall(row: Any) -> tuple:
    """The numbers of `meet_air` that `store` put away."""
    return row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9], row[10]


@kernel
def copy(out: Any, x: Any) -> None:
    """out = x, field by field; `x` may be a longer record that begins with the same fields."""
    out.north = x.north
    out.east = x.east
    out.altitude = x.altitude
    out.u = x.u
    out.v = x.v
    out.w = x.w
    out.e0 = x.e0
    out.e1 = x.e1
    out.e2 = x.e2
    out.e3 = x.e3
    out.p = x.p
    out.q = x.q
    out.r = x.r
    out.elevator = x.elevator
    out.aileron = x.aileron
    out.rudder = x.rudder
    out.flap = x.flap
    out.power_left = x.power_left
    out.power_right = x.power_right
    out.alpha_downwash = x.alpha_downwash


@kernel
def normalise(x: Any) -> None:
    """Bring the quaternion back to unit length."""
    scale = 1.0/math.sqrt(x.e0*x.e0 + x.e1*x.e1 + x.e2*x.e2 + x.e3*x.e3)
    x.e0 *= scale
    x.e1 *= scale
    x.e2 *= scale
    x.e3 *= scale


@kernel
def rk4(stage: Any, numbers: Any, first: int, count: int, state: Any, current: Any, parameters: Any, shared: bool,
        command: Any, dt: float) -> None:
    """Advance `count` aircraft from row `first` by `dt`; gusts, ice and commands are held.

    `stage` [TOGETHER, RECORDS]: the continuous state goes in and comes out in TRIAL; the rest is scratch.
    `numbers` [TOGETHER, RECORDS*N_CONTINUOUS]: the same memory, as `numbers_of` gives it.
    """
    size, air = numbers.shape[1]//RECORDS, numbers[:, AIR*N_CONTINUOUS:]
    for j in range(count):
        put(numbers[j], START, TRIAL, size)
        put(numbers[j], TOTAL, TRIAL, size)
    for k in range(STAGES):
        for j in range(count):
            i, x = first + j, stage[j, TRIAL]
            attitude = direction_cosines(x.e0, x.e1, x.e2, x.e3)
            store(air[j], meet_air(x, attitude, state[i], current[i], parameters[0 if shared else i]))
        for j in range(count):
            i, x = first + j, stage[j, TRIAL]
            attitude = direction_cosines(x.e0, x.e1, x.e2, x.e3)
            rates(x, stage[j, SLOPE], attitude, recall(air[j]), state[i], current[i], parameters[0 if shared else i],
                  command[i])
        for j in range(count):
            move(numbers[j], AHEAD[k]*dt, WEIGHT[k]*dt, size)
    for j in range(count):
        put(numbers[j], TRIAL, TOTAL, size)
        normalise(stage[j, TRIAL])


def numbers_of(stage: NDArray) -> NDArray:
    """The memory of the scratch records of `rk4` as a row of float64 per aircraft."""
    return stage.view(np.float64).reshape(len(stage), -1)
