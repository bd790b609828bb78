"""The Smart Icing System's own autopilot: its published attitude and heading holds, under our altitude and speed loops.

Gains of the University of Illinois' Smart Icing System (V. Sharma, 2002-2003) as they stand in FlightGear's UIUC model,
src/FDM/UIUCModel: uiuc_pah_ap.cpp (pitch), uiuc_rah_ap.cpp (roll, yaw), uiuc_hh_ap.cpp (heading). Speed in m/s. They
are not tuned anew: this is the baseline that the founding project published. Its signs are ours (Cm_elevator,
Cl_aileron and Cn_rudder are negative there too), so that its negative gains push back:

* elevator = trim - k_e [K_theta (e + K_i integral of e) - K_q q],         e = theta - theta_command
* aileron = trim - k_a [K_phi (e + K_i integral of e) - K_yaw_aileron r],  e = phi - phi_command
* rudder = trim + k_r [K_yaw_rudder r - K_r (r - (g/V) sin phi)]
* phi_command = K_heading (heading error)

K_theta, K_q, K_phi, K_yaw_rudder are parabolas and K_heading a line over airspeed. k_e, k_a, k_r are the steady gains
of the published servos, which are part of the loop gain; their dynamics are not taken over, our aircraft has its own.
Three choices of ours: the parabola of K_phi changes its sign at 81 m/s, so the schedule ends before; the published
code multiplies the turn's yaw rate by phi once more, which would push the rudder the same way in left and right turns
and is taken for a slip; q is counted from that of the turn, since the guidance does the same for every law.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import airspeed_of, clip, integrated, wrapped
from controllers.laws.guidance import (
    GUIDANCE_FIELDS,
    engage_guidance,
    guide,
    load_gains,
    slew_bank,
    surface_scale,
    turn_pitch_rate,
    turn_yaw_rate,
)
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

SIS_FIELDS: list[Field] = [
    *GUIDANCE_FIELDS,
    ("elevator_trim", "rad", "integrator of the pitch hold"),
    ("aileron_trim", "rad", "integrator of the roll hold"),
    ("rudder_trim", "rad", "rudder when the law was engaged"),
]
OWN_GAINS: list[Field] = [
    ("speed_min", "m/s", "lowest airspeed of the schedules"),
    ("speed_max", "m/s", "highest airspeed of the schedules"),
    ("K_theta_0", "1", "elevator per pitch error"),
    ("K_theta_1", "s/m", "the same per airspeed"),
    ("K_theta_2", "s2/m2", "the same per airspeed squared"),
    ("K_q_0", "s", "elevator per pitch rate"),
    ("K_q_1", "s2/m", "the same per airspeed"),
    ("K_q_2", "s3/m2", "the same per airspeed squared"),
    ("K_theta_integral", "1/s", "integral of the pitch error over the error"),
    ("K_phi_0", "1", "aileron per bank error"),
    ("K_phi_1", "s/m", "the same per airspeed"),
    ("K_phi_2", "s2/m2", "the same per airspeed squared"),
    ("K_phi_integral", "1/s", "integral of the bank error over the error"),
    ("K_yaw_aileron", "s", "aileron per yaw rate"),
    ("K_yaw_rudder_0", "s", "rudder per yaw rate"),
    ("K_yaw_rudder_1", "s2/m", "the same per airspeed"),
    ("K_yaw_rudder_2", "s3/m2", "the same per airspeed squared"),
    ("K_r", "s", "rudder per yaw rate beyond that of the turn"),
    ("K_bank_0", "1", "bank asked for per heading error"),
    ("K_bank_1", "s/m", "the same per airspeed"),
    ("servo_elevator", "1", "steady gain of the published elevator servo"),
    ("servo_aileron", "1", "steady gain of the published aileron servo"),
    ("servo_rudder", "1", "steady gain of the published rudder servo"),
]
SIS = structured(SIS_FIELDS)


def default_gains(name: str | Path = "sis") -> NDArray[Any]:
    """Gains of the outer loops and of the published holds, one row. Raises InputError for a file that does not fit."""
    return load_gains(name, OWN_GAINS)


def init(n: int) -> NDArray[Any]:
    """Autopilots of `n` aircraft, not yet engaged (SIS rows)."""
    return np.zeros(n, SIS)


@kernel
def hold_pitch(a: Any, c: Any, m: Any, adv: Any, g: Any, theta: float, v: float, dt: float) -> None:
    """Elevator of the published pitch attitude hold; its integrator does not pull against the protection."""
    k_theta = g.servo_elevator*(g.K_theta_0 + v*(g.K_theta_1 + v*g.K_theta_2))
    k_q = g.servo_elevator*(g.K_q_0 + v*(g.K_q_1 + v*g.K_q_2))
    error = m.theta - theta
    wanted = a.elevator_trim - k_theta*error - k_q*(m.q - turn_pitch_rate(m))
    rate = -g.K_theta_integral*k_theta*error*dt
    if adv.intervention > 0.0:
        rate = max(rate, 0.0)
    a.elevator_trim = integrated(a.elevator_trim, rate, wanted, g.elevator_min, g.elevator_max)
    c.elevator = clip(wanted, g.elevator_min, g.elevator_max)


@kernel
def hold_bank(a: Any, c: Any, m: Any, t: Any, adv: Any, g: Any, v: float, dt: float) -> None:
    """Aileron of the published roll attitude hold, and its heading hold."""
    asked = t.phi
    if t.roll_mode == 1.0:
        asked = (g.K_bank_0 + v*g.K_bank_1)*wrapped(t.heading - m.psi)
    settled = slew_bank(a, asked, adv, g, dt)
    k_phi = g.servo_aileron*(g.K_phi_0 + v*(g.K_phi_1 + v*g.K_phi_2))
    error = m.phi - a.bank_command
    wanted = a.aileron_trim - k_phi*error + g.servo_aileron*g.K_yaw_aileron*m.r
    rate = -g.K_phi_integral*k_phi*error*dt if settled else 0.0  # a lag behind the slew is no lack of trim
    a.aileron_trim = integrated(a.aileron_trim, rate, wanted, -g.aileron_max, g.aileron_max)
    c.aileron = clip(wanted, -g.aileron_max, g.aileron_max)


@kernel
def damp_yaw(a: Any, c: Any, m: Any, g: Any, v: float) -> None:
    """Rudder of the published yaw damper."""
    k_yaw = g.K_yaw_rudder_0 + v*(g.K_yaw_rudder_1 + v*g.K_yaw_rudder_2)
    wanted = a.rudder_trim + g.servo_rudder*(k_yaw*m.r - g.K_r*(m.r - turn_yaw_rate(m)))
    c.rudder = clip(wanted, -g.rudder_max, g.rudder_max)


@entry
def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every autopilot, in place; arguments as in `controllers.laws.autopilot.step`, memory: SIS rows."""
    for i in range(len(command)):
        a, c, m, t, adv = memory[i], command[i], measurement[i], target[i], advisory[i]
        g = gains[i if len(gains) > 1 else 0]
        if a.engaged == 0.0:
            engage_guidance(a, m, t, g)
            a.elevator_trim, a.aileron_trim, a.rudder_trim = m.elevator, m.aileron, m.rudder
        theta = guide(a, c, m, t, adv, g, surface_scale(m, g), dt)
        v = clip(airspeed_of(m), g.speed_min, g.speed_max)
        hold_pitch(a, c, m, adv, g, theta, v, dt)
        hold_bank(a, c, m, t, adv, g, v, dt)
        damp_yaw(a, c, m, g, v)
