"""The plant's equations opened for tests: rates and loads at many states at once, and an aircraft flown from a trim."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from icing_env.dynamics import derivative, forces, present_aircraft
from icing_env.frames import direction_cosines
from icing_env.simulate import Fleet
from icing_env.trim import Trim, trim
from icing_env.types import COMMAND, CONTINUOUS, CURRENT, STATE

LOADS = ("fx", "fy", "fz", "roll", "pitch", "yaw", "airspeed", "alpha", "beta", "density", "thrust_left",
         "thrust_right", "hinge_elevator", "hinge_aileron", "static")  # fmt: skip


@numba.njit(error_model="numpy")
def _rates(x, dx, s, c, p, u):  # the tests' own: never cached, so that a changed file never runs stale
    for i in range(len(x)):
        row = p[0 if len(p) == 1 else i]
        present_aircraft(s[i], row, c[i])
        derivative(x[i], dx[i], s[i], c[i], row, u[i])


@numba.njit(error_model="numpy")
def _loads(x, out, s, c, p):
    for i in range(len(x)):
        row = p[0 if len(p) == 1 else i]
        present_aircraft(s[i], row, c[i])
        values = forces(x[i], direction_cosines(x[i].e0, x[i].e1, x[i].e2, x[i].e3), s[i], c[i], row)
        for j in range(out.shape[1]):
            out[i, j] = values[j]


def continuous(state: NDArray) -> NDArray:
    """The part of STATE rows that is integrated, as CONTINUOUS rows."""
    x = np.zeros(len(state), CONTINUOUS)
    for name in CONTINUOUS.names:
        x[name] = state[name]
    return x


def rates(state: NDArray, parameters: NDArray, command: NDArray | None = None) -> NDArray:
    """Rates of STATE rows, as CONTINUOUS rows."""
    x = continuous(state)
    dx, current = np.zeros_like(x), np.zeros(len(x), CURRENT)
    plain = [a.view(np.recarray) for a in (x, dx, state, current, parameters)]
    _rates(*plain, (np.zeros(len(x), COMMAND) if command is None else command).view(np.recarray))
    return dx


def loads(state: NDArray, parameters: NDArray) -> dict[str, NDArray]:
    """Forces (N), moments (N m) and air data of STATE rows, by the names of LOADS."""
    x = continuous(state)
    out = np.zeros((len(x), len(LOADS)))
    _loads(x.view(np.recarray), out, state.view(np.recarray), np.zeros(len(x), CURRENT).view(np.recarray),
           parameters.view(np.recarray))  # fmt: skip
    return dict(zip(LOADS, out.T, strict=True))


def level(n: int, airspeed: float | NDArray = 60.0, alpha: float | NDArray = 0.0, beta: float | NDArray = 0.0,
          altitude: float | NDArray = 2000.0, **fields: float | NDArray) -> NDArray:  # fmt: skip
    """STATE rows that meet the air at these angles, upright, downwash settled; further fields by name."""
    s = np.zeros(n, STATE)
    s["altitude"], s["e0"], s["alpha_downwash"] = altitude, 1.0, alpha
    s["u"], s["v"] = airspeed * np.cos(alpha) * np.cos(beta), airspeed * np.sin(beta)
    s["w"] = airspeed * np.sin(alpha) * np.cos(beta)
    for name, value in fields.items():
        s[name] = value
    return s


def coefficients(state: NDArray, parameters: NDArray) -> dict[str, NDArray]:
    """CL, CD, Cm (and CY, Cl, Cn) of STATE rows."""
    f, p = loads(state, parameters), parameters
    qs = 0.5 * f["density"] * f["airspeed"] ** 2 * p["wing_area"]
    sine, cosine = np.sin(f["alpha"]), np.cos(f["alpha"])
    return {
        "CL": (f["fx"] * sine - f["fz"] * cosine) / qs, "CD": -(f["fx"] * cosine + f["fz"] * sine) / qs,
        "CY": f["fy"] / qs, "Cl": f["roll"] / (qs * p["span"]), "Cm": f["pitch"] / (qs * p["chord"]),
        "Cn": f["yaw"] / (qs * p["span"]),
    }  # fmt: skip


def fleet_at(trimmed: Trim, parameters: NDArray, n: int = 1, seed: int = 1, **options) -> Fleet:
    """A fleet of `n` in one trim, seeds counting from `seed`."""
    fleet = Fleet(parameters, n, **options)
    fleet.state[:], fleet.command[:] = trimmed.state[0], trimmed.command[0]
    fleet.state["seed"] = seed + np.arange(n)
    fleet.start()
    return fleet


def flown_from_trim(parameters: NDArray, seconds: float, **condition: float) -> Fleet:
    """One aircraft flown from its trim with hands off."""
    fleet = fleet_at(trim(parameters, **condition), parameters)
    for _ in range(round(seconds / fleet.dt)):
        fleet.step()
    return fleet
