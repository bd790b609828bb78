"""The compiled loop of the predictor: many variants of the plant along one record, corrected after every step or not.

A step from Python costs more than the flight of forty variants; this is the one place where a record is flown.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from icing_env.blocks import (
    AIR,
    AT_AIR,
    AT_COMMAND,
    AT_CURRENT,
    AT_GUSTS,
    AT_PARAMETERS,
    GUSTS_AFTER,
    GUSTS_BEFORE,
    NOW,
    ROWS,
    feel_block,
    fill,
    recall_loads,
    rk4_block,
)
from icing_env.dynamics import present_aircraft
from icing_env.frames import euler_angles
from icing_env.integrate import GUSTS, copy, copy_gusts
from icing_env.jit import entry, kernel
from icing_env.lanes import LANES, lane
from icing_env.memory import matrix, rows
from icing_env.parameters import PARAMETERS
from icing_env.sensors import filter_flow_and_inertial, read_gyros_quietly, read_quietly
from icing_env.simulate import CLOCK, NUMBER
from icing_env.turbulence import advance_turbulence
from icing_env.types import COMMAND, CONTINUOUS, CURRENT, MEASUREMENT, OUTCOME, STATE
from sim2real.prediction.correction import CHANGED, E0, E1, E2, E3, X, columns, follow_record
from sim2real.prediction.gusts import drift_turbulence
from sim2real.records.channels import FED_BACK, MEASURED, SURFACES

STILL = 1e-9  # m/s: gusts below it keep their states but draw nothing
PRESENTED = 50  # steps between two looks at what mass, ice and height make of the coefficients (held over a record)
SLOW_SURFACE = 4.0  # a surface's lag in steps: it moves nearly in a straight line from sample to sample
CONTROLS = (*SURFACES, "flap", "power_left", "power_right")


def rk4_exponential(x: float) -> float:
    """What the Runge-Kutta step makes of exp(-x)."""
    return 1.0 - x + x**2 / 2.0 - x**3 / 6.0 + x**4 / 24.0


REST = 1.0 - rk4_exponential(1.0 / SLOW_SURFACE)
_Y = columns(MEASUREMENT, MEASURED[:11])
_FELT = np.array([MEASURED.index(c) for c in ("ax", "ay", "az")])
_SURFACE, _ASKED = columns(STATE, SURFACES), columns(COMMAND, SURFACES)
_U, _V, _W, _P, _Q, _R = (int(c) for c in X[:6])
_FLAP, _POWER_L, _POWER_R, _GUST_U, _ALTITUDE = (int(c) for c in columns(
    STATE, ("flap", "power_left", "power_right", "gust_u", "altitude")))  # fmt: skip
_FLAP_ASKED = int(columns(COMMAND, ("flap",))[0])
_EFFICIENCY, _STATIC, _FACTOR_L, _FACTOR_R = (int(c) for c in columns(
    PARAMETERS, ("propeller_efficiency", "propeller_static_speed", "thrust_factor_left",
                 "thrust_factor_right")))  # fmt: skip
_NORTH, _EAST, _DOWN, _NORTH_SHEAR, _EAST_SHEAR, _ABOVE = (int(c) for c in columns(
    PARAMETERS, ("wind_north", "wind_east", "wind_down", "wind_north_shear", "wind_east_shear",
                 "wind_reference_altitude")))  # fmt: skip
_SCALE, _BIAS, _DRIFT = (int(c) for c in columns(
    PARAMETERS, ("scale_altitude", "bias_altitude", "drift_altitude")))  # fmt: skip
_TIME, _ELAPSED = int(columns(MEASUREMENT, ("time",))[0]), int(columns(CURRENT, ("elapsed",))[0])
_N_STATE, _N_MEASUREMENT = len(STATE.names or ()), len(MEASUREMENT.names or ())
_N_PARAMETERS, _N_COMMAND, _N_CURRENT = (len(kind.names or ()) for kind in (PARAMETERS, COMMAND, CURRENT))


@kernel
def steer(x: Any, u: Any, now: Any, then: Any) -> None:
    """Let one row's surfaces go from the controls of a sample to those of the next; flap and power jump."""
    for s in range(3):
        x[_SURFACE[s]] = now[s]
        u[_ASKED[s]] = now[s] + (then[s] - now[s]) / REST
    x[_FLAP] = then[3]
    u[_FLAP_ASKED] = then[3]
    x[_POWER_L] = then[4]
    x[_POWER_R] = then[5]


