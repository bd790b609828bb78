"""Steady flight: level, climbing, turning, with one engine, with ice.

Newton's method on eight unknowns (alpha, beta, bank, pitch, elevator, aileron, rudder, throttle) for eight conditions:
no acceleration along or about any body axis, the climb angle, and the sideslip (Stevens, Lewis & Johnson, Aircraft
Control and Simulation, 3rd ed., section 3.6: steady-state conditions; rates of a steady turn, eq. 3.6-8).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.actuators import floated
from icing_env.atmosphere import pressure
from icing_env.dynamics import derivative, forces, present_aircraft
from icing_env.errors import InputError, nearest
from icing_env.frames import direction_cosines, euler_angles, quaternion, to_body, to_local
from icing_env.integrate import copy
from icing_env.jit import entry, kernel
from icing_env.propulsion import power_available
from icing_env.types import COMMAND, CONTINUOUS, CURRENT, STATE, SURFACES, Field, structured
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
ITERATIONS = 40
DIFFERENCE = 1e-6  # rad, or share of power
LARGEST_STEP = 0.3  # rad, or share of power: keeps the search within the range of the aerodynamics
SMALLEST_PIVOT = 1e-12


@kernel
def place(z: Any, x: Any, s: Any, k: Any, u: Any, p: Any) -> None:
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
def residual(z: Any, out: Any, x: Any, dx: Any, s: Any, c: Any, k: Any, u: Any, p: Any) -> None:
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
def command_of(x: Any, s: Any, c: Any, u: Any, p: Any) -> None:
    """Surface commands that hold the present positions, gearing, rigging and hinge moments taken out."""
    values = forces(x, direction_cosines(x.e0, x.e1, x.e2, x.e3), s, c, p)
    u.elevator = (x.elevator - p.elevator_offset
                  - floated(values[12], p.hinge_elevator_hold, c.per_elevator_stiffness))/p.elevator_gearing
    u.aileron = (x.aileron - p.aileron_offset
                 - floated(values[13], p.hinge_aileron_hold, c.per_aileron_stiffness))/p.aileron_gearing
    u.rudder = (x.rudder - p.rudder_offset)/p.rudder_gearing
    u.flap = x.flap


@kernel
def eliminate(a: Any, b: Any) -> bool:
    """Solve a x = b in place by Gaussian elimination with row pivoting (Golub & Van Loan, algorithm 3.4.1); x: in `b`.

    Returns False when a pivot vanishes or is not a number, instead of an exception that would end a whole batch.
    """
    n = len(b)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if not abs(a[best, k]) > SMALLEST_PIVOT:
            return False
        for j in range(k, n):
            a[k, j], a[best, j] = a[best, j], a[k, j]
        b[k], b[best] = b[best], b[k]
        for i in range(k + 1, n):
            share = a[i, k]/a[k, k]
            for j in range(k, n):
                a[i, j] -= share*a[k, j]
            b[i] -= share*b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= a[k, j]*b[j]
        b[k] /= a[k, k]
    return True


@kernel
def guess(z: Any, k: Any, p: Any) -> None:
    """Start of the search: cruise, banked for the turn."""
    for j in range(UNKNOWNS):
        z[j] = 0.0
    z[0], z[3] = 0.03, 0.03 + k.climb_angle
    z[2] = math.atan(k.airspeed*k.turn_rate/p.gravity_sea_level)
    z[7] = 0.5


@kernel
def differentiate(z: Any, out: Any, jacobian: Any, trial: Any, moved: Any, x: Any, dx: Any, s: Any, c: Any, k: Any,
                  u: Any, p: Any) -> None:
    """Jacobian of the residual `out` at the unknowns `z`, by forward differences; `trial`, `moved` are scratch."""
    for j in range(UNKNOWNS):
        for m in range(UNKNOWNS):
            trial[m] = z[m]
        trial[j] += DIFFERENCE
        residual(trial, moved, x, dx, s, c, k, u, p)
        for m in range(UNKNOWNS):
            jacobian[m, j] = (moved[m] - out[m])*(1.0/DIFFERENCE)


@kernel
def largest(values: Any) -> float:
    """Largest magnitude; not a number if one of them is none. An array expression would take seconds to compile."""
    found = 0.0
    for j in range(UNKNOWNS):
        found = abs(values[j]) if found == found and not abs(values[j]) <= found else found
    return found


@entry
def solve_rows(state: Any, current: Any, command: Any, condition: Any, parameters: Any, stage: Any,
               left_over: Any) -> None:
    """Trim every row: its condition, its ice, its parameters.

    `left_over` receives the largest residual; infinity where Newton's method has no way to go on.
    """
    z, out = np.zeros(UNKNOWNS), np.zeros(UNKNOWNS)
    trial, moved = np.zeros(UNKNOWNS), np.zeros(UNKNOWNS)
    jacobian = np.zeros((UNKNOWNS, UNKNOWNS))
    shared = len(parameters) == 1
    for i in range(len(state)):
        s, c, u, k = state[i], current[i], command[i], condition[i]
        p = parameters[0 if shared else i]
        s.gust_u, s.gust_v, s.gust_w, s.gust_p, s.gust_q, s.gust_r, s.gust_w_tail = 0., 0., 0., 0., 0., 0., 0.
        present_aircraft(s, p, c)
        guess(z, k, p)
        for _ in range(ITERATIONS):
            residual(z, out, stage[0], stage[1], s, c, k, u, p)
            left_over[i] = largest(out)
            if left_over[i] < TOLERANCE:
                break
            differentiate(z, out, jacobian, trial, moved, stage[0], stage[1], s, c, k, u, p)
            if not eliminate(jacobian, out):  # `out` becomes the step
                left_over[i] = np.inf
                break
            share = min(1.0, LARGEST_STEP/max(largest(out), 1e-12))
            for j in range(UNKNOWNS):
                z[j] -= share*out[j]
        place(z, stage[0], s, k, u, p)
        command_of(stage[0], s, c, u, p)
        copy(s, stage[0])


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
    """CONDITION array of `n` rows: level flight at 72 m/s and 2200 m, both engines, changed by `values`.

    Raises:
        InputError: a value is no field of CONDITION; the nearest is named.
    """
    k = np.zeros(n, CONDITION)
    k["airspeed"], k["altitude"], k["share_left"], k["share_right"] = 72.0, 2200.0, 1.0, 1.0
    for name, value in values.items():
        if name not in (CONDITION.names or ()):
            raise InputError(f"no condition '{name}' to trim to: {nearest(name, list(CONDITION.names or ()))}")
        k[name] = value
    return k


def trim_rows(state: NDArray, current: NDArray, command: NDArray, condition: NDArray, parameters: NDArray) -> NDArray:
    """Trim many aircraft in place; returns the largest residual of each (below 1e-8: trimmed) [n]."""
    stage = np.zeros(2, CONTINUOUS)
    left_over = np.zeros(len(state))
    solve_rows(state, current, command, condition, parameters, stage, left_over)
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
    k = conditions(1, **condition)
    state, command, current = np.zeros(1, STATE), np.zeros(1, COMMAND), np.zeros(1, CURRENT)
    for surface, value in (eta or {}).items():
        if surface not in SURFACES:
            raise InputError(f"no surface '{surface}' to carry ice: {nearest(surface, list(SURFACES))}")
        state[f"eta_{surface}"] = value
    left_over = trim_rows(state, current, command, k, parameters)[0]
    throttle = check(state[0], command[0], k[0], parameters[0], float(left_over))
    x = state[0]
    phi, theta, _ = euler_angles(float(x["e0"]), float(x["e1"]), float(x["e2"]), float(x["e3"]))
    return Trim(state, command, current, k, float(x["alpha_downwash"]), float(k["beta"][0]), phi, theta,
                float(x["elevator"]), float(x["aileron"]), float(x["rudder"]), throttle)


def check(x: np.void, u: np.void, k: np.void, p: np.void, left_over: float) -> float:
    """Power lever (0..1) of a solution of `trim_rows`: rows of state, command, condition and parameters.

    Raises:
        InputError: no solution, or one that the aircraft cannot fly.
    """
    where = f"{k['airspeed']:.0f} m/s, {k['altitude']:.0f} m, climb {math.degrees(k['climb_angle']):.1f} deg"
    if not left_over < 1e-8:
        raise InputError(f"no steady flight at {where}: try a higher airspeed, less bank or less ice")
    side = "left" if k["share_left"] > 0.0 else "right"
    throttle = float(u[f"throttle_{side}"]/k[f"share_{side}"])
    if throttle > 1.0:
        raise InputError(f"steady flight at {where} needs {100*throttle:.0f} % power: climb less or fly slower")
    if throttle < 0.0:
        raise InputError(f"steady flight at {where} needs {100*throttle:.0f} % power: descend less or fly faster")
    for surface in ("elevator", "aileron", "rudder"):
        if not p[f"{surface}_min"] <= x[surface] <= p[f"{surface}_max"]:
            degrees = math.degrees(x[surface])
            raise InputError(f"steady flight at {where} needs {surface} {degrees:.1f} deg: beyond its travel")
    return throttle
