"""Control-barrier functions: the least change to elevator, aileron and power that keeps every barrier.

A quadratic programme in each step, the rival of `surfaces` and `predictive` (Ames et al., Control Barrier Functions:
Theory and Applications, ECC 2019). A barrier h >= 0 of relative degree two in its control is kept by the exponential
condition (Nguyen & Sreenath, ACC 2016)

    h'' + (w1 + w2) h' + w1 w2 h >= 0,

of degree one by h' + w h >= 0. With what `predictive` believes of the response:

* alpha: h = alpha_limit - alpha, through q' (elevator); the same below, h = alpha + alpha_down, so that nothing pushes
  the nose down into the inverted stall or the tailplane's
* airspeed by attitude: h = gamma_max + alpha - theta, gamma_max the climb angle at which the airspeed would settle to
  its limit with the thrust of now, sin gamma_max = (V' + g sin gamma + w (V - airspeed_limit))/g; no tighter than a
  dive angle
* airspeed by power: h = V - airspeed_limit, V' grows by thrust per mass for all the levers' way left
* bank: h = bank_limit -+ phi, through p' (aileron)

Cost: squared changes over the travel of each control; every barrier but bank's has a slack, dear to use. Where no
barrier is broken by the command, it passes bit by bit and no programme is solved: its solution would be the command.
Every number is checked to be finite before and after the solver (daqp, MIT licence: it reports success on NaN).
Infeasible, not converged or not finite: the law of `surfaces` keeps the limits in that step, and it is counted.
"""

from __future__ import annotations

import math
from ctypes import c_int
from pathlib import Path
from typing import Any

import daqp
import numpy as np
from numpy.typing import NDArray

from controllers.kernels import airspeed_of, airspeed_rate, clip
from controllers.parameters import read_parameters
from controllers.protection import surfaces
from controllers.protection.common import stick_back
from controllers.protection.predictive import OWN_FIELDS as PREDICTION_FIELDS
from controllers.protection.predictive import pitch_response, roll_response
from controllers.protection.surfaces import PROTECTION_FIELDS
from icing_env.atmosphere import G0
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

OWN_FIELDS: list[Field] = [
    ("alpha_fast", "1/s", "w1 of the alpha barriers"),
    ("alpha_slow", "1/s", "w2 of the alpha barriers"),
    ("alpha_down", "rad", "alpha below zero that is kept, as a positive number"),
    ("pitch_fast", "1/s", "w1 of the airspeed barrier by attitude"),
    ("pitch_slow", "1/s", "w2 of the same"),
    ("airspeed", "1/s", "w of the airspeed barriers"),
    ("dive", "rad", "dive angle beyond which attitude does not serve the airspeed, positive"),
    ("bank_fast", "1/s", "w1 of the bank barriers"),
    ("bank_slow", "1/s", "w2 of the bank barriers"),
    ("slack", "1", "cost of a squared slack over that of a squared full travel"),
    ("lever_known", "0..1", "lever below which thrust is taken as that of this lever"),
]
# own fields first: a type that merely went on after another would pass for it
BARRIER = structured([*OWN_FIELDS, *PREDICTION_FIELDS, *PROTECTION_FIELDS])
MEMORY = np.dtype([(name, "f8") for name in ("solved", "fallbacks", "q", "p", "pitch", "roll", "lift", "seated")])
VARIABLES, ROWS = 7, 6  # elevator, aileron, power, slacks of the first four rows; barriers of alpha, airspeed, bank
BARRIERS = np.array([[1, 0, 0, 1, 0, 0, 0], [-1, 0, 0, 0, 1, 0, 0], [1, 0, 0, 0, 0, 1, 0], [0, 0, 1, 0, 0, 0, 1],
                     [0, 1, 0, 0, 0, 0, 0], [0, -1, 0, 0, 0, 0, 0]], float)  # controls in units of their travel
FREE, NEEDED, BROKEN = 0, 1, 2  # the command keeps every barrier; it does not; a number is not finite
INEQUALITY = np.zeros(VARIABLES + ROWS, c_int)
ENDLESS = 1e30
COST, NOTHING = np.eye(VARIABLES), np.zeros(VARIABLES)


def load_tuning(name: str | Path = "barrier") -> NDArray[Any]:
    """Numbers of `surfaces`, of the prediction and of the barriers, one row; InputError where a file does not fit."""
    row = np.zeros(1, BARRIER)
    for part in (read_parameters("envelope_protection", PROTECTION_FIELDS),
                 read_parameters("predictive", PREDICTION_FIELDS), read_parameters(name, OWN_FIELDS)):
        for field in part.dtype.names or ():
            row[field] = part[field]
    return row


