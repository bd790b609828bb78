"""Function 4, adapt the control laws: a layer between any controller and the protection.

With it the iced aircraft answers as the clean one does (`controllers.ice_management.clean_answer`).

What is believed of each derivative, as a share of its clean value, follows the estimate while that is good and stays
where it is (frozen) while it is not: the observer unhealthy, too little excitation, a standard error beyond its bound.
Gains follow from it in every step, for the airspeed and density of now; with every share at 1 they vanish and commands
pass bit by bit. All act on departures of state and command from their slow means, so that nothing jumps when the
adaptation comes, goes or changes, and the trim stays the controller's. It leaves, over some seconds, where linear
derivatives say nothing: beyond the alpha limit, in steep bank, in an upset.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.ice_management.clean_answer import (
    bounded,
    change_aileron_rudder,
    change_elevator,
    quasi_inertia,
    quasi_pitch,
)
from controllers.kernels import air_density, clip
from controllers.parameters import read_parameters
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

BELIEVED = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_elevator", "Cl_beta", "Cl_p", "Cl_aileron", "Cn_beta", "Cn_r",
            "Cn_rudder")  # fmt: skip
MEANS = ("alpha", "q", "beta", "p", "r", "elevator", "aileron", "rudder")
ADAPTATION_FIELDS: list[Field] = [
    ("engaged", "0/1", "0 until the first step, which starts the slow means where things are"),
    ("share", "0..1", "share of the adaptation that is in force"),
    ("frozen_pitch", "0/1", "the longitudinal estimate is too poor to follow"),
    ("frozen_turn", "0/1", "the lateral estimate is too poor to follow"),
    *((name, "1", "share of its clean value that is believed") for name in BELIEVED),
    *((f"mean_{name}", "rad or rad/s", "slow mean") for name in MEANS),
]
ADAPTATION = structured(ADAPTATION_FIELDS)
ADAPTATION_TUNING_FIELDS: list[Field] = [
    ("follow_time", "s", "time constant with which beliefs follow good estimates"),
    ("mean_time", "s", "time constant of the slow means"),
    ("share_time", "s", "time in which the adaptation comes into force or leaves it"),
    ("excitation_low", "1", "excitation below which an axis is frozen"),
    ("doubt_max", "1", "largest standard error of a derivative over its clean value that is followed"),
    ("stability_min", "1", "least share of a stability or damping derivative that is believed"),
    ("control_min", "1", "least share of a control derivative that is believed"),
    ("share_max", "1", "largest share of any derivative that is believed"),
    ("roll_per_lift", "1", "most that roll derivatives lose per loss of lift slope"),
    ("roll_margin", "1", "loss of roll derivatives believed without any of lift slope"),
    ("loop_lag", "s", "lag of actuators and instruments in the loop"),
    ("elevator_most", "rad", "largest change of the elevator"),
    ("aileron_most", "rad", "largest change of the aileron"),
    ("rudder_most", "rad", "largest change of the rudder"),
    ("bank_most", "rad", "bank beyond which the adaptation leaves"),
]
ADAPTATION_TUNING = structured(ADAPTATION_TUNING_FIELDS)


def load_tuning(name: str | Path = "adaptation") -> NDArray[Any]:
    """Numbers of the adaptation, one row of ADAPTATION_TUNING. Raises InputError for a file that does not fit."""
    return read_parameters(name, ADAPTATION_TUNING_FIELDS)


def init(n: int) -> NDArray[Any]:
    """Adaptations of `n` aircraft believed to be clean, not yet engaged (ADAPTATION rows)."""
    memory = np.zeros(n, ADAPTATION)
    for name in BELIEVED:
        memory[name] = 1.0
    return memory


@kernel
def followed(share: float, value: float, std: float, clean: float, low: float, way: float, g: Any) -> float:
    """Believed share of one derivative a step on: towards its estimate, not below `low`; held in doubt."""
    found = value/clean
    if not (math.isfinite(found) and std < g.doubt_max*abs(clean)):
        return share
    return share + way*(clip(found, low, g.share_max) - share)


@kernel
def believe(b: Any, e: Any, m: Any, frame: Any, g: Any, dt: float) -> None:
    """Let beliefs follow the estimate where it is good; says which axes are frozen."""
    way = 1.0 - math.exp(-dt/g.follow_time)
    low, least = g.stability_min, g.control_min
    cm_alpha, cm_q = quasi_pitch(frame, air_density(m))
    cm_elevator = frame.Cm_elevator/quasi_inertia(frame, air_density(m))
    good = e.health == 1.0 and e.excitation_longitudinal >= g.excitation_low
    b.frozen_pitch = 0.0 if good and e.Cm_alpha_std < g.doubt_max*abs(cm_alpha) else 1.0
    if good:
        b.CL_alpha = followed(b.CL_alpha, e.CL_alpha, e.CL_alpha_std, frame.CX_0 - frame.CZ_alpha, low, way, g)
        b.Cm_alpha = followed(b.Cm_alpha, e.Cm_alpha, e.Cm_alpha_std, cm_alpha, low, way, g)
        b.Cm_q = followed(b.Cm_q, e.Cm_q, e.Cm_q_std, cm_q, low, way, g)
        b.Cm_elevator = followed(b.Cm_elevator, e.Cm_elevator, e.Cm_elevator_std, cm_elevator, least, way, g)
    good = e.health == 1.0 and e.excitation_lateral >= g.excitation_low
    b.frozen_turn = 0.0 if good and e.Cn_beta_std < g.doubt_max*abs(frame.Cn_beta) else 1.0
    if good:
        # gusts on half wings unlike in slope roll the aircraft as if aileron and damping were lost
        wing = 1.0 - g.roll_per_lift*(1.0 - b.CL_alpha) - g.roll_margin
        b.Cl_beta = followed(b.Cl_beta, e.Cl_beta, e.Cl_beta_std, frame.Cl_beta, max(low, wing), way, g)
        b.Cl_p = followed(b.Cl_p, e.Cl_p, e.Cl_p_std, frame.Cl_p, max(low, wing), way, g)
        b.Cl_aileron = followed(b.Cl_aileron, e.Cl_aileron, e.Cl_aileron_std, frame.Cl_aileron, max(least, wing), way,
                                g)
        b.Cn_beta = followed(b.Cn_beta, e.Cn_beta, e.Cn_beta_std, frame.Cn_beta, low, way, g)
        b.Cn_r = followed(b.Cn_r, e.Cn_r, e.Cn_r_std, frame.Cn_r, low, way, g)
        b.Cn_rudder = followed(b.Cn_rudder, e.Cn_rudder, e.Cn_rudder_std, frame.Cn_rudder, least, way, g)


@kernel
def average(b: Any, c: Any, m: Any, g: Any, dt: float) -> None:
    """Slow means of state and command; the first step starts them where things are."""
    way = 1.0 - math.exp(-dt/g.mean_time) if b.engaged == 1.0 else 1.0
    b.engaged = 1.0
    b.mean_alpha += way*(m.alpha - b.mean_alpha)
    b.mean_q += way*(m.q - b.mean_q)
    b.mean_beta += way*(m.beta - b.mean_beta)
    b.mean_p += way*(m.p - b.mean_p)
    b.mean_r += way*(m.r - b.mean_r)
    b.mean_elevator += way*(c.elevator - b.mean_elevator)
    b.mean_aileron += way*(c.aileron - b.mean_aileron)
    b.mean_rudder += way*(c.rudder - b.mean_rudder)


@entry
def adapt(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
          advisory: NDArray[Any], airframe: NDArray[Any], tuning: NDArray[Any], dt: float) -> None:
    """One step of every adaptation: changes elevator, aileron and rudder of `command` in place.

    Args:
        memory: ADAPTATION rows; changed.
        command: COMMAND rows as the controller wants them. A row that is not finite passes as it is.
        measurement, estimate: MEASUREMENT and ESTIMATE rows.
        advisory: ADVISORY rows; `adaptation` and `adaptation_frozen` are written.
        airframe: PARAMETERS rows of the clean aircraft, one for all or one each.
        tuning: one ADAPTATION_TUNING row for all, or one per aircraft.
        dt: time since the last step [s].
    """
    for i in range(len(command)):
        b, c, m, a = memory[i], command[i], measurement[i], advisory[i]
        frame = airframe[i if len(airframe) > 1 else 0]
        g = tuning[i if len(tuning) > 1 else 0]
        seen = m.alpha + m.q + m.beta + m.p + m.r + m.airspeed + m.pressure + m.temperature
        if not math.isfinite(seen + c.elevator + c.aileron + c.rudder):
            b.engaged, a.adaptation, a.adaptation_frozen = 0.0, 0.0, 1.0
            continue
        believe(b, estimate[i], m, frame, g, dt)
        average(b, c, m, g, dt)
        linear = m.alpha < a.alpha_limit and abs(m.phi) < g.bank_most and a.tail_stall + a.roll_upset == 0.0
        b.share = clip(b.share + (dt if linear else -dt)/g.share_time, 0.0, 1.0)
        a.adaptation, a.adaptation_frozen = b.share, max(b.frozen_pitch, b.frozen_turn)
        pitch = change_elevator(b, m, frame, c.elevator - b.mean_elevator, m.alpha - b.mean_alpha, m.q - b.mean_q,
                                g.loop_lag)
        roll, yaw = change_aileron_rudder(b, m, frame, c.aileron - b.mean_aileron, c.rudder - b.mean_rudder,
                                          m.beta - b.mean_beta, m.p - b.mean_p, m.r - b.mean_r, g.loop_lag)
        c.elevator = bounded(b.share*pitch, g.elevator_most, c.elevator, frame.elevator_min, frame.elevator_max)
        c.aileron = bounded(b.share*roll, g.aileron_most, c.aileron, frame.aileron_min, frame.aileron_max)
        c.rudder = bounded(b.share*yaw, g.rudder_most, c.rudder, frame.rudder_min, frame.rudder_max)
