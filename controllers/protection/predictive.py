"""Predictive envelope protection: how far may elevator and aileron go, held, before the response passes its limit?

The open-loop protection of Hossain, Sharma, Bragg & Voulgaris (AIAA 2003-25): in each step the short-period and the
roll response are run forward from the measured state with the control held, with the derivatives as they are believed
now, and the control is limited to what keeps the predicted peak at the limit. The response is linear in the held
control, x(t) = free(t) + unit(t) delta, so the largest permitted control comes from one run, max over t of
(limit - free)/unit, where the paper iterates.

* alpha' = z_alpha alpha + (1 + z_q) q + z_delta delta + z_0 + 2 g decay t/V^2,   decay = loss of airspeed now [m/s2]
* q' = m_alpha alpha + m_q q + m_delta delta + m_0;   phi' = p;   p' = l_p p + l_delta delta + l_0
* z_0, m_0 and l_0 are what the measured rates leave unexplained, behind a lag: trim, gusts and whatever the
  derivatives do not know

Exact transition over each step; the input by the exponential trapezoidal rule, 1 % at a step of a sixth of the short
period. Near its limit the control is rounded off and then held: an autopilot meets it as a limit on its command, a
pilot as a soft stop of the stick. Airspeed, flap and recoveries are those of `controllers.protection.common`.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import air_density, airspeed_of, airspeed_rate, alpha_rate, clip
from controllers.parameters import read_parameters
from controllers.protection.common import keep_pitch, keep_roll, pitching_moment, trust
from controllers.protection.surfaces import PROTECTION_FIELDS
from icing_env.atmosphere import G0
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

OWN_FIELDS: list[Field] = [
    ("step", "s", "of the prediction"),
    ("pitch_horizon", "s", "how far the short-period response is run"),
    ("roll_horizon", "s", "how far the roll response is run"),
    ("blind", "s", "first part of the prediction, which no control can change any more"),
    ("lag", "s", "time constant of what the measured rates leave unexplained"),
    ("decay_max", "m/s2", "largest loss of airspeed that is run forward"),
]
PREDICTIVE = structured([*OWN_FIELDS, *PROTECTION_FIELDS])  # a type that went on after another would pass for it
MEMORY = np.dtype([(name, "f8") for name in ("q", "p", "pitch", "roll", "lift", "seated")])


def load_tuning(name: str | Path = "predictive") -> NDArray[Any]:
    """Gains of `surfaces` and the numbers of the prediction, one row; InputError where a file does not fit."""
    row = np.zeros(1, PREDICTIVE)
    for part in (read_parameters("envelope_protection", PROTECTION_FIELDS), read_parameters(name, OWN_FIELDS)):
        for field in part.dtype.names or ():
            row[field] = part[field]
    return row


def init(n: int) -> NDArray[Any]:
    """Memory of `n` aircraft: rates and models behind the lag."""
    return np.zeros(n, MEMORY)


@kernel
def transition(a: float, b: float, c: float, d: float, h: float) -> tuple[float, float, float, float]:
    """exp([[a, b], [c, d]] h), row by row (Cayley-Hamilton)."""
    mean, half = 0.5*(a + d), 0.5*(a - d)
    square = half*half + b*c
    root = math.sqrt(abs(square))
    if root*h < 1e-6:
        even, odd = 1.0, h
    elif square > 0.0:
        even, odd = math.cosh(root*h), math.sinh(root*h)/root
    else:
        even, odd = math.cos(root*h), math.sin(root*h)/root
    grown = math.exp(mean*h)
    return grown*(even + odd*half), grown*odd*b, grown*odd*c, grown*(even - odd*half)


@kernel
def bounds(x: float, rate: float, a: float, b: float, c: float, d: float, first: float, ramp: float, second: float,
           gain1: float, gain2: float, low: float, high: float, horizon: float, g: Any) -> tuple[float, float]:
    """Least and largest held control with which x stays between `low` and `high` from `g.blind` to `horizon`.

    [x, rate]' = [[a, b], [c, d]] [x, rate] + [first + ramp t, second] + [gain1, gain2] control; gain2 < 0.
    """
    h = g.step
    t11, t12, t21, t22 = transition(a, b, c, d, h)
    x1, x2, u1, u2 = x, rate, 0.0, 0.0
    least, most = -math.inf, math.inf
    for k in range(int(horizon/h + 0.5)):
        y1, y2 = x1 + 0.5*h*(first + ramp*h*k), x2 + 0.5*h*second
        v1, v2 = u1 + 0.5*h*gain1, u2 + 0.5*h*gain2
        x1, x2 = t11*y1 + t12*y2 + 0.5*h*(first + ramp*h*(k + 1)), t21*y1 + t22*y2 + 0.5*h*second
        u1, u2 = t11*v1 + t12*v2 + 0.5*h*gain1, t21*v1 + t22*v2 + 0.5*h*gain2
        if h*(k + 1) >= g.blind and u1 < -1e-6:
            least = max(least, (high - x1)/u1)
            most = min(most, (low - x1)/u1)
    return least, most


@kernel
def lagged(memory: float, value: float, share: float) -> float:
    """First-order lag; a value that is no number changes nothing."""
    return memory + share*(value - memory) if math.isfinite(value) else memory


@kernel
def pitch_response(s: Any, m: Any, e: Any, frame: Any, g: Any, share: float) -> tuple[
        float, float, float, float, float, float, float, float]:
    """z_alpha, 1 + z_q, z_delta, z_0, m_alpha, m_q, m_delta, m_0 of the response, as believed now."""
    speed = airspeed_of(m)
    pressure = 0.5*air_density(m)*speed*speed*frame.wing_area
    heave, pitch = pressure/(frame.mass*speed), pressure*frame.chord/frame.inertia_yy
    known, carry = trust(e.excitation_longitudinal, e.health, g), 0.5*frame.chord/speed
    slope = frame.CX_0 - frame.CZ_alpha
    slope += known*(clip(e.CL_alpha, 0.3*slope, slope) - slope)
    z_alpha, z_q, z_delta = -heave*slope, 1.0 + heave*carry*frame.CZ_q, heave*frame.CZ_elevator
    _cm_0, cm_alpha, cm_elevator = pitching_moment(m, e, frame, g)
    m_alpha, m_q, m_delta = pitch*cm_alpha, pitch*carry*frame.Cm_q, pitch*cm_elevator
    rest = alpha_rate(m, G0) - (z_alpha*m.alpha + z_q*m.q + z_delta*m.elevator)
    modelled = m_alpha*m.alpha + m_q*m.q + m_delta*m.elevator
    if s.seated == 0.0:
        s.q, s.pitch, s.lift = m.q, modelled, rest
    given = (m.q - s.q)/g.lag
    s.q, s.pitch, s.lift = lagged(s.q, m.q, share), lagged(s.pitch, modelled, share), lagged(s.lift, rest, share)
    return z_alpha, z_q, z_delta, s.lift, m_alpha, m_q, m_delta, given - s.pitch


@kernel
def roll_response(s: Any, m: Any, e: Any, frame: Any, g: Any, share: float) -> tuple[float, float, float]:
    """l_p, l_delta and l_0 of the response, as believed now; seats the memory, so it comes after `pitch_response`."""
    speed = airspeed_of(m)
    roll = 0.5*air_density(m)*speed*speed*frame.wing_area*frame.span/frame.inertia_xx
    known = trust(e.excitation_lateral, e.health, g)
    damping = frame.Cl_p + known*(clip(e.Cl_p, frame.Cl_p, 0.3*frame.Cl_p) - frame.Cl_p)
    power = frame.Cl_aileron + known*(clip(e.Cl_aileron, frame.Cl_aileron, 0.3*frame.Cl_aileron) - frame.Cl_aileron)
    l_p, l_delta = 0.5*roll*damping*frame.span/speed, roll*power
    modelled = l_p*m.p + l_delta*m.aileron
    if s.seated == 0.0:
        s.p, s.roll, s.seated = m.p, modelled, 1.0
    given = (m.p - s.p)/g.lag
    s.p, s.roll = lagged(s.p, m.p, share), lagged(s.roll, modelled, share)
    return l_p, l_delta, given - s.roll


@kernel
def predict_pitch(s: Any, a: Any, m: Any, e: Any, frame: Any, g: Any, share: float) -> float:
    """Least elevator [rad] that keeps the predicted peak of alpha at its limit."""
    z_alpha, z_q, z_delta, z_0, m_alpha, m_q, m_delta, m_0 = pitch_response(s, m, e, frame, g, share)
    speed = airspeed_of(m)
    ramp = 2.0*G0/(speed*speed)*clip(-airspeed_rate(m, G0), 0.0, g.decay_max)
    least, _most = bounds(m.alpha, m.q, z_alpha, z_q, m_alpha, m_q, z_0, ramp, m_0, z_delta, m_delta, -math.inf,
                          a.alpha_limit, g.pitch_horizon, g)
    return least


@kernel
def predict_roll(s: Any, a: Any, m: Any, e: Any, frame: Any, g: Any, share: float) -> tuple[float, float]:
    """Least and largest aileron [rad] that keep the predicted bank within its limit."""
    l_p, l_delta, l_0 = roll_response(s, m, e, frame, g, share)
    return bounds(m.phi, m.p, 0.0, 1.0, 0.0, l_p, 0.0, 0.0, l_0, 0.0, l_delta, -a.bank_limit, a.bank_limit,
                  g.roll_horizon, g)


@entry
def protect(memory: NDArray[Any], command: NDArray[Any], advisory: NDArray[Any], measurement: NDArray[Any],
            estimate: NDArray[Any], airframe: NDArray[Any], tuning: NDArray[Any], dt: float) -> None:
    """Keep every aircraft inside its advised envelope: changes `command` and the advisory's `intervention` in place.

    Args:
        memory: of `init`, changed.
        command: COMMAND rows as the controller wants them; changed only near or beyond a limit.
        advisory: ADVISORY rows with the limits.
        measurement: MEASUREMENT rows.
        estimate: ESTIMATE rows.
        airframe: one PARAMETERS row of the clean aircraft for all, or one per aircraft.
        tuning: one PREDICTIVE row for all, or one per aircraft.
        dt: time since the last step [s].
    """
    for i in range(len(command)):
        s, c, a, m, e = memory[i], command[i], advisory[i], measurement[i], estimate[i]
        frame = airframe[i if len(airframe) > 1 else 0]
        g = tuning[i if len(tuning) > 1 else 0]
        share = 1.0 - math.exp(-dt/g.lag)
        keep_pitch(c, a, m, predict_pitch(s, a, m, e, frame, g, share), g)
        least, most = predict_roll(s, a, m, e, frame, g, share)
        keep_roll(c, a, least, most, g)
        c.flap = min(c.flap, a.flap_limit)
