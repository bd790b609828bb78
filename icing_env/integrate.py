"""The classical fourth-order Runge-Kutta step of the continuous state (Press et al., Numerical Recipes, section 17.1).

Ice and commands are held; gusts go in straight lines from the beginning of the environment step to its end. This is
the step of one aircraft in its records; `icing_env.blocks` has that of several side by side.
"""

from __future__ import annotations

import math
from typing import Any

from icing_env.dynamics import meet_air, rates
from icing_env.frames import direction_cosines
from icing_env.jit import kernel
from icing_env.types import GUST_FIELDS, structured

STAGES = 4
START, TRIAL, SLOPE, TOTAL = 0, 1, 2, 3  # the records of one aircraft
RECORDS = 4
AHEAD = (0.5, 0.5, 1.0, 0.0)  # where the next slope is taken, in steps
WEIGHT = (1.0/6.0, 1.0/3.0, 1.0/3.0, 1.0/6.0)
AT = (0.0, 0.5, 0.5, 1.0)  # where the slopes are taken, in steps
GUSTS = structured(GUST_FIELDS[:7])
BEFORE, AFTER, MET = 0, 1, 2  # the records of one aircraft's gusts: at both ends of the environment step, and now
GUST_RECORDS = 3


@kernel
def put(numbers: Any, target: int, source: int, size: int) -> None:
    """Copy one record onto another in a row of numbers that holds records of `size` numbers.

    `size` being an argument keeps the compiler from unrolling what it can turn into vectors.
    """
    for n in range(size):
        numbers[n + target*size] = numbers[n + source*size]


@kernel
def move(numbers: Any, ahead: float, weight: float, size: int) -> None:
    """Trial = start + ahead slope, total = total + weight slope; as `put`."""
    for n in range(size):
        slope = numbers[n + SLOPE*size]
        numbers[n + TOTAL*size] += weight*slope
        numbers[n + TRIAL*size] = numbers[n + START*size] + ahead*slope


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
def copy_gusts(out: Any, s: Any) -> None:
    """The gusts of a STATE record."""
    out.gust_u, out.gust_v, out.gust_w, out.gust_w_tail = s.gust_u, s.gust_v, s.gust_w, s.gust_w_tail
    out.gust_p, out.gust_q, out.gust_r = s.gust_p, s.gust_q, s.gust_r


@kernel
def meet_gusts(gusts: Any, share: float, size: int) -> None:
    """Gusts now, `share` of the way through the environment step; `size` as for `put`."""
    for n in range(size):
        before = gusts[n + BEFORE*size]
        gusts[n + MET*size] = before + share*(gusts[n + AFTER*size] - before)


@kernel
def normalise(x: Any) -> None:
    """Bring the quaternion back to unit length."""
    scale = 1.0/math.sqrt(x.e0*x.e0 + x.e1*x.e1 + x.e2*x.e2 + x.e3*x.e3)
    x.e0 *= scale
    x.e1 *= scale
    x.e2 *= scale
    x.e3 *= scale


@kernel
def rk4(stage: Any, numbers: Any, gusts: Any, airs: Any, c: Any, p: Any, u: Any, dt: float, sub: int,
        substeps: int) -> None:
    """Advance one aircraft by `dt`, substep `sub` of an environment step.

    Its continuous state goes in and comes out in the record TRIAL of `stage`; `gusts` has its GUST_RECORDS. `numbers`
    and `airs` are the memory of both as plain numbers.
    """
    size = len(numbers)//RECORDS
    x, met = stage[TRIAL], gusts[MET]
    put(numbers, START, TRIAL, size)
    put(numbers, TOTAL, TRIAL, size)
    for k in range(STAGES):
        meet_gusts(airs, (sub + AT[k])/substeps, len(airs)//GUST_RECORDS)
        attitude = direction_cosines(x.e0, x.e1, x.e2, x.e3)
        rates(x, stage[SLOPE], attitude, meet_air(x, attitude, met, c, p), met, c, p, u)
        move(numbers, AHEAD[k]*dt, WEIGHT[k]*dt, size)
    put(numbers, TRIAL, TOTAL, size)
    normalise(x)
