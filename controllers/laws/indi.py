"""Incremental nonlinear dynamic inversion: from the acceleration measured to the one wanted, by one surface increment.

Sieberling, Chu & Mulder, "Robust flight control using incremental nonlinear dynamic inversion and angular acceleration
prediction", Journal of Guidance, Control, and Dynamics 33(6), 2010. Of the aircraft it needs the surfaces' power alone;
stability, damping, trim and whatever ice adds to the moments are in the measured acceleration.

* wanted: q_dot = K_q (q_turn + K_theta (theta_command - theta) - q), p_dot = K_p (K_phi (bank_command - phi) - p)
* elevator = elevator_f + (q_dot - q_dot_f)/M_elevator, aileron = aileron_f + (p_dot - p_dot_f)/L_aileron
* _f: behind one second-order low pass, the same for rate and surface, so that acceleration and deflection belong
  together; the derivative of the rate is a state of the filter
* M_elevator = qbar S c Cm_elevator/Iyy, L_aileron = qbar S b Cl_aileron/Ixx; of the clean aircraft, times the share
  that the observer has found where its estimate is trusted (`controllers.laws.augment`)

The rudder is the autopilot's yaw damper. No integrator: the increment is one, and cannot wind up, since it starts from
the surface as measured. The angular acceleration is differentiated, not predicted as in the paper.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.ice_management.clean_answer import quasi_inertia
from controllers.kernels import air_density, clip
from controllers.laws.augment import TRUST_FIELDS, followed, pitch_power, roll_power, trusted
from controllers.laws.autopilot import damp_yaw
from controllers.laws.guidance import (
    GUIDANCE_FIELDS,
    command_bank,
    engage_guidance,
    guide,
    load_gains,
    surface_scale,
    turn_pitch_rate,
)
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

INDI_FIELDS: list[Field] = [
    ("q_filtered", "rad/s", "pitch rate behind the low pass"),
    ("q_dot", "rad/s2", "its derivative"),
    ("p_filtered", "rad/s", "roll rate behind the low pass"),
    ("p_dot", "rad/s2", "its derivative"),
    ("elevator_filtered", "rad", "elevator behind the low pass"),
    ("elevator_rate", "rad/s", "its derivative"),
    ("aileron_filtered", "rad", "aileron behind the low pass"),
    ("aileron_rate", "rad/s", "its derivative"),
    ("Cm_elevator", "1", "share of its clean value that is believed"),
    ("Cl_aileron", "1", "share of its clean value that is believed"),
    *GUIDANCE_FIELDS,
    ("rudder_trim", "rad", "integrator of the lateral specific force"),
]
OWN_GAINS: list[Field] = [
    ("K_theta", "1/s", "pitch rate per pitch error"),
    ("K_q", "1/s", "pitch acceleration per error of the pitch rate"),
    ("K_phi", "1/s", "roll rate per bank error"),
    ("K_p", "1/s", "roll acceleration per error of the roll rate"),
    ("filter_frequency", "rad/s", "natural frequency of the low pass"),
    ("filter_damping", "1", "damping ratio of the low pass"),
    *TRUST_FIELDS,
    ("K_r", "s", "rudder per yaw rate beyond that of the turn"),
    ("K_ay_integral", "rad s/m", "rudder rate per lateral specific force"),
]
INDI = structured(INDI_FIELDS)


def default_gains(name: str | Path = "indi") -> NDArray[Any]:
    """Gains of the outer loops and of the inversion, one row. Raises InputError for a file that does not fit."""
    return load_gains(name, OWN_GAINS)


def init(n: int) -> NDArray[Any]:
    """Memory of `n` aircraft believed clean, not yet engaged (INDI rows)."""
    memory = np.zeros(n, INDI)
    memory["Cm_elevator"] = memory["Cl_aileron"] = 1.0
    return memory


@kernel
def engage(a: Any, m: Any, t: Any, g: Any) -> None:
    """Start the outer loops and the filters where things are, so that engaging moves nothing."""
    engage_guidance(a, m, t, g)
    a.q_filtered, a.p_filtered = m.q, m.p
    a.elevator_filtered, a.aileron_filtered, a.rudder_trim = m.elevator, m.aileron, m.rudder


@kernel
def low_pass(value: float, rate: float, seen: float, g: Any, dt: float) -> tuple[float, float]:
    """Second-order low pass one step on: its value and its derivative (semi-implicit Euler)."""
    w = g.filter_frequency
    rate += dt*w*(w*(seen - value) - 2.0*g.filter_damping*rate)
    return value + dt*rate, rate


@kernel
def sense(a: Any, m: Any, g: Any, dt: float) -> None:
    """All four filters."""
    a.q_filtered, a.q_dot = low_pass(a.q_filtered, a.q_dot, m.q, g, dt)
    a.p_filtered, a.p_dot = low_pass(a.p_filtered, a.p_dot, m.p, g, dt)
    a.elevator_filtered, a.elevator_rate = low_pass(a.elevator_filtered, a.elevator_rate, m.elevator, g, dt)
    a.aileron_filtered, a.aileron_rate = low_pass(a.aileron_filtered, a.aileron_rate, m.aileron, g, dt)


@kernel
def believe(a: Any, e: Any, m: Any, f: Any, g: Any, dt: float) -> None:
    """Shares of elevator and aileron power, from the estimate where it is trusted."""
    cm_elevator = f.Cm_elevator/quasi_inertia(f, air_density(m))  # as identifiers find it on the clean aircraft
    pitch = trusted(e.Cm_elevator_std, cm_elevator, e.excitation_longitudinal, e.health, g)
    roll = trusted(e.Cl_aileron_std, f.Cl_aileron, e.excitation_lateral, e.health, g)
    a.Cm_elevator = followed(a.Cm_elevator, e.Cm_elevator, cm_elevator, pitch, g, dt)
    a.Cl_aileron = followed(a.Cl_aileron, e.Cl_aileron, f.Cl_aileron, roll, g, dt)


@kernel
def invert(a: Any, c: Any, m: Any, f: Any, g: Any, theta: float) -> None:
    """Elevator and aileron from the accelerations wanted and measured."""
    q_dot = g.K_q*(turn_pitch_rate(m) + g.K_theta*(theta - m.theta) - m.q)
    p_dot = g.K_p*(g.K_phi*(a.bank_command - m.phi) - m.p)
    elevator = a.elevator_filtered + (q_dot - a.q_dot)/(pitch_power(m, f)*f.Cm_elevator*a.Cm_elevator)
    aileron = a.aileron_filtered + (p_dot - a.p_dot)/(roll_power(m, f)*f.Cl_aileron*a.Cl_aileron)
    c.elevator = clip(elevator, g.elevator_min, g.elevator_max)
    c.aileron = clip(aileron, -g.aileron_max, g.aileron_max)


@entry
def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every aircraft, in place.

    Args:
        memory: INDI rows, one per aircraft; changed.
        command: COMMAND rows; surfaces, power levers and flap are written, ice protection is left alone.
        measurement: MEASUREMENT rows.
        estimate: ESTIMATE rows.
        target: TARGET rows.
        advisory: ADVISORY rows.
        airframe: PARAMETERS of the clean aircraft, one row for all or one per aircraft.
        gains: one row of `default_gains` for all, or one per aircraft.
        dt: time since the last step [s].
    """
    for i in range(len(command)):
        a, c, m, t, adv = memory[i], command[i], measurement[i], target[i], advisory[i]
        f = airframe[i if len(airframe) > 1 else 0]
        g = gains[i if len(gains) > 1 else 0]
        if a.engaged == 0.0:
            engage(a, m, t, g)
        sense(a, m, g, dt)
        believe(a, estimate[i], m, f, g, dt)
        scale = surface_scale(m, g)
        theta = guide(a, c, m, t, adv, g, scale, dt)
        command_bank(a, m, t, adv, g, dt)
        invert(a, c, m, f, g, theta)
        damp_yaw(a, c, m, g, scale, dt)