@kernel
def push(x: Any, state: Any, size: Any, half: Any) -> None:
    """Add to one row's state what acts on it all through a step of twice `half`.

    It is added before the step. What turns the aircraft would turn it by twice as much so; half of that is taken back.
    """
    x[state] += size
    back = -half*size
    p, q, r = back if state == _P else 0.0, back if state == _Q else 0.0, back if state == _R else 0.0
    u, v, w = x[_U], x[_V], x[_W]
    x[_U], x[_V], x[_W] = u + r*v - q*w, v + p*w - r*u, w + q*u - p*v
    e0, e1, e2, e3 = x[E0], x[E1], x[E2], x[E3]
    x[E0], x[E1] = e0 - 0.5*(e1*p + e2*q + e3*r), e1 + 0.5*(e0*p + e2*r - e3*q)
    x[E2], x[E3] = e2 + 0.5*(e0*q + e3*p - e1*r), e3 + 0.5*(e0*r + e1*q - e2*p)


@kernel
def read(out: Any, x: Any, y: Any, p: Any) -> None:
    """What one row's instruments should read, in the order of MEASURED."""
    for c in range(11):
        out[c] = y[_Y[c]]
    out[11] = (1.0 + p[_SCALE])*x[_ALTITUDE] + p[_BIAS] + p[_DRIFT]*y[_TIME]
    above = x[_ALTITUDE] - p[_ABOVE]
    wind_u = ((p[_NORTH] + p[_NORTH_SHEAR]*above)*(x[E0]**2 + x[E1]**2 - x[E2]**2 - x[E3]**2)
              + (p[_EAST] + p[_EAST_SHEAR]*above)*2.0*(x[E1]*x[E2] + x[E0]*x[E3])
              + p[_DOWN]*2.0*(x[E1]*x[E3] - x[E0]*x[E2]))  # along body x
    per_power = p[_EFFICIENCY] / np.sqrt((x[_U] - wind_u - x[_GUST_U])**2 + p[_STATIC]**2)
    out[12] = p[_FACTOR_L] * x[_POWER_L] * per_power
    out[13] = p[_FACTOR_R] * x[_POWER_R] * per_power


@kernel
def sense(s: Any, m: Any, c: Any, p: Any, felt: tuple, dt: float) -> None:
    """Instruments of one row at the end of a step, without noise: the fast channels and the attitude."""
    m.time = s.step*dt
    fx, fy, fz, airspeed, alpha, beta = felt[0], felt[1], felt[2], felt[6], felt[7], felt[8]
    filter_flow_and_inertial(s, s, c, p, airspeed, alpha, beta, fx, fy, fz)
    read_quietly(s, m, p)
    phi, theta, _psi = euler_angles(s.e0, s.e1, s.e2, s.e3)
    read_gyros_quietly(s, m, p, phi, theta)


@kernel
def advance(block: Any, states: Any, parameters: Any, speeds: Any, count: int, dt: float, substeps: int) -> None:
    """One step of up to LANES rows by Runge and Kutta, gusts in straight lines."""
    for j in range(count):
        s, p = states[j], parameters[j]
        copy_gusts(lane(block, GUSTS_BEFORE, j, GUSTS), s)
        if p.turbulence_sigma_w > STILL:
            advance_turbulence(s, p, speeds[j], dt)
        else:
            drift_turbulence(s, p, speeds[j], dt)
        s.step += 1
        copy(lane(block, NOW, j, CONTINUOUS), s)
        copy_gusts(lane(block, GUSTS_AFTER, j, GUSTS), s)
    for k in range(substeps):
        rk4_block(block, count, dt/substeps, k, substeps)
    for j in range(count):
        copy_gusts(lane(block, AT_GUSTS, j, GUSTS), states[j])
    feel_block(block, count)
    for j in range(count):
        copy(states[j], lane(block, NOW, j, CONTINUOUS))
        if parameters[j].turbulence_rotation == 0.0:
            speeds[j] = lane(block, AT_AIR, j, AIR).airspeed


