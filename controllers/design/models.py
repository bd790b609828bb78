"""Linear models of the clean aircraft over the grid of airspeed and flap that the schedules use.

The plant of a loop is what stands between a command and a reading: the lag of the surface, the aircraft with its
downwash lag, the lags of the instruments, all behind a hold of one step.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from controllers.schedule import DENSITY_0
from icing_env import aircraft
from icing_env.atmosphere import G0, density
from icing_env.errors import InputError
from icing_env.linearise import LATERAL, LONGITUDINAL, linearise
from icing_env.trim import Trim, trim

FloatArray = NDArray[np.float64]
DT = 0.02  # s, step of every controller
ALTITUDE = 2200.0  # m; the schedules go over dynamic pressure, so the altitude of the design matters little
SPEEDS = 36.0 + 8.0*np.arange(7)  # m/s, equivalent: 1.1 times the stall speed, to beyond the flap-up cruise
FLAPS = 0.6545/3.0*np.arange(4)  # rad, up to full flap
DESCENTS = tuple(np.radians([0.0, -2.0, -4.0, -7.0, -10.0, -14.0]))  # flight-path angles tried, rad
SHORT = ("airspeed", "alpha", "q", "theta")  # states of the regulators; the downwash lag is taken as settled
READ_LONGITUDINAL = ("airspeed", "alpha", "q", "theta", "elevator")  # what a law reads, in the plants below
READ_LATERAL = ("beta", "p", "r", "phi", "ay", "aileron", "rudder")


@dataclass(frozen=True)
class Point:
    """One steady condition of the grid: its trim, and the aircraft it belongs to."""

    trim: Trim
    parameters: NDArray[Any]

    @property
    def airspeed(self) -> float:
        """True airspeed [m/s]."""
        return float(self.trim.condition["airspeed"][0])

    @property
    def flap(self) -> float:
        """Flap [rad]."""
        return float(self.trim.condition["flap"][0])

    def model(self, states: tuple[str, ...], inputs: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
        """A and B of these states and surfaces."""
        system = linearise(self.trim, self.parameters, states)
        columns = [system.input_labels.index(name) for name in inputs]
        return np.asarray(system.A), np.asarray(system.B)[:, columns]


def clean(**changes: float) -> NDArray[Any]:
    """PARAMETERS row of the clean aircraft; `changes` are factors on its numbers."""
    row = aircraft.load("twin_otter")
    return aircraft.changed(row, **{name: factor*float(row[name][0]) for name, factor in changes.items()})


def steady(parameters: NDArray[Any], speed: float, flap: float) -> Point | None:
    """Flight at an equivalent airspeed [m/s] and flap [rad]: level, or descending as steeply as the power asks for.

    None where the aircraft cannot fly so: not enough lift, or not enough drag on the way down.
    """
    true = speed*np.sqrt(DENSITY_0/density(ALTITUDE))
    for climb in DESCENTS:
        try:
            return Point(trim(parameters, airspeed=true, altitude=ALTITUDE, flap=flap, climb_angle=climb), parameters)
        except InputError:
            continue
    return None


def grid(parameters: NDArray[Any]) -> Iterator[tuple[int, int, Point]]:
    """Every place (i, j) of the grid with its condition; where there is none, that of the nearest speed with one."""
    for j, flap in enumerate(FLAPS):
        points = [steady(parameters, float(speed), float(flap)) for speed in SPEEDS]
        found = {i: point for i, point in enumerate(points) if point is not None}
        for i in range(len(SPEEDS)):
            yield i, j, found[min(found, key=lambda k: abs(k - i))]


def side_force(point: Point) -> tuple[FloatArray, FloatArray]:
    """Lateral specific force [m/s2] of the states LATERAL and of aileron and rudder.

    ay = V (beta_dot + r cos alpha - p sin alpha) - g phi cos theta, small sideslip and bank.
    """
    a, b = point.model(LATERAL, ("aileron", "rudder"))
    alpha, v = point.trim.alpha, point.airspeed
    row = v*(a[0] + np.array([0.0, -np.sin(alpha), np.cos(alpha), 0.0]))
    row[3] -= G0*np.cos(point.trim.theta)
    return row, v*b[0]


def _behind_lags(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, before: FloatArray,
                 after: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The system with a first-order lag before each input and, where it is above zero, behind each output."""
    n, inputs = b.shape
    slow = np.flatnonzero(after > 0.0)
    k = len(slow)
    full = np.zeros((n + inputs + k, n + inputs + k))
    full[:n, :n], full[:n, n:n + inputs] = a, b
    full[n:n + inputs, n:n + inputs] = -np.diag(1.0/before)
    full[n + inputs:, :n] = c[slow]/after[slow, None]
    full[n + inputs:, n:n + inputs] = d[slow]/after[slow, None]
    full[n + inputs:, n + inputs:] = -np.diag(1.0/after[slow])
    drive = np.zeros((n + inputs + k, inputs))
    drive[n:n + inputs] = np.diag(1.0/before)
    out = np.hstack([c, d, np.zeros((len(c), k))])
    out[slow] = 0.0
    out[slow, n + inputs + np.arange(k)] = 1.0
    return full, drive, out, np.zeros((len(c), inputs))


def plant(point: Point, axis: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Discrete A, B, C from commands to readings of one axis ("longitudinal", "lateral"), held over DT."""
    p = point.parameters[0]
    read = 1.0/(2.0*np.pi*float(p["filter_frequency"]))
    pitot, vane = float(p["pitot_lag"]), float(p["vane_lag"]) + read
    if axis == "longitudinal":
        a, b = point.model(LONGITUDINAL, ("elevator",))
        c = np.vstack([np.eye(4, 5), np.zeros(5)])
        d = np.array([[0.0], [0.0], [0.0], [0.0], [1.0]])
        lags, after = ["elevator"], np.array([pitot, vane, read, 0.0, read])
    else:
        a, b = point.model(LATERAL, ("aileron", "rudder"))
        row, direct = side_force(point)
        c = np.vstack([np.eye(4), row, np.zeros((2, 4))])
        d = np.vstack([np.zeros((4, 2)), direct, np.eye(2)])
        lags, after = ["aileron", "rudder"], np.array([vane, read, read, 0.0, read, read, read])
    before = np.array([float(p[f"{name}_lag"]) for name in lags])
    full, drive, out, direct_out = _behind_lags(a, b, c, d, before, after)
    ad, bd, cd, _dd, _dt = signal.cont2discrete((full, drive, out, direct_out), DT, method="zoh")
    return ad, bd, cd
