"""Scheduled by identification: the autopilot, its inner loops' gains scheduled by the observer's estimate.

The attitude loops of `controllers.laws.autopilot` were designed for the clean aircraft. Where the observer has found
that a derivative keeps only a share of its clean value, feedback of angle of attack, sideslip and rates is added and
each surface is driven further, so that surface and aircraft together answer the loops as the clean aircraft would: the
clean short period's frequency and damping, the clean moments of roll and yaw
(`controllers.ice_management.clean_answer`: gains in closed form, no look-up table).

* a share follows the estimate within 1 +- change_max, at change_rate: no gain jumps
* it is frozen while its standard error is above error_max of the clean value, the axis is too little excited, or the
  observer is not healthy
* at shares of 1 the law is the autopilot, to rounding

Against the adaptation layer of the ice management (function 4), which does the same for any law from the command
alone, this law knows its own trim, so that nothing has to be taken out of a slow mean of the command. Use one of both.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.ice_management.clean_answer import (
    change_aileron_rudder,
    change_elevator,
    quasi_inertia,
    quasi_pitch,
)
from controllers.kernels import air_density, clip
from controllers.laws.augment import TRUST_FIELDS, followed, load_augmented, trusted
from controllers.laws.autopilot import AUTOPILOT_FIELDS, damp_yaw, engage, hold_bank, hold_pitch
from controllers.laws.guidance import guide, surface_scale, turn_pitch_rate, turn_yaw_rate
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

FOLLOWED = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_elevator", "Cl_beta", "Cl_p", "Cl_aileron", "Cn_beta", "Cn_r",
            "Cn_rudder")  # fmt: skip
OWN_FIELDS: list[Field] = [
    *((name, "1", "share of its clean value for which the gains are scheduled") for name in FOLLOWED),
    ("mean_alpha", "rad", "slow mean of the angle of attack"),
    ("mean_beta", "rad", "slow mean of the sideslip"),
]
OWN_GAINS: list[Field] = [
    *TRUST_FIELDS,
    ("mean_time", "s", "time constant of the slow means"),
    ("loop_lag", "s", "lag of actuators and instruments in the loop"),
]
SCHEDULED = structured([*OWN_FIELDS, *AUTOPILOT_FIELDS])  # own first: numba would take the other for an AUTOPILOT row


def default_gains(name: str | Path = "scheduled") -> NDArray[Any]:
    """Gains of scheduling, outer loops and autopilot, one row. Raises InputError for a file that does not fit."""
    return load_augmented(name, OWN_GAINS)


def init(n: int) -> NDArray[Any]:
    """Memory of `n` aircraft believed clean, not yet engaged (SCHEDULED rows)."""
    memory = np.zeros(n, SCHEDULED)
    for name in FOLLOWED:
        memory[name] = 1.0
    return memory


@kernel
def schedule_pitch(a: Any, e: Any, m: Any, f: Any, g: Any, dt: float) -> bool:
    """Shares of the longitudinal derivatives one step on; True where all moment derivatives are trusted."""
    x, h = e.excitation_longitudinal, e.health
    cm_alpha, cm_q = quasi_pitch(f, air_density(m))
    cl_alpha = f.CX_0 - f.CZ_alpha
    a.CL_alpha = followed(a.CL_alpha, e.CL_alpha, cl_alpha, trusted(e.CL_alpha_std, cl_alpha, x, h, g), g, dt)
    by_alpha, by_q = trusted(e.Cm_alpha_std, cm_alpha, x, h, g), trusted(e.Cm_q_std, cm_q, x, h, g)
    cm_elevator = f.Cm_elevator/quasi_inertia(f, air_density(m))
    power = trusted(e.Cm_elevator_std, cm_elevator, x, h, g)
    a.Cm_alpha = followed(a.Cm_alpha, e.Cm_alpha, cm_alpha, by_alpha, g, dt)
    a.Cm_q = followed(a.Cm_q, e.Cm_q, cm_q, by_q, g, dt)
    a.Cm_elevator = followed(a.Cm_elevator, e.Cm_elevator, cm_elevator, power, g, dt)
    return by_alpha and power


@kernel
def schedule_turn(a: Any, e: Any, f: Any, g: Any, dt: float) -> bool:
    """Shares of the lateral derivatives one step on; True where damping, stiffness and powers are trusted."""
    x, h = e.excitation_lateral, e.health
    by_p, by_beta = trusted(e.Cl_p_std, f.Cl_p, x, h, g), trusted(e.Cn_beta_std, f.Cn_beta, x, h, g)
    roll, yaw = trusted(e.Cl_aileron_std, f.Cl_aileron, x, h, g), trusted(e.Cn_rudder_std, f.Cn_rudder, x, h, g)
    a.Cl_beta = followed(a.Cl_beta, e.Cl_beta, f.Cl_beta, trusted(e.Cl_beta_std, f.Cl_beta, x, h, g), g, dt)
    a.Cl_p = followed(a.Cl_p, e.Cl_p, f.Cl_p, by_p, g, dt)
    a.Cl_aileron = followed(a.Cl_aileron, e.Cl_aileron, f.Cl_aileron, roll, g, dt)
    a.Cn_beta = followed(a.Cn_beta, e.Cn_beta, f.Cn_beta, by_beta, g, dt)
    a.Cn_r = followed(a.Cn_r, e.Cn_r, f.Cn_r, trusted(e.Cn_r_std, f.Cn_r, x, h, g), g, dt)
    a.Cn_rudder = followed(a.Cn_rudder, e.Cn_rudder, f.Cn_rudder, yaw, g, dt)
    return by_p and by_beta and roll and yaw


@kernel
def largest_change(a: Any) -> float:
    """Largest departure of a share from 1."""
    pitch = max(abs(a.CL_alpha - 1.0), abs(a.Cm_alpha - 1.0), abs(a.Cm_q - 1.0), abs(a.Cm_elevator - 1.0))
    roll = max(abs(a.Cl_beta - 1.0), abs(a.Cl_p - 1.0), abs(a.Cl_aileron - 1.0))
    return max(pitch, roll, abs(a.Cn_beta - 1.0), abs(a.Cn_r - 1.0), abs(a.Cn_rudder - 1.0))


@kernel
def answer_clean(a: Any, c: Any, m: Any, f: Any, g: Any, elevator: float, aileron: float, rudder: float) -> None:
    """Change the surfaces so that the aircraft answers as the clean one; arguments: what the loops ask beyond trim."""
    lag = g.loop_lag
    pitch = change_elevator(a, m, f, elevator, m.alpha - a.mean_alpha, m.q - turn_pitch_rate(m), lag)
    roll, yaw = change_aileron_rudder(a, m, f, aileron, rudder, m.beta - a.mean_beta, m.p, m.r - turn_yaw_rate(m), lag)
    c.elevator = clip(c.elevator + pitch, g.elevator_min, g.elevator_max)
    c.aileron = clip(c.aileron + roll, -g.aileron_max, g.aileron_max)
    c.rudder = clip(c.rudder + yaw, -g.rudder_max, g.rudder_max)


@entry
def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every aircraft, in place.

    Args:
        memory: SCHEDULED rows, one per aircraft; changed.
        command: COMMAND rows; surfaces, power levers and flap are written, ice protection is left alone.
        measurement: MEASUREMENT rows.
        estimate: ESTIMATE rows.
        target: TARGET rows.
        advisory: ADVISORY rows; `adaptation` and `adaptation_frozen` are written.
        airframe: PARAMETERS of the clean aircraft, one row for all or one per aircraft.
        gains: one row of `default_gains` for all, or one per aircraft.
        dt: time since the last step [s].
    """
    for i in range(len(command)):
        a, c, m, t, adv, e = memory[i], command[i], measurement[i], target[i], advisory[i], estimate[i]
        f = airframe[i if len(airframe) > 1 else 0]
        g = gains[i if len(gains) > 1 else 0]
        if a.engaged == 0.0:
            engage(a, m, t, g)
            a.mean_alpha, a.mean_beta = m.alpha, m.beta
        pitch, turn = schedule_pitch(a, e, m, f, g, dt), schedule_turn(a, e, f, g, dt)
        adv.adaptation, adv.adaptation_frozen = largest_change(a)/g.change_max, 0.0 if pitch and turn else 1.0
        way = 1.0 - math.exp(-dt/g.mean_time)
        a.mean_alpha += way*(m.alpha - a.mean_alpha)
        a.mean_beta += way*(m.beta - a.mean_beta)
        scale = surface_scale(m, g)
        theta = guide(a, c, m, t, adv, g, scale, dt)
        elevator, aileron, rudder = a.elevator_trim, a.aileron_trim, a.rudder_trim
        hold_pitch(a, c, m, adv, g, theta, scale, dt)
        hold_bank(a, c, m, t, adv, g, scale, dt)
        damp_yaw(a, c, m, g, scale, dt)
        a.elevator_trim = elevator + (a.elevator_trim - elevator)/a.Cm_elevator  # a weak surface is trimmed further
        a.aileron_trim = aileron + (a.aileron_trim - aileron)/a.Cl_aileron
        answer_clean(a, c, m, f, g, c.elevator - elevator, c.aileron - aileron, c.rudder - rudder)
