"""One-step prediction of a record by many variants of the plant at once, each corrected by the same fixed gain.

The predictor is the plant itself (`Fleet`, one row per variant) with Dryden gusts among its states. After every step
its state receives K (measured - predicted), K the steady Kalman gain of the plant linearised about the record and of
a gust intensity sigma_w. For the true variant what is left (the innovations) is white; a variant's departure from the
neutral one is its signature, and has passed through the same filter as the record. Prediction-error method: Ljung,
System Identification, 2nd ed., chapter 7; gain with correlated noises: Anderson & Moore, Optimal Filtering, 5.4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import llvmlite.binding
import numpy as np
from numpy.typing import NDArray

from icing_env.discrepancy import bends
from icing_env.frames import direction_cosines, to_body
from icing_env.parameters import PARAMETERS, copied
from icing_env.record import FloatArray
from icing_env.simulate import Fleet
from icing_env.types import STATE
from sim2real.prediction.along import CONTROLS, SLOW_SURFACE, STILL, along, read
from sim2real.prediction.correction import STATES, X, columns, turn
from sim2real.prediction.gusts import LATER, Kind, met
from sim2real.records.channels import FED_BACK, MEASURED, SURFACES
from sim2real.records.instruments import STEP
from sim2real.records.reconstruct import Reconstruction

# rows at a time that the compiler turns into vector instructions: as many as a register of the processor holds
QUICK = 8 if llvmlite.binding.get_host_cpu_features().get("avx512f") else 4
START = 0.25  # s whose mean a row starts from
LOST = 1e9  # what a row that flew to no numbers is off by, in any unit
ANGLES = ("phi", "theta")  # corrected through the quaternion
NOISES = [name for name in PARAMETERS.names or () if name.startswith("noise_")]
TANGENT = (*STATES, *ANGLES)
# over whole arrays the kernels' own text runs as plain NumPy
_PLAIN_COSINES: Any
_PLAIN_TO_BODY: Any
_PLAIN_READ: Any
_PLAIN_TURN: Any
_PLAIN_COSINES, _PLAIN_TO_BODY, _PLAIN_READ, _PLAIN_TURN = (
    getattr(f, "py_func", f) for f in (direction_cosines, to_body, read, turn))
_E = columns(STATE, ("e0", "e1", "e2", "e3"))


@dataclass(frozen=True)
class Push:
    """What a generic discrepancy adds to one row: an acceleration of a state, or an error of a channel, in time."""

    row: int
    target: str  # u v w p q r: acceleration in m/s2 or rad/s2; or a channel of MEASURED
    series: FloatArray
    sensor: bool  # an error of the channel's reading, not an acceleration


class Predictor:
    """A fleet of variants flown along one record: a PARAMETERS row each, or one row for `n` of them.

    `kind`: of the gusts.
    """

    def __init__(self, flight: Reconstruction, parameters: NDArray, n: int | None = None, kind: Kind = LATER
                 ) -> None:  # fmt: skip
        self.flight, self.n = flight, len(parameters) if n is None else n
        self.fleet = Fleet(held(parameters, flight.dt, kind), self.n, flight.dt, substeps(flight.dt))
        self.x = self.fleet.state.view(np.float64).reshape(self.n, -1)

    def place(self, k: int) -> None:
        """Start every row at the measured state of sample `k`."""
        put(self.fleet, started(self.flight, k))

    def place_in(self, spans: Sequence[slice], each: int) -> None:
        """Put `each` rows after another at the typical state of each span of the record."""
        put(self.fleet, {name: np.repeat(values, each) for name, values in typical_states(self.flight, spans).items()})

    def fly(self, steps: int, first: int | NDArray[np.intp] = 0, gain: FloatArray | None = None,
            pushes: tuple[Push, ...] = ()) -> FloatArray:
        """Fly along the record from where the rows are placed.

        Args:
            steps: how many samples.
            first: the sample at which they start, one or one per row.
            gain: K of a `Gain` [steps of the record, states, fed-back channels], or one per row [n, ...]; free flight
                if omitted.
            pushes: generic discrepancies.

        Returns:
            What the instruments should read [steps, n, channels]; with a gain measured less that, nan where nothing
            was measured.

        Raises:
            ValueError: the rows share one PARAMETERS row, which is enough to linearise but not to fly.
        """
        flight = self.flight
        if len(self.fleet.parameters) != self.n:
            raise ValueError(f"{self.n} rows need a PARAMETERS row each to be flown")
        out = np.empty((steps, self.n, len(MEASURED)))
        start = np.full(self.n, first, np.intp) if isinstance(first, int) else np.asarray(first, np.intp)
        K = np.zeros((0, 0, 0, 0)) if gain is None else gain[None] if gain.ndim == 3 else gain
        forces, errors = listed(pushes, flight.dt)
        along(self.fleet.table(), steered(flight), np.full(self.n, met(flight)), start,
              np.full(self.n, len(flight.time) - 1), np.ascontiguousarray(flight.measured),
              np.tile(stretch(flight), (self.n, 1)), np.ascontiguousarray(np.swapaxes(K, 2, 3)), *forces, *errors,
              np.zeros((0, 6)) if flight.known is None else flight.known, out)
        return out

    def read(self) -> FloatArray:
        """What the instruments should read [n, channels of MEASURED]."""
        out = np.empty((self.n, len(MEASURED)))
        y, p = (a.view(np.float64).reshape(len(a), -1) for a in (self.fleet.measurement, self.fleet.parameters))
        _PLAIN_READ(out.T, self.x.T, y.T, p.T)
        return out

    def correct(self, change: FloatArray) -> None:
        """Add `change` [n, TANGENT] to the states."""
        self.x[:, X] += change[:, : len(STATES)]
        _PLAIN_TURN(self.x.T, self.fleet.measurement["phi"], *change[:, -2:].T)

    def tangent(self) -> FloatArray:
        """States as a vector [n, TANGENT]."""
        e0, e1, e2, e3 = self.x[:, _E].T
        phi = np.arctan2(2.0 * (e0 * e1 + e2 * e3), 1.0 - 2.0 * (e1 * e1 + e2 * e2))
        theta = np.arcsin(np.clip(2.0 * (e0 * e2 - e1 * e3), -1.0, 1.0))
        return np.column_stack([self.x[:, X], phi, theta])


def seen(flight: Reconstruction) -> FloatArray:
    """Weight of every reading in the correction [N, channels]: none where nothing was measured.

    A sparse channel's share comes at once.
    """
    there = np.isfinite(flight.measured)
    return np.asarray(there / np.maximum(np.mean(there, axis=0), 1e-3))


def stretch(flight: Reconstruction) -> FloatArray:
    """By which a fed-back channel's error is multiplied where it was sampled: the sparser, the more [FED_BACK]."""
    return np.asarray(np.max(seen(flight), axis=0, initial=1.0)[:FED_BACK])


