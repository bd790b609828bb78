"""Modal properties and levels of an aircraft with the adaptation in the loop, by linearising both about a trim.

The plant is linearised with its true ice; actuators, vanes, anti-boom filter, sampling and slow means are added as
states, and the adaptation as the gains that its own compiled step shows by differences, so that what is judged is what
flies. The nose boom (7 Hz) and noise are left out. Modes are told apart by participation factors (Kundur, Power System
Stability and Control, section 12.2).

Levels: MIL-F-8785C, class II, category B (cruise, level flight): short-period damping and CAP, Dutch roll, roll time
constant, spiral, phugoid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers import ice_management
from controllers.ice_management import adapt
from icing_env.atmosphere import G0, density, pressure
from icing_env.linearise import BODY, INPUTS, LAGS, Plant, linearise
from icing_env.trim import Trim
from icing_env.types import COMMAND, ESTIMATE, MEASUREMENT

FloatArray = NDArray[np.float64]
SEEN = ("alpha", "q", "beta", "p", "r")  # that the adaptation feeds back
SURFACES = INPUTS[:3]
STATES = (*BODY, *LAGS)
FASTEST = 12.0  # rad/s: modes of the rigid aircraft are slower, actuators and instruments faster
SLOWEST = 0.4  # rad/s: short period, Dutch roll and roll are faster; phugoid, spiral and slow means slower
DELAY = 1.5  # steps: one from instrument to command, half of one for the hold
LEAST = 1e-6  # difference by which gains are found


@dataclass(frozen=True)
class Qualities:
    """Modes of one aircraft; nan where a mode is not found.

    Attributes:
        short_period, short_period_damping, dutch_roll, dutch_roll_damping: rad/s, 1.
        roll: time constant [s]. spiral: time to double [s], infinite if stable. phugoid_damping: 1.
        cap: control anticipation parameter [rad/s2 per g]: frequency squared over load factor per alpha.
        pitch, turn, yaw: angular acceleration per elevator, aileron, rudder asked for [1/s2].
    """

    short_period: float
    short_period_damping: float
    dutch_roll: float
    dutch_roll_damping: float
    roll: float
    spiral: float
    phugoid_damping: float
    cap: float
    pitch: float
    turn: float
    yaw: float


def gains(belief: NDArray, trim: Trim, clean: NDArray, tuning: NDArray) -> tuple[FloatArray, FloatArray]:
    """Command per measured state [3, 5] and per command asked for [3, 3] of the adaptation as it flies, about a trim.

    Args:
        belief: one ADAPTATION row, its beliefs.
        trim: about which.
        clean: PARAMETERS row that the adaptation believes in.
        tuning: ADAPTATION_TUNING row.
    """
    n = 1 + len(SEEN) + len(SURFACES)
    altitude = float(trim.state["altitude"][0])
    m, c, advisory = np.zeros(n, MEASUREMENT), np.zeros(n, COMMAND), ice_management.init(n)
    m["airspeed"], m["alpha"], m["beta"] = trim.condition["airspeed"], trim.alpha, trim.beta
    m["pressure"] = pressure(altitude)
    m["temperature"] = pressure(altitude)/(287.053*density(altitude))
    for name in SURFACES:
        c[name] = getattr(trim, name)
    memory = np.repeat(belief, n)
    memory["engaged"], memory["share"] = 1.0, 1.0
    for name in SEEN:
        memory[f"mean_{name}"] = m[name]
    for name in SURFACES:
        memory[f"mean_{name}"] = c[name]
    for k, name in enumerate(SEEN):
        m[name][1 + k] += LEAST
    for k, name in enumerate(SURFACES):
        c[name][1 + len(SEEN) + k] += LEAST
    adapt.adapt(memory, c, m, np.zeros(n, ESTIMATE), advisory, clean, tuning, 1e-12)
    out = np.array([c[name] for name in SURFACES])
    slope = (out[:, 1:] - out[:, :1])/LEAST
    return slope[:, :len(SEEN)], slope[:, len(SEEN):]


def closed(trim: Trim, parameters: NDArray, by_state: FloatArray, by_command: FloatArray, mean_time: float,
           dt: float = 0.02) -> tuple[FloatArray, FloatArray, tuple[str, ...]]:
    """Aircraft, actuators, instruments and adaptation as x_dot = A x + B u, u the surfaces asked for; names of x.

    Args:
        by_state, by_command: of `gains`.
        mean_time: s, of the adaptation's slow means.
        dt: s, step; half a step of hold and one of delay are one Pade section (Franklin, Powell & Emami-Naeini, 5.6.3).
    """
    plant = linearise(trim, parameters)
    p, index = parameters[0], [STATES.index(name) for name in SEEN]
    n, k = len(STATES), len(SEEN)
    names = (*STATES, *(f"position_{s}" for s in SURFACES), *(f"vane_{s}" for s in SEEN), *(f"seen_{s}" for s in SEEN),
             *(f"mean_{s}" for s in SEEN), *(f"mean_{s}" for s in SURFACES), *(f"late_{s}" for s in SURFACES))
    a, b = np.zeros((len(names), len(names))), np.zeros((len(names), 3))
    x, position, vane, seen, mean, asked, late = (
        slice(i, j) for i, j in zip(np.cumsum([0, n, 3, k, k, k, 3]), np.cumsum([n, 3, k, k, k, 3, 3]), strict=True))
    a[x, x], a[x, position] = plant.A, plant.B[:, :3]
    fast = 1.0/np.where(np.isin(SEEN, ("alpha", "beta")), max(float(p["vane_lag"]), 1e-3), 1e-3)
    a[vane, index], a[vane, vane] = np.diag(fast), -np.diag(fast)
    cut = 2.0*math.pi*max(float(p["filter_frequency"]), 1.0)
    a[seen, vane], a[seen, seen] = cut*np.eye(k), -cut*np.eye(k)
    a[mean, seen], a[mean, mean] = np.eye(k)/mean_time, -np.eye(k)/mean_time
    a[asked, asked], b[asked] = -np.eye(3)/mean_time, np.eye(3)/mean_time
    # u = asked + by_state (seen - mean) + (by_command - 1)(asked - its mean), then late: (2/T - s)/(2/T + s)
    row = np.zeros((3, len(names)))
    row[:, seen], row[:, mean], row[:, asked] = by_state, -by_state, np.eye(3) - by_command
    rate = 2.0/(DELAY*dt)
    a[late], b[late] = 2.0*rate*row, 2.0*rate*by_command
    a[late, late] -= rate*np.eye(3)
    lag = 1.0/np.array([float(p[f"{s}_lag"]) for s in SURFACES])[:, None]
    a[position] -= lag*row
    a[position, late] += lag*np.eye(3)
    a[position, position] -= lag*np.eye(3)
    b[position] = -lag*by_command
    return a, b, names


def qualities(trim: Trim, parameters: NDArray, clean: NDArray | None = None, belief: NDArray | None = None,
              tuning: NDArray | None = None) -> Qualities:
    """Flying qualities about a trim; with the adaptation of `clean` and `belief` if these are given."""
    tuning = adapt.load_tuning() if tuning is None else tuning
    if belief is None or clean is None:
        by_state, by_command = np.zeros((3, len(SEEN))), np.eye(3)
    else:
        by_state, by_command = gains(belief, trim, clean, tuning)
    a, _b, names = closed(trim, parameters, by_state, by_command, float(tuning["mean_time"][0]))
    plant = Plant(trim, parameters)
    z, u = plant.reference()
    push = np.eye(len(INPUTS))[:, :3]*1e-5
    turn = np.stack([(plant.rates(z, u + push[:, i]) - plant.rates(z, u - push[:, i]))/2e-5 for i in range(3)], axis=1)
    power = turn[[STATES.index(s) for s in ("q", "p", "r")]] @ by_command
    short = _mode(a, names, ("alpha", "q"), oscillates=True)
    dutch = _mode(a, names, ("beta", "r"), oscillates=True)
    long = _mode(a, names, ("airspeed", "theta"), oscillates=True, slow=True)
    roll, spiral = _mode(a, names, ("p",), oscillates=False), _mode(a, names, ("phi",), oscillates=False, slow=True)
    load = -float(trim.condition["airspeed"][0])/G0*a[STATES.index("alpha"), STATES.index("alpha")]
    double = math.inf if not spiral.real > 0.0 else math.log(2.0)/spiral.real
    return Qualities(abs(short), -short.real/abs(short), abs(dutch), -dutch.real/abs(dutch), -1.0/roll.real, double,
                     -long.real/abs(long), abs(short)**2/load, float(power[0, 0]), float(power[1, 1]),
                     float(power[2, 2]))


def _mode(a: FloatArray, names: tuple[str, ...], states: tuple[str, ...], oscillates: bool, slow: bool = False
          ) -> complex:  # fmt: skip
    """Eigenvalue in which the states of that name take part most; nan if there is none of the kind."""
    values, right = np.linalg.eig(a)
    part = np.abs(right*np.linalg.inv(right).T)
    part /= part.sum(axis=0)
    share = part[[names.index(s) for s in states]].sum(axis=0)
    size = np.abs(values)
    kind = values.imag > 1e-6 if oscillates else np.abs(values.imag) <= 1e-6
    kind &= (size < SLOWEST) if slow else (size >= SLOWEST) & (size < FASTEST)
    if not kind.any():
        return complex(math.nan, math.nan)
    return complex(values[np.argmax(np.where(kind, share, -1.0))])


def level(q: Qualities) -> int:
    """Worst level, 1 to 3, or 4 beyond (MIL-F-8785C 3.2.2.1, 3.2.1.2, 3.3.1; class II, category B)."""
    dutch = q.dutch_roll_damping*q.dutch_roll
    steps = (
        (0.30 <= q.short_period_damping <= 2.0, 0.20 <= q.short_period_damping <= 2.0, q.short_period_damping >= 0.15),
        (0.085 <= q.cap <= 3.6, 0.038 <= q.cap <= 10.0, q.cap >= 0.038),
        (q.phugoid_damping >= 0.04, q.phugoid_damping >= 0.0, True),
        (q.dutch_roll_damping >= 0.08 and dutch >= 0.15 and q.dutch_roll >= 0.4,
         q.dutch_roll_damping >= 0.02 and dutch >= 0.05 and q.dutch_roll >= 0.4,
         q.dutch_roll_damping >= 0.0 and q.dutch_roll >= 0.4),
        (q.roll <= 1.4, q.roll <= 3.0, q.roll <= 10.0),
        (q.spiral >= 20.0, q.spiral >= 8.0, q.spiral >= 4.0),
    )
    return max((*step, True).index(True) + 1 for step in steps)
