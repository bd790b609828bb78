"""One-step prediction of a record by many variants of the plant at once, each corrected by the same fixed gain.

The predictor is the plant itself (`Fleet`, one row per variant) with Dryden gusts among its states. After every step
its state receives K (measured - predicted), K the steady Kalman gain of the plant linearised about the record and of
a gust intensity sigma_w. For the true variant what is left (the innovations) is white; a variant's departure from the
neutral one is its signature, and has passed through the same filter as the record. Prediction-error method: Ljung,
System Identification, 2nd ed., chapter 7; gain with correlated noises: Anderson & Moore, Optimal Filtering, 5.4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.frames import direction_cosines, to_body
from icing_env.record import FloatArray
from icing_env.simulate import Fleet
from icing_env.types import MEASUREMENT, STATE
from sim2real.channels import FED_BACK, MEASURED, SURFACES
from sim2real.reconstruct import Reconstruction

STATES = ("u", "v", "w", "p", "q", "r", "altitude", "alpha_downwash", "dryden_u", "dryden_v1", "dryden_v2",
          "dryden_w1", "dryden_w2", "gust_u", "gust_v", "gust_w", "gust_w_tail", "pitot", "vane_alpha", "vane_beta",
          *(f"filtered_{c}" for c in ("alpha", "beta", "p", "q", "r", "ax", "ay", "az")))  # fmt: skip
ANGLES = ("phi", "theta")  # corrected through the quaternion
TANGENT = (*STATES, *ANGLES)
STILL = 1e-12  # m/s: gusts keep their states but draw nothing
SLOW_SURFACE = 4.0  # a surface's lag in steps: it moves nearly in a straight line from sample to sample
_STATE_COLUMN = {name: i for i, name in enumerate(STATE.names or ())}
_MEASURED_COLUMN = {name: i for i, name in enumerate(MEASUREMENT.names or ())}
_X = np.array([_STATE_COLUMN[name] for name in STATES])
# over whole arrays the kernels' own text runs as plain NumPy
_PLAIN_COSINES: Any
_PLAIN_TO_BODY: Any
_PLAIN_COSINES, _PLAIN_TO_BODY = (getattr(f, "py_func", f) for f in (direction_cosines, to_body))
_E = np.array([_STATE_COLUMN[name] for name in ("e0", "e1", "e2", "e3")])
_Y = np.array([_MEASURED_COLUMN[name] for name in MEASURED[:11]])


@dataclass(frozen=True)
class Push:
    """What a generic discrepancy adds to one row: an acceleration of a state, or an error of a channel, in time."""

    row: int
    target: str  # u v w p q r: acceleration in m/s2 or rad/s2; or a channel of MEASURED
    series: FloatArray
    sensor: bool  # an error of the channel's reading, not an acceleration


class Predictor:
    """A fleet of variants flown along one record."""

    def __init__(self, flight: Reconstruction, parameters: NDArray) -> None:
        self.flight, self.n = flight, len(parameters)
        self.fleet = Fleet(held(parameters, flight.dt), self.n, flight.dt, max(1, round(flight.dt / 0.02)))
        self.x = self.fleet.state.view(np.float64).reshape(self.n, -1)
        self.y = self.fleet.measurement.view(np.float64).reshape(self.n, -1)
        self._surfaces = [(s, self.fleet.state[s], self.fleet.command[s]) for s in SURFACES]

    def place(self, k: int) -> None:
        """Start every row at the measured state of sample `k` (a quarter of a second averaged)."""
        start_state(self.flight, slice(k, k + max(2, round(0.25 / self.flight.dt))), self.fleet)

    def place_typical(self) -> None:
        """Put every row at the record's median state: the condition about which the plant is linearised."""
        start_state(self.flight, slice(None), self.fleet)

    def step(self, k: int | NDArray[np.intp]) -> FloatArray:
        """From sample k (one, or one per row) to the next with the recorded controls.

        Returns:
            What the instruments should read [n, channels].
        """
        controls, f = self.flight.controls, self.fleet
        rest = 1.0 - _rk4_exponential(1.0 / SLOW_SURFACE)
        for name, position, command in self._surfaces:
            now, then = controls[name][k], controls[name][k + 1]
            position[:] = now
            command[:] = now + (then - now) / rest
        f.state["flap"], f.command["flap"] = controls["flap"][k + 1], controls["flap"][k + 1]
        for side in ("left", "right"):
            f.state[f"power_{side}"] = controls[f"power_{side}"][k + 1]
        f.step()
        return self.read()

    def read(self) -> FloatArray:
        """Predicted readings [n, channels of MEASURED]."""
        out = np.empty((self.n, len(MEASURED)))
        out[:, :11] = self.y[:, _Y]
        out[:, 11] = self.fleet.state["altitude"]
        s, p = self.fleet.state, self.fleet.parameters
        per_power = p["propeller_efficiency"] / np.sqrt((s["u"] - s["gust_u"]) ** 2 + p["propeller_static_speed"] ** 2)
        for j, side in enumerate(("left", "right")):
            out[:, 12 + j] = p[f"thrust_factor_{side}"] * s[f"power_{side}"] * per_power
        return out

    def correct(self, change: FloatArray) -> None:
        """Add `change` [n, TANGENT] to the states."""
        self.x[:, _X] += change[:, : len(STATES)]
        roll, pitch = change[:, -2], change[:, -1]
        phi = self.fleet.measurement["phi"]
        wy, wz = pitch * np.cos(phi), -pitch * np.sin(phi)
        e = self.x[:, _E]
        half = 0.5 * np.stack([-e[:, 1] * roll - e[:, 2] * wy - e[:, 3] * wz,
                               e[:, 0] * roll + e[:, 2] * wz - e[:, 3] * wy,
                               e[:, 0] * wy + e[:, 3] * roll - e[:, 1] * wz,
                               e[:, 0] * wz + e[:, 1] * wy - e[:, 2] * roll], axis=1)  # fmt: skip
        self.x[:, _E] = e + half

    def tangent(self) -> FloatArray:
        """States as a vector [n, TANGENT]."""
        e0, e1, e2, e3 = self.x[:, _E].T
        phi = np.arctan2(2.0 * (e0 * e1 + e2 * e3), 1.0 - 2.0 * (e1 * e1 + e2 * e2))
        theta = np.arcsin(np.clip(2.0 * (e0 * e2 - e1 * e3), -1.0, 1.0))
        return np.column_stack([self.x[:, _X], phi, theta])