def init(n: int) -> NDArray[Any]:
    """Memory of `n` aircraft: rates and models behind a lag, programmes solved and steps of the fallback."""
    return np.zeros(n, MEMORY)


@kernel
def elevator_needs(a: Any, m: Any, response: tuple, g: Any) -> tuple[float, float, float]:
    """Elevator [rad] that alpha asks for at least, at most, and that the airspeed asks for at least by attitude."""
    z_alpha, z_q, z_delta, z_0, m_alpha, m_q, m_delta, m_0 = response
    rate = z_alpha*m.alpha + z_q*m.q + z_delta*m.elevator + z_0
    free = m_alpha*m.alpha + m_q*m.q + m_0
    both, product = g.alpha_fast + g.alpha_slow, g.alpha_fast*g.alpha_slow
    drift = z_alpha*rate + z_q*free + both*rate
    power = -z_q*m_delta
    least = (drift - product*(a.alpha_limit - m.alpha))/power
    most = (drift + product*(m.alpha + g.alpha_down))/power
    climb = math.sin(m.theta - m.alpha*math.cos(m.phi))
    spare = airspeed_rate(m, G0)/G0 + climb + g.airspeed*(m.airspeed - a.airspeed_limit)/G0
    highest = math.asin(clip(spare, -math.sin(g.dive), 0.9))
    turning = G0/airspeed_of(m)*math.sin(m.phi)*math.tan(clip(m.phi, -1.2, 1.2))
    by_attitude = (free + (g.pitch_fast + g.pitch_slow)*(m.q - turning)
                   - g.pitch_fast*g.pitch_slow*(highest + m.alpha - m.theta))/-m_delta
    return least, most, by_attitude


@kernel
def power_need(c: Any, a: Any, m: Any, frame: Any, g: Any) -> float:
    """Change of the power levers that the airspeed asks for at least; negative where it asks for none."""
    lever = max(0.5*(m.throttle_left + m.throttle_right), g.lever_known)
    growth = max(m.thrust_left + m.thrust_right, 0.1*frame.mass)/(lever*frame.mass)
    need = -(airspeed_rate(m, G0) + g.airspeed*(m.airspeed - a.airspeed_limit))/growth
    return max(need, a.roll_upset*(g.upset_throttle - min(c.throttle_left, c.throttle_right)))


@kernel
def aileron_needs(a: Any, m: Any, response: tuple, g: Any) -> tuple[float, float]:
    """Aileron [rad] between which bank keeps its barriers, within travel: more than all of it cannot be given."""
    l_p, l_delta, l_0 = response
    free = l_p*m.p + l_0 + (g.bank_fast + g.bank_slow)*m.p
    product = g.bank_fast*g.bank_slow
    least = (free - product*(a.bank_limit - m.phi))/-l_delta
    most = (free + product*(a.bank_limit + m.phi))/-l_delta
    return min(least, g.aileron_max), max(most, -g.aileron_max)


@kernel
def state_programme(s: Any, c: Any, a: Any, m: Any, e: Any, frame: Any, g: Any, share: float, lower: Any,
                    upper: Any) -> int:
    """Bounds of variables and barriers of one aircraft; says whether the command keeps them all."""
    pitch = pitch_response(s, m, e, frame, g, share)
    roll = roll_response(s, m, e, frame, g, share)
    least, most, by_attitude = elevator_needs(a, m, pitch, g)
    left, right = aileron_needs(a, m, roll, g)
    wanted, travel, full = c.elevator - stick_back(a, g), g.elevator_max - g.elevator_min, g.aileron_max
    lever = max(c.throttle_left, c.throttle_right)
    lower[0], upper[0] = min(g.elevator_min - wanted, 0.0)/travel, max(g.elevator_max - wanted, 0.0)/travel
    lower[1], upper[1] = min(-full - c.aileron, 0.0)/full, max(full - c.aileron, 0.0)/full
    lower[2], upper[2] = 0.0, max(1.0 - lever, 0.0)
    lower[3:VARIABLES], upper[3:] = 0.0, ENDLESS
    lower[7], lower[8], lower[9] = (least - wanted)/travel, (wanted - most)/travel, (by_attitude - wanted)/travel
    if a.tail_stall == 1.0:
        lower[9] = -1.0  # a stalled tailplane is not pushed down for airspeed
    lower[10] = power_need(c, a, m, frame, g)
    lower[11], lower[12] = (left - c.aileron)/full, (c.aileron - right)/full
    needed = FREE if wanted == c.elevator else NEEDED
    for k in range(VARIABLES + ROWS):
        if not (math.isfinite(lower[k]) and math.isfinite(upper[k])):
            return BROKEN
        if k >= VARIABLES and lower[k] > 0.0:
            needed = NEEDED
    return needed


