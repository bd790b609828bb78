"""Linear model-predictive control of pitch and bank, with the limits of the advisory as constraints.

Fifty times a second, two seconds ahead, each axis alone (`controllers.laws.prediction`):

* model: the clean aircraft at the present airspeed and density. Pitch: angle of attack, pitch rate, pitch, elevator;
  bank: roll rate, bank, aileron. The actuator is a lag; what the model lacks is estimated as in `controllers.laws.l1`
  (a moment) and from the accelerometers (the drift of the angle of attack) and held
* minimised: squares of attitude error, rate error and changes of the command
* held to: travel and rate of the surface; the advised angle of attack and bank, softly, at what they are now

What is not solved is not flown: inputs and outputs of every solve are checked to be finite and the solver's verdict is
read. Otherwise the last good command stands for `hold_time`, then the autopilot's PID takes over, from where the
surface is, until a solve succeeds. A measurement that is not finite freezes all, the last good command stands. Both are
counted in the memory (`fallbacks`). The rudder is the autopilot's yaw damper. `step` is Python, a row at a time: about
a tenth of a millisecond for each aircraft.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import clip, integrated
from controllers.laws.augment import load_augmented
from controllers.laws.autopilot import hold_pitch
from controllers.laws.guidance import surface_scale, turn_pitch_rate
from controllers.laws.posing import (
    ANSWER,
    BANK,
    COLUMNS,
    MODEL_BANK,
    MODEL_PITCH,
    MPC,
    OWN_GAINS,
    PITCH,
    Q_BANK,
    Q_PITCH,
    ROOM,
    SOUND,
    keep,
    prepare,
)
from controllers.laws.prediction import SAMPLE, plan, solve
from icing_env.jit import entry, kernel


def default_gains(name: str | Path = "mpc") -> NDArray[Any]:
    """Weights, gains of the outer loops and of the PID, one row. Raises InputError for a file that does not fit."""
    return load_augmented(name, OWN_GAINS)


def init(n: int) -> NDArray[Any]:
    """Memory of `n` aircraft, not yet engaged (MPC rows)."""
    return np.zeros(n, MPC)


@kernel
def accept_pitch(a: Any, c: Any, w: Any, m: Any, adv: Any, g: Any, dt: float) -> None:
    """Elevator: the programme's answer; without one the last good command, then the PID, which otherwise follows."""
    scale, theta = surface_scale(m, g), w[ROOM + 5]
    if math.isfinite(w[ANSWER]):
        a.failed_pitch = 0.0
        c.elevator = clip(m.elevator + w[ANSWER], g.elevator_min, g.elevator_max)
        beyond = scale*(g.K_theta*(m.theta - theta) + g.K_q*(m.q - turn_pitch_rate(m)))
        a.elevator_trim = clip(c.elevator - beyond, g.elevator_min, g.elevator_max)
        return
    a.failed_pitch += dt
    c.elevator = a.good_elevator
    if a.failed_pitch > g.hold_time:
        hold_pitch(a, c, m, adv, g, theta, scale, dt)


@kernel
def accept_bank(a: Any, c: Any, w: Any, m: Any, g: Any, dt: float) -> None:
    """Aileron, in the same way."""
    scale = surface_scale(m, g)
    if math.isfinite(w[ANSWER + 1]):
        a.failed_bank = 0.0
        c.aileron = clip(m.aileron + w[ANSWER + 1], -g.aileron_max, g.aileron_max)
        beyond = scale*(g.K_phi*(m.phi - a.bank_command) + g.K_p*m.p)
        a.aileron_trim = clip(c.aileron - beyond, -g.aileron_max, g.aileron_max)
        return
    a.failed_bank += dt
    c.aileron = a.good_aileron
    if a.failed_bank > g.hold_time:
        error = m.phi - a.bank_command
        wanted = a.aileron_trim + scale*(g.K_phi*error + g.K_p*m.p)
        rate = scale*g.K_phi_integral*error*dt
        a.aileron_trim = integrated(a.aileron_trim, rate, wanted, -g.aileron_max, g.aileron_max)
        c.aileron = clip(wanted, -g.aileron_max, g.aileron_max)


@entry
def conclude(work: NDArray[np.float64], memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any],
             advisory: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """Answers in `work` into commands, or the fallback; every command is then remembered as good."""
    for i in range(len(command)):
        w, a, c, m, adv = work[i], memory[i], command[i], measurement[i], advisory[i]
        g = gains[i if len(gains) > 1 else 0]
        if w[SOUND] == 1.0:
            accept_pitch(a, c, w, m, adv, g, dt)
            accept_bank(a, c, w, m, g, dt)
            if a.failed_pitch + a.failed_bank > 0.0:
                a.fallbacks += 1.0
            keep(a, c)


def solve_pitch(w: NDArray[np.float64], g: Any, dt: float) -> float:
    """Change of the elevator from where it is [rad], NaN without a solution; one row of `work` and of the gains."""
    weights = (g["weight_pitch"], g["weight_q"], g["weight_elevator"], g["weight_slack"])
    p = plan(tuple(w[MODEL_PITCH:MODEL_PITCH + 20]), weights, PITCH)
    return solve(p, w[Q_PITCH:Q_PITCH + 7], g["elevator_min"] - w[ROOM], g["elevator_max"] - w[ROOM],
                 g["elevator_rate"]*dt, g["elevator_rate"]*SAMPLE, math.inf, w[ROOM + 2], g["weight_excess"])


def solve_bank(w: NDArray[np.float64], g: Any, dt: float) -> float:
    """The same of the aileron."""
    weights = (g["weight_bank"], g["weight_p"], g["weight_aileron"], g["weight_slack"])
    p = plan(tuple(w[MODEL_BANK:MODEL_BANK + 12]), weights, BANK)
    return solve(p, w[Q_BANK:Q_BANK + 6], -g["aileron_max"] - w[ROOM + 1], g["aileron_max"] - w[ROOM + 1],
                 g["aileron_rate"]*dt, g["aileron_rate"]*SAMPLE, w[ROOM + 3], w[ROOM + 4], g["weight_excess"])


def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every aircraft, in place.

    Args:
        memory: MPC rows, one per aircraft; changed.
        command: COMMAND rows; surfaces, power levers and flap are written, ice protection is left alone.
        measurement: MEASUREMENT rows.
        estimate: not used by this law.
        target: TARGET rows.
        advisory: ADVISORY rows.
        airframe: PARAMETERS of the clean aircraft, one row for all or one per aircraft.
        gains: one row of `default_gains` for all, or one per aircraft.
        dt: time since the last step [s].
    """
    del estimate
    work = np.zeros((len(command), COLUMNS))
    prepare(work, memory, command, measurement, target, advisory, airframe, gains, dt)
    for i, w in enumerate(work):
        if w[SOUND] == 1.0:
            g = gains[i if len(gains) > 1 else 0]
            w[ANSWER], w[ANSWER + 1] = solve_pitch(w, g, dt), solve_bank(w, g, dt)
    conclude(work, memory, command, measurement, advisory, gains, dt)