def _rk4_exponential(x: float) -> float:
    """What the Runge-Kutta step makes of exp(-x)."""
    return 1.0 - x + x**2 / 2.0 - x**3 / 6.0 + x**4 / 24.0


def held(parameters: NDArray, dt: float) -> NDArray:
    """PARAMETERS for a plant whose surfaces and powers follow a record: no noise, no limits, gusts as states."""
    out = parameters.copy()
    for name in out.dtype.names or ():
        if name.startswith("noise_"):
            out[name] = 0.0
    for surface in SURFACES:
        out[f"{surface}_lag"], out[f"{surface}_rate"] = SLOW_SURFACE * dt, 1e3
        out[f"{surface}_min"], out[f"{surface}_max"] = -10.0, 10.0
        out[f"{surface}_gearing"], out[f"{surface}_offset"] = 1.0, 0.0
    out["hinge_elevator_hold"] = out["hinge_aileron_hold"] = 1e12
    out["spool_time"] = 1e12
    out["turbulence_sigma_w"], out["turbulence_tail_delay"] = STILL, 1.0
    return out


def start_state(flight: Reconstruction, span: slice, fleet: Fleet) -> None:
    """Put every row at the measured state of the samples in `span`: their median, their mean where they are few."""
    typical = np.median if span == slice(None) else np.mean
    mean = {name: float(typical(flight.channel(name)[span])) for name in MEASURED[:8]}
    mean |= {name: float(typical(series[span])) for name, series in flight.controls.items()}
    put(fleet, mean | {"altitude": float(typical(flight.altitude[span]))})


