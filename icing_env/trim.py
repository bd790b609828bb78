"""Steady flight: level, climbing, turning, with one engine, with ice.

Newton's method on eight unknowns (alpha, beta, bank, pitch, elevator, aileron, rudder, throttle) for eight conditions:
no acceleration along or about any body axis, the climb angle, and the sideslip (Stevens, Lewis & Johnson, Aircraft
Control and Simulation, 3rd ed., section 3.6: steady-state conditions; rates of a steady turn, eq. 3.6-8).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from icing_env.atmosphere import pressure
from icing_env.dynamics import derivative, forces, present_aircraft
from icing_env.actuators import floated
from icing_env.errors import InputError
from icing_env.frames import direction_cosines, euler_angles, quaternion, to_body, to_local
from icing_env.jit import entry, kernel
from icing_env.propulsion import power_available
from icing_env.types import COMMAND, CONTINUOUS, CURRENT, STATE, Field, structured
from icing_env.wind import wind

CONDITION_FIELDS: list[Field] = [
    ("airspeed", "m/s", "true airspeed"),
    ("altitude", "m", "geometric altitude"),
    ("climb_angle", "rad", "flight-path angle in the air mass"),
    ("turn_rate", "rad/s", "rate of turn, positive right"),
    ("heading", "rad", "heading"),
    ("flap", "rad", "flap"),
    ("beta", "rad", "sideslip"),
    ("share_left", "0..1", "power of the left engine over what the lever asks for (0: failed)"),
    ("share_right", "0..1", "the same on the right"),
]
CONDITION = structured(CONDITION_FIELDS)
TOLERANCE = 1e-10  # m/s2 and rad/s2
UNKNOWNS = 8


@kernel
def place(z, x, s, k, u, p) -> None:
    """Put the continuous state and the command into the condition `k` with the unknowns `z`."""
    alpha, beta, phi, theta = z[0], z[1], z[2], z[3]
    x.altitude, x.flap = k.altitude, k.flap
    x.e0, x.e1, x.e2, x.e3 = quaternion(phi, theta, k.heading)
    north, east, down = wind(k.altitude, p)
    wx, wy, wz = to_body(direction_cosines(x.e0, x.e1, x.e2, x.e3), north, east, down)
    x.u = k.airspeed*math.cos(alpha)*math.cos(beta) + wx
    x.v = k.airspeed*math.sin(beta) + wy
    x.w = k.airspeed*math.sin(alpha)*math.cos(beta) + wz
    x.p = -k.turn_rate*math.sin(theta)
    x.q = k.turn_rate*math.sin(phi)*math.cos(theta)
    x.r = k.turn_rate*math.cos(phi)*math.cos(theta)
    x.elevator, x.aileron, x.rudder = z[4], z[5], z[6]
    full = power_available(pressure(k.altitude), p)
    x.power_left, x.power_right = z[7]*k.share_left*full, z[7]*k.share_right*full
    x.alpha_downwash = alpha
    u.throttle_left, u.throttle_right = z[7]*k.share_left, z[7]*k.share_right


@kernel
def residual(z, out, x, dx, s, c, k, u, p) -> None:
    """Accelerations, climb and sideslip left over in the condition `k` with the unknowns `z`."""
    place(z, x, s, k, u, p)
    derivative(x, dx, s, c, p, u)
    out[0], out[1], out[2] = dx.u, dx.v, dx.w
    out[3], out[4], out[5] = dx.p, dx.q, dx.r
    _n, _e, wind_down = wind(k.altitude, p)
    _north, _east, down = to_local(direction_cosines(x.e0, x.e1, x.e2, x.e3), x.u, x.v, x.w)
    out[6] = wind_down - down - k.airspeed*math.sin(k.climb_angle)
    out[7] = z[1] - k.beta


@kernel
def command_of(x, s, c, u, p) -> None:
    """Surface commands that hold the present positions, gearing, rigging and hinge moments taken out."""
    values = forces(x, direction_cosines(x.e0, x.e1, x.e2, x.e3), s, c, p)
    u.elevator = (x.elevator - p.elevator_offset
                  - floated(values[12], p.hinge_elevator_hold, c.per_elevator_stiffness))/p.elevator_gearing
    u.aileron = (x.aileron - p.aileron_offset
                 - floated(values[13], p.hinge_aileron_hold, c.per_aileron_stiffness))/p.aileron_gearing
    u.rudder = (x.rudder - p.rudder_offset)/p.rudder_gearing
    u.flap = x.flap


@entry
def solve_rows(state, state_rows, current, command, condition, parameters, stage, rows, left_over) -> None:
    """Trim every row: its condition, its ice, its parameters. `left_over` receives the largest residual."""
    z, out, trial = np.zeros(UNKNOWNS), np.zeros(UNKNOWNS), np.zeros(UNKNOWNS)
    jacobian = np.zeros((UNKNOWNS, UNKNOWNS))
    shared = len(parameters) == 1
    for i in range(len(state)):
        s, c, u, k = state[i], current[i], command[i], condition[i]
        p = parameters[0 if shared else i]
        s.gust_u, s.gust_v, s.gust_w, s.gust_p, s.gust_q, s.gust_r, s.gust_w_tail = 0., 0., 0., 0., 0., 0., 0.
        present_aircraft(s, p, c)
        z[:] = 0.0
        z[0] = z[3] = 0.03
        z[2] = math.atan(k.airspeed*k.turn_rate/p.gravity_sea_level)
        z[3] += k.climb_angle
        z[7] = 0.5
        for _ in range(40):
            residual(z, out, stage[0], stage[1], s, c, k, u, p)
            left_over[i] = np.max(np.abs(out))
            if left_over[i] < TOLERANCE:
                break
            for j in range(UNKNOWNS):
                trial[:] = z
                trial[j] += 1e-6
                residual(trial, jacobian[j], stage[0], stage[1], s, c, k, u, p)
                for m in range(UNKNOWNS):
                    jacobian[j, m] = (jacobian[j, m] - out[m])*1e6
            step = np.linalg.solve(jacobian.T, out)
            z -= step*min(1.0, 0.3/max(np.max(np.abs(step)), 1e-12))
        place(z, stage[0], s, k, u, p)
        command_of(stage[0], s, c, u, p)
        for j in range(rows.shape[1]):
            state_rows[i, j] = rows[0, j]


@dataclass(frozen=True)
class Trim:
    """A steady flight condition: rows of the state and command, and the figures people ask for."""

    state: NDArray
    command: NDArray
    current: NDArray
    condition: NDArray
    alpha: float
    beta: float
    phi: float
    theta: float
    elevator: float
    aileron: float
    rudder: float
    throttle: float


def conditions(n: int = 1, **values: float | NDArray) -> NDArray:
    """CONDITION array of `n` rows: level flight at 72 m/s and 2200 m, both engines, changed by `values`."""
    k = np.zeros(n, CONDITION)
    k["airspeed"], k["altitude"], k["share_left"], k["share_right"] = 72.0, 2200.0, 1.0, 1.0
    for name, value in values.items():
        k[name] = value
    return k


def trim_rows(state: NDArray, current: NDArray, command: NDArray, condition: NDArray, parameters: NDArray) -> NDArray:
    """Trim many aircraft in place; returns the largest residual of each (below 1e-8: trimmed) [n]."""
    stage = np.zeros(2, CONTINUOUS)
    rows = stage.view(np.float64).reshape(2, -1)
    left_over = np.zeros(len(state))
    solve_rows(state, state.view(np.float64).reshape(len(state), -1), current, command, condition, parameters,
               stage, rows, left_over)
    return left_over


def trim(parameters: NDArray, eta: dict[str, float] | None = None, **condition: float) -> Trim:
    """Trim one aircraft.

    Args:
        parameters: PARAMETERS array of one row.
        eta: icing severity by surface (names of `types.SURFACES`), none if omitted.
        condition: fields of CONDITION that differ from level flight at 72 m/s and 2200 m.

    Raises:
        InputError: the aircraft cannot fly steadily so (power, surface travel or lift is short).
    """
    k = conditions(**condition)
    state, command, current = np.zeros(1, STATE), np.zeros(1, COMMAND), np.zeros(1, CURRENT)
    for surface, value in (eta or {}).items():
        state[f"eta_{surface}"] = value
    left_over = trim_rows(state, current, command, k, parameters)[0]
    x = state[0]
    throttle = max(float(command["throttle_left"][0]), float(command["throttle_right"][0]))
    where = f"{k['airspeed'][0]:.0f} m/s, {k['altitude'][0]:.0f} m, climb {math.degrees(k['climb_angle'][0]):.1f} deg"
    if not left_over < 1e-8:
        raise InputError(f"no steady flight at {where}: try a higher airspeed or less ice")
    if not 0.0 <= throttle <= 1.0:
        raise InputError(f"steady flight at {where} needs {100*throttle:.0f} % power: climb less or fly slower")
    for surface in ("elevator", "aileron", "rudder"):
        low, high = float(parameters[f"{surface}_min"][0]), float(parameters[f"{surface}_max"][0])
        if not low <= x[surface] <= high:
            raise InputError(f"steady flight at {where} needs {surface} {math.degrees(x[surface]):.1f} deg, beyond travel")
    e = (float(x["e0"]), float(x["e1"]), float(x["e2"]), float(x["e3"]))
    phi, theta, _ = euler_angles(*e)
    return Trim(state, command, current, k, float(x["alpha_downwash"]), float(k["beta"][0]), phi, theta,
                float(x["elevator"]), float(x["aileron"]), float(x["rudder"]), throttle)
