"""The classical fourth-order Runge-Kutta step of the continuous state (Press et al., Numerical Recipes, section 17.1).

A few aircraft advance together, stage by stage: the equations of one are a long chain of dependent operations, and the
processor fills its waiting time with those of the next (measured: a third faster than one aircraft after another).
Each aircraft's arithmetic is the same in any company.
"""

from __future__ import annotations

from typing import Any

from icing_env.dynamics import derivative
from icing_env.jit import kernel

TOGETHER = 4  # aircraft that advance side by side
START, TRIAL, SLOPE, TOTAL = 0, 1, 2, 3  # the records of one aircraft
STAGES = 4
AHEAD = (0.5, 0.5, 1.0, 0.0)  # where the next slope is taken, in steps
WEIGHT = (1.0/6.0, 1.0/3.0, 1.0/3.0, 1.0/6.0)


@kernel
def move(out: Any, start: Any, slope: Any, h: float) -> None:
    """out = start + h slope."""
    out.north = start.north + h*slope.north
    out.east = start.east + h*slope.east
    out.altitude = start.altitude + h*slope.altitude
    out.u = start.u + h*slope.u
    out.v = start.v + h*slope.v
    out.w = start.w + h*slope.w
    out.e0 = start.e0 + h*slope.e0
    out.e1 = start.e1 + h*slope.e1
    out.e2 = start.e2 + h*slope.e2
    out.e3 = start.e3 + h*slope.e3
    out.p = start.p + h*slope.p
    out.q = start.q + h*slope.q
    out.r = start.r + h*slope.r
    out.elevator = start.elevator + h*slope.elevator
    out.aileron = start.aileron + h*slope.aileron
    out.rudder = start.rudder + h*slope.rudder
    out.flap = start.flap + h*slope.flap
    out.power_left = start.power_left + h*slope.power_left
    out.power_right = start.power_right + h*slope.power_right
    out.alpha_downwash = start.alpha_downwash + h*slope.alpha_downwash


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
    scale = 1.0/(x.e0*x.e0 + x.e1*x.e1 + x.e2*x.e2 + x.e3*x.e3)**0.5
    x.e0 *= scale
    x.e1 *= scale
    x.e2 *= scale
    x.e3 *= scale


@kernel
def rk4(stage: Any, first: int, count: int, state: Any, current: Any, parameters: Any, shared: bool, command: Any,
        dt: float) -> None:
    """Advance `count` aircraft from row `first` by `dt`; gusts, ice and commands are held.

    `stage` [TOGETHER, 4]: the continuous state goes in and comes out in TRIAL; the rest is scratch.
    """
    for j in range(count):
        copy(stage[j, START], stage[j, TRIAL])
        copy(stage[j, TOTAL], stage[j, TRIAL])
    for k in range(STAGES):
        for j in range(count):
            i = first + j
            slope = stage[j, SLOPE]
            derivative(stage[j, TRIAL], slope, state[i], current[i], parameters[0 if shared else i], command[i])
            move(stage[j, TOTAL], stage[j, TOTAL], slope, WEIGHT[k]*dt)
            move(stage[j, TRIAL], stage[j, START], slope, AHEAD[k]*dt)
    for j in range(count):
        copy(stage[j, TRIAL], stage[j, TOTAL])
        normalise(stage[j, TRIAL])