def put(fleet: Fleet, values: Mapping[str, float | FloatArray]) -> None:
    """Start the rows in the air that their parameters describe.

    Args:
        fleet: all of it is started anew.
        values: airspeed, alpha, beta, p, q, r, phi, theta, altitude, surfaces, flap and powers; numbers, or arrays with
            one per row.
    """
    s, p = fleet.state, fleet.parameters
    s[:] = 0
    v, alpha, beta = values["airspeed"], values["alpha"], values["beta"]
    for name in ("altitude", "p", "q", "r", *SURFACES, "flap", "power_left", "power_right"):
        s[name] = values[name]
    s["alpha_downwash"] = alpha
    cr, sr, cp, sp = (f(0.5 * np.asarray(values[a])) for a in ("phi", "theta") for f in (np.cos, np.sin))
    s["e0"], s["e1"], s["e2"], s["e3"] = cr * cp, sr * cp, cr * sp, -sr * sp
    above = s["altitude"] - p["wind_reference_altitude"]
    attitude = _PLAIN_COSINES(s["e0"], s["e1"], s["e2"], s["e3"])
    wind = _PLAIN_TO_BODY(attitude, p["wind_north"] + p["wind_north_shear"] * above,
                   p["wind_east"] + p["wind_east_shear"] * above, p["wind_down"])  # fmt: skip
    s["u"] = v * np.cos(alpha) * np.cos(beta) + wind[0]
    s["v"] = v * np.sin(beta) + wind[1]
    s["w"] = v * np.sin(alpha) * np.cos(beta) + wind[2]
    fleet.start()


def innovations(flight: Reconstruction, parameters: NDArray, gain: FloatArray,
                pushes: tuple[Push, ...] = ()) -> NDArray[np.float32]:
    """Measured less predicted of every row [N-1, n, channels], float32; nan where nothing was measured.

    Args:
        flight: the record.
        parameters: a PARAMETERS row per variant.
        gain: K of a `Gain` [steps, states, fed-back channels], or one per row [n, ...]; the last step's goes on.
        pushes: generic discrepancies.
    """
    flown = Predictor(flight, parameters)
    flown.place(0)
    steps = len(flight.time) - 1
    out = np.empty((steps, flown.n, len(MEASURED)), dtype=np.float32)
    present = np.isfinite(flight.measured)
    stretch = 1.0 / np.maximum(np.mean(present[:, :FED_BACK], axis=0), 1e-3)  # a sparse channel's share comes at once
    forces = [q for q in pushes if not q.sensor]
    errors = [q for q in pushes if q.sensor]
    f_row, f_col = np.array([q.row for q in forces], int), np.array([TANGENT.index(q.target) for q in forces], int)
    f_series = np.array([q.series for q in forces]).reshape(len(forces), steps + 1)
    felt = [(q.row, MEASURED.index("a" + "xyz"["uvw".index(q.target)]), q.series) for q in forces if q.target in "uvw"]
    direct = felt + [(q.row, MEASURED.index(q.target), q.series) for q in errors]
    d_row, d_col = np.array([d[0] for d in direct], int), np.array([d[1] for d in direct], int)
    d_series = np.array([d[2] for d in direct]).reshape(len(direct), steps + 1)
    for k in range(steps):
        predicted = flown.step(k)
        if direct:
            predicted[d_row, d_col] += d_series[:, k + 1]
        left = flight.measured[k + 1] - predicted
        out[k] = left
        fed = np.where(present[k + 1, :FED_BACK], left[:, :FED_BACK], 0.0) * stretch
        now = min(k, gain.shape[-3] - 1)
        change = fed @ gain[now].T if gain.ndim == 3 else np.einsum("nsc,nc->ns", gain[:, now], fed)
        if forces:
            change[f_row, f_col] += f_series[:, k + 1] * flight.dt
        flown.correct(change)
    return out
