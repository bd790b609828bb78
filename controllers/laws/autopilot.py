"""The autopilot: attitude holds by proportional, integral and rate feedback, with a yaw damper.

The structure of the pitch and roll attitude holds of the Smart Icing Systems autopilot, under the outer loops of
`controllers.laws.guidance`. Signs: positive elevator pitches down, positive aileron rolls left, positive rudder yaws
left; so too little pitch gives negative elevator, too little bank negative aileron.

* elevator = trim + s [K_theta (theta - theta_command) + K_q (q - q_turn)]
* aileron = trim + s [K_phi (phi - bank_command) + K_p p]
* rudder = trim + s K_r (r - r_turn); its trim keeps the ball centred
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import clip, integrated
from controllers.laws.guidance import (
    GUIDANCE_FIELDS,
    command_bank,
    engage_guidance,
    guide,
    load_gains,
    surface_scale,
    turn_pitch_rate,
    turn_yaw_rate,
)
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

AUTOPILOT_FIELDS: list[Field] = [
    *GUIDANCE_FIELDS,
    ("elevator_trim", "rad", "integrator of the pitch hold"),
    ("aileron_trim", "rad", "integrator of the bank hold"),
    ("rudder_trim", "rad", "integrator of the lateral specific force"),
]
OWN_GAINS: list[Field] = [
    ("K_theta", "1", "elevator per pitch error"),
    ("K_theta_integral", "1/s", "elevator rate per pitch error"),
    ("K_q", "s", "elevator per pitch rate"),
    ("K_phi", "1", "aileron per bank error"),
    ("K_phi_integral", "1/s", "aileron rate per bank error"),
    ("K_p", "s", "aileron per roll rate"),
    ("K_r", "s", "rudder per yaw rate beyond that of the turn"),
    ("K_ay_integral", "rad s/m", "rudder rate per lateral specific force"),
]
AUTOPILOT = structured(AUTOPILOT_FIELDS)


def default_gains(name: str | Path = "autopilot") -> NDArray[Any]:
    """Gains of the outer loops and of the autopilot, one row. Raises InputError for a file that does not fit."""
    return load_gains(name, OWN_GAINS)


def init(n: int) -> NDArray[Any]:
    """Autopilots of `n` aircraft, not yet engaged (AUTOPILOT rows)."""
    return np.zeros(n, AUTOPILOT)


@kernel
def engage(a: Any, m: Any, t: Any, g: Any) -> None:
    """Start every integrator where the controls are, so that engaging moves nothing."""
    engage_guidance(a, m, t, g)
    a.elevator_trim, a.aileron_trim, a.rudder_trim = m.elevator, m.aileron, m.rudder


@kernel
def hold_pitch(a: Any, c: Any, m: Any, adv: Any, g: Any, theta: float, scale: float, dt: float) -> None:
    """Elevator that holds a pitch angle; its integrator does not pull against the protection."""
    error = m.theta - theta
    wanted = a.elevator_trim + scale*(g.K_theta*error + g.K_q*(m.q - turn_pitch_rate(m)))
    rate = scale*g.K_theta_integral*error*dt
    if adv.intervention > 0.0:
        rate = max(rate, 0.0)
    a.elevator_trim = integrated(a.elevator_trim, rate, wanted, g.elevator_min, g.elevator_max)
    c.elevator = clip(wanted, g.elevator_min, g.elevator_max)


@kernel
def hold_bank(a: Any, c: Any, m: Any, t: Any, adv: Any, g: Any, scale: float, dt: float) -> None:
    """Aileron that holds a bank angle or, through it, a heading."""
    settled = command_bank(a, m, t, adv, g, dt)
    error = m.phi - a.bank_command
    wanted = a.aileron_trim + scale*(g.K_phi*error + g.K_p*m.p)
    rate = scale*g.K_phi_integral*error*dt if settled else 0.0  # a lag behind the slew is no lack of trim
    a.aileron_trim = integrated(a.aileron_trim, rate, wanted, -g.aileron_max, g.aileron_max)
    c.aileron = clip(wanted, -g.aileron_max, g.aileron_max)


@kernel
def damp_yaw(a: Any, c: Any, m: Any, g: Any, scale: float, dt: float) -> None:
    """Rudder: damps the yaw rate beyond that of a coordinated turn and slowly centres the ball."""
    wanted = a.rudder_trim + scale*g.K_r*(m.r - turn_yaw_rate(m))
    rate = scale*g.K_ay_integral*m.ay*dt
    a.rudder_trim = integrated(a.rudder_trim, rate, wanted, -g.rudder_max, g.rudder_max)
    c.rudder = clip(wanted, -g.rudder_max, g.rudder_max)


@entry
def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every autopilot, in place.

    Args:
        memory: AUTOPILOT rows, one per aircraft; changed.
        command: COMMAND rows; surfaces, power levers and flap are written, ice protection is left alone.
        measurement: MEASUREMENT rows.
        estimate, airframe: not used by this law.
        target: TARGET rows.
        advisory: ADVISORY rows.
        gains: one row of `default_gains` for all, or one per aircraft.
        dt: time since the last step [s].
    """
    for i in range(len(command)):
        a, c, m, t, adv = memory[i], command[i], measurement[i], target[i], advisory[i]
        g = gains[i if len(gains) > 1 else 0]
        if a.engaged == 0.0:
            engage(a, m, t, g)
        scale = surface_scale(m, g)
        theta = guide(a, c, m, t, adv, g, scale, dt)
        hold_pitch(a, c, m, adv, g, theta, scale, dt)
        hold_bank(a, c, m, t, adv, g, scale, dt)
        damp_yaw(a, c, m, g, scale, dt)