def substeps(dt: float) -> int:
    """Steps of the integration in one of a record."""
    return max(1, round(dt / STEP))


def started(flight: Reconstruction, k: int) -> dict[str, float]:
    """The measured state that flights begin from at a sample, START s averaged."""
    return typical_state(flight, slice(k, k + max(2, round(START / flight.dt))))


def steered(flight: Reconstruction) -> FloatArray:
    """Controls along a record [N, CONTROLS]."""
    return np.column_stack([flight.controls[name] for name in CONTROLS])


Listed = tuple[NDArray[np.intp], FloatArray]  # (row, column) of each [items, 2] and their series [items, N]


def listed(pushes: Sequence[Push], dt: float) -> tuple[Listed, Listed]:
    """What is added to states in every step, and to readings."""
    forces = [(q.row, int(X[STATES.index(q.target)]), q.series * dt) for q in pushes if not q.sensor]
    felt = [(q.row, MEASURED.index("a" + "xyz"["uvw".index(q.target)]), q.series) for q in pushes
            if not q.sensor and q.target in "uvw"]  # fmt: skip
    errors = felt + [(q.row, MEASURED.index(q.target), q.series) for q in pushes if q.sensor]
    return _listed(forces), _listed(errors)


def _listed(items: list[tuple[int, int, FloatArray]]) -> Listed:
    at = np.array([item[:2] for item in items], np.intp).reshape(-1, 2)
    return at, np.array([item[2] for item in items], np.float64) if items else np.zeros((0, 0))