@entry
def state_programmes(memory: NDArray[Any], command: NDArray[Any], advisory: NDArray[Any], measurement: NDArray[Any],
                     estimate: NDArray[Any], airframe: NDArray[Any], tuning: NDArray[Any], dt: float,
                     lower: NDArray[Any], upper: NDArray[Any], verdict: NDArray[Any]) -> int:
    """`state_programme` of every row; flap limited; returns how many need a solver or the fallback."""
    count = 0
    for i in range(len(command)):
        c, a = command[i], advisory[i]
        frame = airframe[i if len(airframe) > 1 else 0]
        g = tuning[i if len(tuning) > 1 else 0]
        share = 1.0 - math.exp(-dt/g.lag)
        verdict[i] = state_programme(memory[i], c, a, measurement[i], estimate[i], frame, g, share, lower[i], upper[i])
        c.flap = min(c.flap, a.flap_limit)
        if verdict[i] == FREE:
            a.intervention = a.intervention_aileron = 0.0
        else:
            count += 1
    return count


@entry
def obey(command: NDArray[Any], advisory: NDArray[Any], tuning: NDArray[Any], x: NDArray[Any], i: int) -> None:
    """Write the solution of row `i` into its command."""
    c, a, g = command[i], advisory[i], tuning[i if len(tuning) > 1 else 0]
    elevator = c.elevator - stick_back(a, g) + x[0]*(g.elevator_max - g.elevator_min)
    a.intervention, a.intervention_aileron = elevator - c.elevator, x[1]*g.aileron_max
    c.elevator = elevator
    c.aileron += a.intervention_aileron
    c.throttle_left = max(c.throttle_left, min(c.throttle_left + x[2], 1.0))
    c.throttle_right = max(c.throttle_right, min(c.throttle_right + x[2], 1.0))


def solve(cost: NDArray[Any], lower: NDArray[Any], upper: NDArray[Any]) -> NDArray[Any] | None:
    """Controls in units of their travel and slacks [7], None where there is no finite solution.

    Args:
        cost: [7, 7], of the squares.
        lower, upper: [13], of the variables and of the barriers.
    """
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        return None
    x, _value, status, _report = daqp.solve(cost, NOTHING, BARRIERS, upper, lower, INEQUALITY)
    return x if status == 1 and np.isfinite(x).all() else None


def protect(memory: NDArray[Any], command: NDArray[Any], advisory: NDArray[Any], measurement: NDArray[Any],
            estimate: NDArray[Any], airframe: NDArray[Any], tuning: NDArray[Any], dt: float) -> None:
    """Keep every aircraft inside its advised envelope: changes `command` and the advisory's `intervention` in place.

    Args:
        memory: of `init`, changed; `solved` and `fallbacks` count steps.
        command: COMMAND rows as the controller wants them; changed only where a barrier would be broken.
        advisory: ADVISORY rows with the limits.
        measurement: MEASUREMENT rows.
        estimate: ESTIMATE rows.
        airframe: one PARAMETERS row of the clean aircraft for all, or one per aircraft.
        tuning: one BARRIER row for all, or one per aircraft.
        dt: time since the last step [s].
    """
    n = len(command)
    lower, upper, verdict = np.empty((n, VARIABLES + ROWS)), np.empty((n, VARIABLES + ROWS)), np.empty(n, np.int64)
    if not state_programmes(memory, command, advisory, measurement, estimate, airframe, tuning, dt, lower, upper,
                            verdict):
        return
    for i in np.flatnonzero(verdict).tolist():
        row = slice(i, i + 1)
        cost = COST.copy()
        cost[3:, 3:] *= tuning["slack"][i if len(tuning) > 1 else 0]
        x = solve(cost, lower[i], upper[i]) if verdict[i] == NEEDED else None
        if x is not None:
            obey(command, advisory, tuning, x, i)
            memory["solved"][i] += 1.0
            continue
        frame, g = airframe if len(airframe) == 1 else airframe[row], tuning if len(tuning) == 1 else tuning[row]
        surfaces.protect(memory["fallbacks"][row], command[row], advisory[row], measurement[row], estimate[row], frame,
                         g, dt)
        memory["fallbacks"][i] += 1.0
