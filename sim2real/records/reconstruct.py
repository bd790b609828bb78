"""A flight record as what a simulation needs: time steps, controls, air, start, and measurements to compare with.

Surfaces are the recorded positions; where powers come from stands in `powers.py`. Every choice that had to be made is
kept in `notes`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from estimators.signals.data_checks import check
from estimators.signals.resample import common_grid
from icing_env import aircraft
from icing_env.atmosphere import density, static_air
from icing_env.errors import InputError
from icing_env.record import DataProblem, FlightRecord, FloatArray
from sim2real.records import instruments
from sim2real.records.channels import LATERAL, MEASURED, SURFACE_NOISE, SURFACES
from sim2real.records.noise import channel_noise, power_noise
from sim2real.records.powers import as_engines_move, powers
from sim2real.records.rounding import SEVERAL, rounding

STILL = ("altitude", "thrust_left", "thrust_right")  # channels of which a constant reading says less than nothing
LONGEST_STEP, SHORTEST_STEP = 0.1, 0.018  # s: records are 10 to 200 Hz; faster ones are thinned to about 50 Hz
SHORTEST = 5.0  # s: the filter settles for the first four of them (signatures/whitening.py)
TIMING = 0.002  # s: command and position are no better in step, nor is the actuator exactly of first order (assumed)
T = TypeVar("T")
LONGITUDINAL = ("airspeed", "alpha", "q", "theta", "ax", "az", "elevator")


@dataclass(frozen=True)
class Inadequacy:
    """What the model is known to lack, with its numbers at their best: noise to the filter.

    Attributes:
        walk: times as much as `kalman.WALK` that the states are disturbed.
        colour: what slow innovations of a channel are worth less, its long-run variance once whitened, where above one.
        means: how many times less a channel's mean over the flight is worth than that.
    """

    walk: float = 1.0
    colour: dict[str, float] = field(default_factory=dict)
    means: dict[str, float] = field(default_factory=dict)

    @property
    def followed(self) -> bool:
        """Whether the states are disturbed by no more than those of an aircraft that the model follows."""
        return self.walk <= 1.0

    def with_walk(self, least: float) -> Inadequacy:
        """The same with at least so much disturbance."""
        return replace(self, walk=max(self.walk, least))


@dataclass(frozen=True)
class Reconstruction:
    """One record on the simulation's steps; N samples.

    Attributes:
        name: of the record, for people only.
        time, dt: s.
        measured: [N, channels of MEASURED], nan where not sampled.
        controls: positions of SURFACES and flap [rad], powers left and right [W], by name, each (N,); the recording's
            low pass is undone, since the simulated instruments apply it again.
        positions: the surfaces as recorded, nan where they were not.
        commands: surface commands [rad] and levers by name where recorded.
        parameters: one PARAMETERS row with the mass, inertia and air of this record.
        altitude: m, each sample (constant where not recorded).
        power_from: "torque", "thrust", "throttle" or "balance".
        noise: standard deviation per channel of MEASURED, from the record's own high frequencies.
        notes: what was assumed.
        known: accelerations (m/s2 along x, y, z, rad/s2 about them) that the model is given beside its own [N, 6]: what
            another simulator has and ours has not (`sim2real.rollout`).
        unseen: `noise` where it is more than differences of the samples show (rounding, interpolation), else zero.
        surface_noise: standard deviation of the SURFACES in `controls` [3], rad, sample by sample.
        power_noise: the same of the powers left and right [2], W: of white noise that moves the aircraft as much.
        about: the condition, by quantity, that generic terms count deviations from; the record's medians if left out.
        reach: root mean square of the generic terms' time courses, by name, where above one.
        inadequacy: of the model.
        timing: s, how sharply it is known when commands act.
        kept: what others have made of this record and would make again, by what it is; a changed record begins anew.
    """

    name: str
    record: FlightRecord
    time: FloatArray
    dt: float
    measured: FloatArray
    controls: dict[str, FloatArray]
    positions: dict[str, FloatArray]
    commands: dict[str, FloatArray]
    parameters: NDArray
    altitude: FloatArray
    power_from: str
    noise: FloatArray
    notes: tuple[str, ...]
    known: FloatArray | None = None
    unseen: FloatArray = field(default_factory=lambda: np.zeros(len(MEASURED)))
    surface_noise: FloatArray = field(default_factory=lambda: np.full(len(SURFACES), SURFACE_NOISE))
    power_noise: FloatArray = field(default_factory=lambda: np.zeros(2))
    about: dict[str, float] = field(default_factory=dict)
    reach: dict[str, float] = field(default_factory=dict)
    inadequacy: Inadequacy = Inadequacy()
    timing: float = TIMING
    kept: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def shaft_powers(self) -> bool:
        """Whether powers show how engines follow their levers: by torque, or by thrust that was computed from it."""
        return self.power_from == "torque" or (self.power_from == "thrust" and "torque_left" in self.record.channels)

    def channel(self, name: str) -> FloatArray:
        """One column of `measured`, gaps filled by interpolation; zeros where it was not recorded."""
        return self.once(("channel", name), lambda: self._filled(self.measured[:, MEASURED.index(name)]))

    def filled_as(self, other: Reconstruction, names: Iterable[str]) -> Reconstruction:
        """The same with gaps of some channels filled as another has these channels."""
        filled = replace(self)
        for name in names:
            filled.kept["channel", name] = other.channel(name)
        return filled

    def _filled(self, values: FloatArray) -> FloatArray:
        good = np.isfinite(values)
        if not good.any():
            return np.zeros(len(values))
        return np.interp(self.time, self.time[good], values[good])

    def once(self, what: Any, make: Callable[[], T]) -> T:
        """What `make` makes of the record, made once; `what` names it."""
        if what not in self.kept:
            self.kept[what] = make()
        return self.kept[what]  # type: ignore[no-any-return]

    def has(self, name: str) -> bool:
        """Whether the channel was recorded."""
        return bool(np.isfinite(self.measured[:, MEASURED.index(name)]).any())


def reconstruct(record: FlightRecord, base: NDArray | None = None) -> Reconstruction:
    """Check a record and bring it onto simulation steps.

    Args:
        record: as read from its file.
        base: PARAMETERS row of the model; the published Twin Otter if omitted.

    Raises:
        InputError: the record is wrong or lacks what a longitudinal diagnosis needs.
    """
    record = check(record)
    notes: list[str] = []
    at, dt, values = _steps(record, notes)
    record = record.with_problems(_unrecorded(values, record))
    row = _airframe(record, aircraft.load() if base is None else base.copy(), values, notes)
    instruments.declared(row, record, values, dt, notes)
    measured = _measured(record, at, values, dt)
    altitude = _air(row, values, notes)
    row["wind_reference_altitude"] = float(np.median(altitude))  # a steady wind shows nowhere; only its change does
    moved = {n: values[n] if n in values else np.zeros(len(at)) for n in SURFACES}
    controls = {n: unfiltered(v, float(row["filter_frequency"][0]), dt) for n, v in moved.items()}
    positions = {n: np.where(_sampled(record, n, at, dt) & (n in values), v, np.nan) for n, v in moved.items()}
    controls["flap"] = values.get("flap", np.zeros(len(at)))
    notes.extend(f"{n} not recorded: " + ("where its command puts it" if f"{n}_command" in values else "taken as zero")
                 for n in SURFACES if n not in values)
    source, driving = powers(row, values, altitude, dt, notes, instruments.thrust_was_measured(record))
    controls |= {n: as_engines_move(v, dt) for n, v in driving.items()} if source == "thrust" else driving
    names = [*(f"{s}_command" for s in SURFACES), "throttle_left", "throttle_right"]
    commands = {n: values[n] for n in names if n in values}
    for name in MEASURED[-2:]:
        if source != "torque":
            measured[:, MEASURED.index(name)] = np.nan  # it drives the simulation: nothing is left to compare
    told_by = {side: "ax" if source == "balance" else f"{source}_{side}" for side in ("left", "right")}
    shaking = np.array([power_noise(record, name, driving[f"power_{side}"], _sampled(record, name, at, dt))
                        for side, name in told_by.items()])  # fmt: skip
    noise, unseen = channel_noise(measured, record, source)
    surface_noise = np.maximum(SURFACE_NOISE, [rounding(positions[n], SEVERAL) for n in SURFACES])
    if source == "balance":
        measured[:, MEASURED.index("ax")] = np.nan  # so does it
    return Reconstruction(record.meta.name, record, at - at[0], dt, measured, controls, positions, commands, row,
                          altitude, source, noise, tuple(notes), unseen=unseen, surface_noise=surface_noise,
                          power_noise=shaking)


def _steps(record: FlightRecord, notes: list[str]) -> tuple[FloatArray, float, dict[str, FloatArray]]:
    """Times of the steps that a record is simulated in (N,), s, the length of one, and every channel at them (N,).

    Raises:
        InputError: too few samples, or a channel that a longitudinal diagnosis needs is not there.
    """
    grid, where = common_grid(record), f"record '{record.meta.name}'"
    if lacking := [n for n in LONGITUDINAL if n not in grid.values]:
        raise InputError(f"{where} lacks {', '.join(lacking)}: a diagnosis needs time, {', '.join(LONGITUDINAL)}")
    if grid.dt > LONGEST_STEP * 1.01:
        raise InputError(f"{where} has {1/grid.dt:.3g} samples/s; at least 10 are needed")
    every = max(1, round(instruments.STEP / grid.dt)) if grid.dt < SHORTEST_STEP else 1
    if (lasts := float(np.ptp(grid.time))) < SHORTEST:
        raise InputError(f"{where} lasts {lasts:.3g} s; at least {SHORTEST:g} are needed")
    if every > 1:
        notes.append(f"thinned from {1/grid.dt:.0f} to {1/(grid.dt*every):.0f} samples/s")
    return grid.time[::every], grid.dt * every, {n: v[::every] for n, v in grid.values.items()}


def _unrecorded(values: dict[str, FloatArray], record: FlightRecord) -> list[DataProblem]:
    """Channels whose absence keeps a lateral diagnosis back, where a lateral control was recorded."""
    if "aileron" not in values and "rudder" not in values:
        return []
    start, end = float(record.time[0]), float(record.time[-1])
    return [DataProblem(name, "not recorded: a lateral diagnosis lacks it", start, end, False)
            for name in (*LATERAL, "aileron", "rudder") if name not in values]


def _measured(record: FlightRecord, time: FloatArray, values: dict[str, FloatArray], dt: float) -> FloatArray:
    """Samples at the steps; blank between those of slower channels, and where one reads the same throughout."""
    out = np.full((len(time), len(MEASURED)), np.nan)
    for j, name in enumerate(MEASURED):
        if name not in values or (name in STILL and not np.ptp(values[name])):
            continue
        near = _sampled(record, name, time, dt)
        out[near, j] = values[name][near]
    return out


def _sampled(record: FlightRecord, name: str, time: FloatArray, dt: float) -> NDArray[np.bool_]:
    """Which steps have a sample of a channel near [N]."""
    valid = np.isfinite(record[name]) if name in record.channels else np.zeros(len(record), bool)
    near = np.zeros(len(time), dtype=bool)
    near[np.clip(np.searchsorted(time, record.time[valid] - 0.5 * dt), 0, len(time) - 1)] = True
    return near


def _airframe(record: FlightRecord, row: NDArray, values: dict[str, FloatArray], notes: list[str]) -> NDArray:
    """Mass, inertia and geometry of the record where it states them."""
    meta = record.meta
    mass = float(np.mean(values["mass"])) if "mass" in values else meta.mass
    if mass:
        row["mass"] = mass
    else:
        notes.append(f"mass not stated: {row['mass'][0]:.0f} kg from the aircraft file")
    if meta.inertia:
        for axis, value in zip(("xx", "yy", "zz", "xz"), meta.inertia, strict=True):
            row[f"inertia_{axis}"] = value
    else:
        notes.append("inertia not stated: from the aircraft file")
    if meta.geometry:
        row["wing_area"], row["span"], row["chord"] = (
            meta.geometry.wing_area, meta.geometry.span, meta.geometry.chord)
    return row


def _air(row: NDArray, values: dict[str, FloatArray], notes: list[str]) -> FloatArray:
    """Altitude of each sample, with a temperature offset in `row` so that the density is the record's."""
    n = len(values["airspeed"])
    if "altitude" in values:
        altitude = values["altitude"].copy()
        if "temperature" in values:
            standard = static_air(float(np.median(altitude)))[0]
            row["temperature_offset"] = float(np.median(values["temperature"])) - standard
        return altitude
    if "density" in values or "qbar" in values:
        rho = np.median(values.get("density", 2.0 * values.get("qbar", 0.0) / values["airspeed"] ** 2))
        heights = np.linspace(0.0, 9000.0, 901)
        found = float(np.interp(-rho, [-density(float(h)) for h in heights], heights))
        notes.append(f"altitude not recorded: {found:.0f} m, where the standard atmosphere has the record's density")
        return np.full(n, found)
    notes.append("altitude and density not recorded: 2200 m assumed")
    return np.full(n, 2200.0)


def unfiltered(values: FloatArray, frequency: float, dt: float) -> FloatArray:
    """Undo the first-order low pass of the recording (icing_env.sensors): noise grows by half."""
    share = 1.0 - math.exp(-2.0 * math.pi * frequency * dt)
    out = values.copy()
    out[1:] = (values[1:] - (1.0 - share) * values[:-1]) / share
    return out