def held(parameters: NDArray, dt: float, kind: Kind = LATER) -> NDArray:
    """PARAMETERS for a plant whose surfaces and powers follow a record: no noise, no limits, gusts as states."""
    out = copied(parameters)
    for name in NOISES:
        out[name] = 0.0
    for surface in SURFACES:
        out[f"{surface}_lag"], out[f"{surface}_rate"] = SLOW_SURFACE * dt, 1e3
        out[f"{surface}_min"], out[f"{surface}_max"] = -10.0, 10.0
        out[f"{surface}_gearing"] = 1.0
        for name in (f"{surface}_offset", *bends(surface)):
            out[name] = 0.0
    out["hinge_elevator_hold"] = out["hinge_aileron_hold"] = 1e12
    out["spool_time"] = 1e12
    out["turbulence_sigma_w"] = 0.1 * STILL
    kind.put(out)
    return out


def typical_state(flight: Reconstruction, span: slice) -> dict[str, float]:
    """State of the samples in `span`, as `put` takes it: their mean."""
    return {name: float(values[0]) for name, values in typical_states(flight, [span]).items()}


def typical_states(flight: Reconstruction, spans: Sequence[slice]) -> dict[str, FloatArray]:
    """The same of several spans; the median of the whole record where that is the only one."""
    series = {name: flight.channel(name) for name in MEASURED[:8]} | flight.controls | {"altitude": flight.altitude}
    if list(spans) == [slice(None)]:
        return {name: np.array([np.median(values)]) for name, values in series.items()}
    ends = np.array([span.indices(len(flight.time))[:2] for span in spans])
    padded = np.concatenate([np.column_stack(list(series.values())), np.zeros((1, len(series)))])
    means = np.add.reduceat(padded, ends.ravel())[::2] / np.diff(ends)
    return dict(zip(series, means.T, strict=True))


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


def innovations(flight: Reconstruction, parameters: NDArray, gain: FloatArray, pushes: tuple[Push, ...] = (),
                kind: Kind = LATER) -> FloatArray:
    """Measured less predicted of every row [N-1, n, channels]; nan where nothing was measured.

    Args:
        flight: the record.
        parameters: a PARAMETERS row per variant.
        gain: K of a `Gain` [steps, states, fed-back channels], or one per row [n, ...]; the last step's goes on.
        pushes: generic discrepancies.
        kind: of the gain's gusts.
    """
    return with_spare(flight, parameters, gain, pushes, kind)[:, : len(parameters)]


def with_spare(flight: Reconstruction, parameters: NDArray, gain: FloatArray, pushes: tuple[Push, ...] = (),
               kind: Kind = LATER) -> FloatArray:
    """The same, more rows behind those asked for where two or three beside full lanes would take longer than four."""
    count = len(parameters)
    rows = np.take(parameters, [*range(count), *[count - 1] * (spare(count) * (gain.ndim == 3))])
    flown = Predictor(flight, rows, kind=kind)
    flown.place(0)
    return lost(flown.fly(len(flight.time) - 1, gain=gain, pushes=pushes), np.isfinite(flight.measured[1:]))


def spare(count: int) -> int:
    """Rows beside `count` that fill the last lanes, where that is quicker than flying it one by one."""
    return -count % QUICK if count % QUICK > 0.4 * QUICK else 0


def lost(left: FloatArray, known: NDArray[np.bool_]) -> FloatArray:
    """Innovations [N, rows, channels] where a row that flew to no numbers at all is as far off as can be.

    Else it would leave nothing, like a channel that was not measured, and be the best explanation of any record.
    """
    for channel in np.flatnonzero(known.any(axis=0)):
        last = np.flatnonzero(known[:, channel])[-1]
        for row in np.flatnonzero(~np.isfinite(left[last, :, channel])):
            gone = known[:, channel] & ~np.isfinite(left[:, row, channel])
            left[gone, row, channel] = LOST
    return left
