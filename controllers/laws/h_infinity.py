"""H-infinity attitude loops: one robust controller each for pitch and roll, at all airspeeds.

`controllers.design.h_infinity` finds them by mixed sensitivity on the clean aircraft and discretises them for steps of
0.02 s; surfaces go with the inverse of the dynamic pressure. Each is a linear filter of a few states beside an
integrator of its own, which is held at the limits of the surface:

    [states, surface] = M [states, angle asked for - angle, rate]
    surface command = trim + s surface,   trim_dot = s K_i (angle asked for - angle)

What is asked for comes from `controllers.laws.guidance`; the rudder is a yaw damper that slowly centres the ball.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import clip, integrated
from controllers.laws.guidance import (
    GUIDANCE_FIELDS,
    GUIDANCE_GAINS_FIELDS,
    command_bank,
    engage_guidance,
    guide,
    surface_scale,
    turn_pitch_rate,
    turn_yaw_rate,
)
from controllers.parameters import read_parameters
from controllers.schedule import read_tables, with_tables
from icing_env.jit import block, entry, kernel
from icing_env.types import structured

STATES = 5  # of either controller beside its integrator
H_INFINITY = np.dtype([  # its own first: one that began like another law's would pass for it in numba
    ("pitch", "f8", (STATES + 1,)),  # states of the pitch controller, then its surface [rad]
    ("roll", "f8", (STATES + 1,)),
    ("stacked", "f8", (STATES + 2,)),  # what the controllers' matrices multiply: states, error, rate
    ("elevator_trim", "f8"), ("aileron_trim", "f8"), ("rudder_trim", "f8"),  # rad, integrators
    *structured(GUIDANCE_FIELDS).descr,
])  # fmt: skip
SHAPES = {"pitch": (STATES + 1, STATES + 2), "roll": (STATES + 1, STATES + 2), "integral": (2,), "yaw": (2,)}


def default_gains(name: str | Path = "h_infinity") -> NDArray[Any]:
    """Gains of the outer loops and both controllers, one row. Raises InputError for a file that does not fit."""
    return with_tables(read_parameters("guidance", GUIDANCE_GAINS_FIELDS), read_tables(name, SHAPES))


def init(n: int) -> NDArray[Any]:
    """Laws of `n` aircraft, not yet engaged (H_INFINITY rows)."""
    return np.zeros(n, H_INFINITY)


@block
def control(matrix: Any, x: Any, z: Any, error: float, rate: float) -> float:
    """One step of a controller: its states `x` move on; returns its surface [rad]. `z` is scratch."""
    for k in range(STATES):
        z[k] = x[k]
    z[STATES], z[STATES + 1] = error, rate
    for row in range(STATES + 1):
        total = 0.0
        for column in range(STATES + 2):
            total += matrix[row, column]*z[column]
        x[row] = total
    return x[STATES]


@kernel
def hold_pitch(a: Any, c: Any, m: Any, adv: Any, g: Any, theta: float, scale: float, dt: float) -> None:
    """Elevator; its integrator does not pull against the protection."""
    error = theta - m.theta
    wanted = a.elevator_trim + scale*control(g.pitch, a.pitch, a.stacked, error, m.q - turn_pitch_rate(m))
    rate = scale*g.integral[0]*error*dt
    if adv.intervention > 0.0:
        rate = max(rate, 0.0)
    a.elevator_trim = integrated(a.elevator_trim, rate, wanted, g.elevator_min, g.elevator_max)
    c.elevator = clip(wanted, g.elevator_min, g.elevator_max)


@kernel
def hold_bank(a: Any, c: Any, m: Any, t: Any, adv: Any, g: Any, scale: float, dt: float) -> None:
    """Aileron."""
    settled = command_bank(a, m, t, adv, g, dt)
    error = a.bank_command - m.phi
    wanted = a.aileron_trim + scale*control(g.roll, a.roll, a.stacked, error, m.p)
    rate = scale*g.integral[1]*error*dt if settled else 0.0  # a lag behind the slew is no lack of trim
    a.aileron_trim = integrated(a.aileron_trim, rate, wanted, -g.aileron_max, g.aileron_max)
    c.aileron = clip(wanted, -g.aileron_max, g.aileron_max)


@kernel
def damp_yaw(a: Any, c: Any, m: Any, g: Any, scale: float, dt: float) -> None:
    """Rudder."""
    wanted = a.rudder_trim + scale*g.yaw[0]*(m.r - turn_yaw_rate(m))
    a.rudder_trim = integrated(a.rudder_trim, scale*g.yaw[1]*m.ay*dt, wanted, -g.rudder_max, g.rudder_max)
    c.rudder = clip(wanted, -g.rudder_max, g.rudder_max)


@entry
def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every law, in place; arguments as in `controllers.laws.autopilot.step`, memory: H_INFINITY rows.

    The controllers are made for steps of 0.02 s.
    """
    for i in range(len(command)):
        a, c, m, t, adv = memory[i], command[i], measurement[i], target[i], advisory[i]
        g = gains[i if len(gains) > 1 else 0]
        if a.engaged == 0.0:
            engage_guidance(a, m, t, g)
            a.elevator_trim, a.aileron_trim, a.rudder_trim = m.elevator, m.aileron, m.rudder
        scale = surface_scale(m, g)
        theta = guide(a, c, m, t, adv, g, scale, dt)
        hold_pitch(a, c, m, adv, g, theta, scale, dt)
        hold_bank(a, c, m, t, adv, g, scale, dt)
        damp_yaw(a, c, m, g, scale, dt)