@entry
def along(table: Any, controls: Any, turning: Any, first: Any, last: Any, measured: Any, stretch: Any, gain: Any,
          force_at: Any, force: Any, error_at: Any, error: Any, known: Any, out: Any) -> None:
    """Fly the rows of a fleet (`table`: of `Fleet.table`) along records put end to end, LANES at a time.

    Nothing draws noise but gusts with an intensity above STILL; ice stays as it is.

    Args:
        controls: [N, CONTROLS].
        turning: speed at which each row meets air that turns, m/s [n] (`gusts.met`).
        first, last: samples at which each row starts, and the last of its own record, where it stays [n].
        measured: [N, channels of MEASURED], nan where nothing was measured.
        stretch: by which a fed-back channel's error is multiplied [n, FED_BACK].
        gain: [1 or n, steps, FED_BACK, states then roll and pitch] of the record's steps, the last one's goes on; empty
            for free flight.
        force_at, force: (row, state) of what is added to states [F, 2], and how much in a step, as it is at each
            sample [F, N].
        error_at, error: (row, channel) of what is added to readings [E, 2], and how much at each sample [E, N].
        known: what every row is accelerated by at each sample beside its own forces, m/s2 and rad/s2 in the order of
            STATES [N, 6]; empty if nothing.
        out: [steps, n, channels]; measured less predicted, or in free flight predicted.
    """
    states, readings, currents = rows(table, 0, STATE), rows(table, 1, MEASUREMENT), rows(table, 2, CURRENT)
    parameters, outcomes = rows(table, 3, PARAMETERS), rows(table, 5, OUTCOME)
    x, y = matrix(table, 0, _N_STATE, NUMBER), matrix(table, 1, _N_MEASUREMENT, NUMBER)
    p, u = matrix(table, 3, _N_PARAMETERS, NUMBER), matrix(table, 4, _N_COMMAND, NUMBER)
    held = matrix(table, 2, _N_CURRENT, NUMBER)
    clock = rows(table, 6, CLOCK)[0]
    block, speeds = np.zeros(ROWS*LANES), np.zeros(len(x))
    fed, change, scratch = np.zeros(FED_BACK*LANES), np.zeros(CHANGED*LANES), np.zeros(CHANGED)
    for i in range(len(x)):
        speeds[i] = outcomes[i].airspeed if parameters[i].turbulence_rotation == 0.0 else turning[i]
    for at in range(0, len(x), LANES):
        count = min(LANES, len(x) - at)
        for j in range(count):
            fill(block, AT_PARAMETERS, j, p[at + j])
        for k in range(len(out)):
            for j in range(count):
                i = at + j
                now = min(first[i] + k, last[i] - 1)
                steer(x[i], u[i], controls[now], controls[now + 1])
                fill(block, AT_COMMAND, j, u[i])
                for c in range(6 if len(known) > 0 else 0):
                    push(x[i], X[c], known[now + 1, c]*clock.dt, 0.5*clock.dt)
                if k % PRESENTED == 0:
                    present_aircraft(states[i], parameters[i], currents[i])
                    fill(block, AT_CURRENT, j, held[i])
                block[(AT_CURRENT + _ELAPSED)*LANES + j] = states[i].step*clock.dt
            for j in range(len(force)):
                i = force_at[j, 0]
                if at <= i < at + count:
                    now = min(first[i] + k, last[i] - 1)
                    push(x[i], force_at[j, 1], 0.5*(force[j, now] + force[j, now + 1]), 0.5*clock.dt)
            advance(block, states[at:], parameters[at:], speeds[at:], count, clock.dt, clock.substeps)
            for j in range(count):
                i = at + j
                sense(states[i], readings[i], currents[i], parameters[i], recall_loads(block, j),
                      clock.dt)
                read(out[k, i], x[i], y[i], p[i])
                now = min(first[i] + k, last[i] - 1)
                for c in range(3 if len(known) > 0 else 0):
                    out[k, i, _FELT[c]] += known[now + 1, c]
            for j in range(len(error)):
                i = error_at[j, 0]
                if at <= i < at + count:
                    out[k, i, error_at[j, 1]] += error[j, min(first[i] + k, last[i] - 1) + 1]
            if len(gain) > 0:
                follow_record(x, y, out[k], at, count, k, first, last, measured, stretch, gain, fed, change, scratch)
