"""Linear-quadratic-Gaussian law: the regulator of `controllers.laws.lqr` on the states of a scheduled Kalman filter.

The filter (`controllers.design.lqg`) estimates airspeed, alpha, q, theta and beta, p, r, phi of the aircraft in still
air; the gust that the vanes read as well has two Dryden states of its own, which no surface answers. Two random walks
on each axis take up lift and moments that the clean aircraft lacks, ice among them. All count from engagement, and in a
turn from the level turn. Surfaces are read back, so that limits and protection mislead no estimate.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.laws.guidance import (
    GUIDANCE_GAINS_FIELDS,
    command_bank,
    guide,
    surface_scale,
    turn_alpha,
    turn_pitch_rate,
)
from controllers.laws.lqr import REGULATOR_FIELDS, asked_yaw_rate, engage_regulator, regulate_bank, regulate_pitch
from controllers.parameters import read_parameters
from controllers.schedule import place, product, scheduled
from icing_env.jit import entry, kernel
from icing_env.types import structured

STATES = 8  # of either filter
LONGITUDINAL_INPUTS, LATERAL_INPUTS = 5, 6  # surfaces and readings
LQG = np.dtype([  # its own first, see REGULATOR_FIELDS
    ("theta_trim", "f8"),  # rad, at engagement, like the surfaces below
    ("elevator_start", "f8"), ("aileron_start", "f8"), ("rudder_start", "f8"),
    ("longitudinal", "f8", (STATES,)),  # m/s, rad, rad/s, rad, gust twice [rad], walks of alpha_dot and q_dot
    ("lateral", "f8", (STATES,)),  # rad, rad/s, rad/s, rad, gust twice [rad], walks of p_dot and r_dot
    ("stacked", "f8", (STATES + LATERAL_INPUTS,)),  # what the filter's matrix multiplies: estimate, surfaces, readings
    *structured(REGULATOR_FIELDS).descr,
])  # fmt: skip
SIZES = {
    "longitudinal": (1, 5), "lateral": (2, 6),
    "filter_longitudinal": (STATES, STATES + LONGITUDINAL_INPUTS), "filter_lateral": (STATES, STATES + LATERAL_INPUTS),
}  # fmt: skip


def default_gains(name: str | Path = "lqg") -> NDArray[Any]:
    """Gains of the outer loops and tables of regulator and filter, one row. Raises InputError for a wrong file."""
    return scheduled(read_parameters("guidance", GUIDANCE_GAINS_FIELDS), name, SIZES)


def init(n: int) -> NDArray[Any]:
    """Laws of `n` aircraft, not yet engaged (LQG rows)."""
    return np.zeros(n, LQG)


@kernel
def engage(a: Any, m: Any, t: Any, g: Any) -> None:
    """Start integrators where the controls are and the filter in steady flight, so that engaging moves nothing."""
    engage_regulator(a, m, t, g)
    a.theta_trim = m.theta
    a.elevator_start, a.aileron_start, a.rudder_start = m.elevator, m.aileron, m.rudder
    a.lateral[0], a.lateral[1], a.lateral[2], a.lateral[3] = m.beta, m.p, m.r, m.phi


@kernel
def estimate_longitudinal(a: Any, m: Any, g: Any, where: tuple, scale: float) -> None:
    """One step of the longitudinal filter."""
    z = a.stacked
    for k in range(STATES):
        z[k] = a.longitudinal[k]
    z[STATES] = m.elevator - a.elevator_start
    z[STATES + 1] = m.airspeed - a.airspeed_trim
    z[STATES + 2] = m.alpha - a.alpha_trim - turn_alpha(m, g, scale)
    z[STATES + 3] = m.q - turn_pitch_rate(m)
    z[STATES + 4] = m.theta - a.theta_trim
    product(g.filter_longitudinal, where, z, a.longitudinal)


@kernel
def estimate_lateral(a: Any, m: Any, g: Any, where: tuple) -> None:
    """One step of the lateral filter."""
    z = a.stacked
    for k in range(STATES):
        z[k] = a.lateral[k]
    z[STATES], z[STATES + 1] = m.aileron - a.aileron_start, m.rudder - a.rudder_start
    z[STATES + 2], z[STATES + 3], z[STATES + 4], z[STATES + 5] = m.beta, m.p, m.r, m.phi
    product(g.filter_lateral, where, z, a.lateral)


@entry
def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every law, in place; arguments as in `controllers.laws.autopilot.step`, memory: LQG rows.

    The filters are made for steps of 0.02 s.
    """
    for i in range(len(command)):
        a, c, m, t, adv = memory[i], command[i], measurement[i], target[i], advisory[i]
        g = gains[i if len(gains) > 1 else 0]
        if a.engaged == 0.0:
            engage(a, m, t, g)
        scale = surface_scale(m, g)
        theta = guide(a, c, m, t, adv, g, scale, dt)
        settled = command_bank(a, m, t, adv, g, dt)
        where = place(m, g)
        estimate_longitudinal(a, m, g, where, scale)
        estimate_lateral(a, m, g, where)
        x, y = a.longitudinal, a.lateral
        regulate_pitch(a, c, adv, g, where, x[0], x[1], x[2], a.theta_trim + x[3] - theta, dt)
        regulate_bank(a, c, m, g, where, y[0], y[1], y[2] - asked_yaw_rate(a, m), y[3] - a.bank_command, settled, dt)
