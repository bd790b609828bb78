"""Linear-quadratic regulator with integral action, scheduled over airspeed and flap.

The attitude holds are state feedback, u = trim - K (x - x_asked), with gains that `controllers.design.lqr` finds on the
clean aircraft (Bryson & Ho, Applied Optimal Control, chapter 5; Stevens, Lewis & Johnson, Aircraft Control and
Simulation, 3rd ed., section 5.5). What is asked for comes from `controllers.laws.guidance`.

* elevator from airspeed, alpha, q, theta and the integral of the pitch error; airspeed and alpha count from their
  values at engagement, the integral takes up what they lack
* aileron and rudder together from beta, p, r, phi and the integrals of the bank error and of the lateral force
* in a turn: q, r and alpha count from those of the level turn
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import airspeed_of, clip, integrated
from controllers.laws.guidance import (
    GUIDANCE_FIELDS,
    GUIDANCE_GAINS_FIELDS,
    command_bank,
    engage_guidance,
    guide,
    surface_scale,
    turn_alpha,
    turn_pitch_rate,
)
from controllers.parameters import read_parameters
from controllers.schedule import at, place, scheduled
from icing_env.atmosphere import G0
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

REGULATOR_FIELDS: list[Field] = [  # its own first: one that began like another law's would pass for it in numba
    ("airspeed_trim", "m/s", "airspeed when the law was engaged"),
    ("alpha_trim", "rad", "angle of attack then"),
    ("elevator_trim", "rad", "integrator of the pitch hold"),
    ("aileron_trim", "rad", "aileron's share of the lateral integrators"),
    ("rudder_trim", "rad", "rudder's share of the lateral integrators"),
    *GUIDANCE_FIELDS,
]
LQR = structured(REGULATOR_FIELDS)
SIZES = {"longitudinal": (1, 5), "lateral": (2, 6)}  # of the gain K at each place of the grid


def default_gains(name: str | Path = "lqr") -> NDArray[Any]:
    """Gains of the outer loops and the regulator's tables, one row. Raises InputError for a file that does not fit."""
    return scheduled(read_parameters("guidance", GUIDANCE_GAINS_FIELDS), name, SIZES)


def init(n: int) -> NDArray[Any]:
    """Regulators of `n` aircraft, not yet engaged (LQR rows)."""
    return np.zeros(n, LQR)


@kernel
def engage_regulator(a: Any, m: Any, t: Any, g: Any) -> None:
    """Start every integrator where the controls are, so that engaging moves nothing."""
    engage_guidance(a, m, t, g)
    a.elevator_trim, a.aileron_trim, a.rudder_trim = m.elevator, m.aileron, m.rudder
    a.airspeed_trim, a.alpha_trim = m.airspeed, m.alpha


@kernel
def regulate_pitch(a: Any, c: Any, adv: Any, g: Any, where: tuple, airspeed: float, alpha: float, q: float,
                   error: float, dt: float) -> None:
    """Elevator from deviations and the pitch error [rad]; its integrator does not pull against the protection."""
    k = g.longitudinal
    wanted = a.elevator_trim - (at(k, where, 0, 0)*airspeed + at(k, where, 0, 1)*alpha + at(k, where, 0, 2)*q
                                + at(k, where, 0, 3)*error)
    rate = -at(k, where, 0, 4)*error*dt
    if adv.intervention > 0.0:
        rate = max(rate, 0.0)
    a.elevator_trim = integrated(a.elevator_trim, rate, wanted, g.elevator_min, g.elevator_max)
    c.elevator = clip(wanted, g.elevator_min, g.elevator_max)


@kernel
def lateral_feedback(k: Any, where: tuple, row: int, beta: float, p: float, r: float, error: float) -> float:
    """Feedback of one lateral surface: row 0 aileron, row 1 rudder."""
    return (at(k, where, row, 0)*beta + at(k, where, row, 1)*p + at(k, where, row, 2)*r
            + at(k, where, row, 3)*error)


@kernel
def regulate_bank(a: Any, c: Any, m: Any, g: Any, where: tuple, beta: float, p: float, r: float, error: float,
                  settled: bool, dt: float) -> None:
    """Aileron and rudder from sideslip, rates, the bank error [rad] and the lateral specific force."""
    k = g.lateral
    integrand = error if settled else 0.0  # a lag behind the slew is no lack of trim
    aileron = a.aileron_trim - lateral_feedback(k, where, 0, beta, p, r, error)
    rudder = a.rudder_trim - lateral_feedback(k, where, 1, beta, p, r, error)
    rate = -(at(k, where, 0, 4)*integrand + at(k, where, 0, 5)*m.ay)*dt
    a.aileron_trim = integrated(a.aileron_trim, rate, aileron, -g.aileron_max, g.aileron_max)
    rate = -(at(k, where, 1, 4)*integrand + at(k, where, 1, 5)*m.ay)*dt
    a.rudder_trim = integrated(a.rudder_trim, rate, rudder, -g.rudder_max, g.rudder_max)
    c.aileron = clip(aileron, -g.aileron_max, g.aileron_max)
    c.rudder = clip(rudder, -g.rudder_max, g.rudder_max)


@kernel
def asked_yaw_rate(a: Any, m: Any) -> float:
    """Yaw rate [rad/s] of the level turn at the bank asked for."""
    return G0/airspeed_of(m)*math.sin(a.bank_command)*math.cos(m.theta)


@entry
def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every regulator, in place; arguments as in `controllers.laws.autopilot.step`, memory: LQR rows."""
    for i in range(len(command)):
        a, c, m, t, adv = memory[i], command[i], measurement[i], target[i], advisory[i]
        g = gains[i if len(gains) > 1 else 0]
        if a.engaged == 0.0:
            engage_regulator(a, m, t, g)
        scale = surface_scale(m, g)
        theta = guide(a, c, m, t, adv, g, scale, dt)
        settled = command_bank(a, m, t, adv, g, dt)
        where = place(m, g)
        regulate_pitch(a, c, adv, g, where, a.airspeed - a.airspeed_trim,
                       m.alpha - a.alpha_trim - turn_alpha(m, g, scale), m.q - turn_pitch_rate(m), m.theta - theta, dt)
        regulate_bank(a, c, m, g, where, m.beta, m.p, m.r - asked_yaw_rate(a, m), m.phi - a.bank_command, settled, dt)
