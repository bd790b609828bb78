"""Effects between a command and what it moves: actuators and the engines' spool, judged on commands alone.

A recorded position does not care how the aircraft flies; so these effects are compared outside the flight model:
first-order lag, rate limit, gearing and rigging of `icing_env.actuators` from recorded command to recorded position,
and lever to shaft power through the spool lag of `icing_env.propulsion`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.signal import lfilter

from icing_env.atmosphere import pressure
from icing_env.discrepancy import bends, bent
from icing_env.jit import entry
from icing_env.propulsion import power_available
from icing_env.record import FloatArray
from sim2real.library.pushes import path_courses, values_of
from sim2real.library.terms import Term
from sim2real.records.channels import SURFACES
from sim2real.records.instruments import UNFILTERED
from sim2real.records.noise import white
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.rounding import SEVERAL, rounding

POSITION_NOISE = 5.2e-4  # rad, the least believed (0.03 deg)
AROUND = 5  # samples about one, where a command of doubtful timing moves
CORRELATED = 0.5  # s in which errors of a position's calibration and timing stay what they are (assumed)
POWER_NOISE = 0.01  # of full power
PATHS = (*(f"{surface}_path" for surface in SURFACES), "propulsion")  # components; the last has more than its path
ACTUATOR = ("lag", "rate", "min", "max", "gearing", "offset")
STILL_COMMAND, STILL_LEVER = 1e-4, 1e-3  # rad, 0..1: a command that moves less tests nothing


def path_residuals(flight: Reconstruction, parameters: NDArray,
                   terms: Sequence[Term] = ()) -> list[tuple[str, FloatArray, list[int]]]:
    """Every path with a recorded command, (measured - predicted)/noise [N, rows], and which rows of `parameters`.

    Rows that differ from the first in nothing that the path knows are left out; generic terms add to its prediction.
    Zero where the position was not recorded.
    """
    out = []
    for surface in (s for s in SURFACES if moves(flight, s)):
        rows = _differing(parameters, [*(f"{surface}_{quantity}" for quantity in ACTUATOR), *bends(surface)])
        predicted = answered(flight, surface, parameters[rows])
        own = [term for term in terms if term.component == f"{surface}_path"]
        courses = path_courses(flight, predicted[:, 0], [term.name for term in own])
        added = [predicted[:, 0] + course for course in courses]
        left = believed(flight, surface, np.column_stack([predicted, *added]))
        out.append((f"{surface}_path", left, rows + [term.row for term in own]))
    return out + _engine_residuals(flight, parameters)


def answered(flight: Reconstruction, surface: str, parameters: NDArray) -> FloatArray:
    """Position [N, rows] of a surface behind its recorded command, from where it was recorded first."""
    measured = flight.positions[surface]
    start = float(measured[np.isfinite(measured)][0])
    return follow(flight.commands[f"{surface}_command"], start, parameters, surface, flight.dt, flight)


def moves(flight: Reconstruction, surface: str) -> bool:
    """Whether a surface's command moves and its position was recorded: else its path tells nothing."""
    command = flight.commands.get(f"{surface}_command")
    return bool(command is not None and np.ptp(command) > STILL_COMMAND
                and np.isfinite(flight.positions[surface]).any())  # fmt: skip


def moving(flights: Sequence[Reconstruction], rows: Sequence[NDArray], surface: str
           ) -> list[tuple[Reconstruction, NDArray]]:  # fmt: skip
    """The records where a surface moves, each with its PARAMETERS row."""
    return [(f, row) for f, row in zip(flights, rows, strict=True) if moves(f, surface)]


def believed(flight: Reconstruction, surface: str, predicted: FloatArray) -> FloatArray:
    """What is left of a surface's positions [N, rows] over its noise: sample by sample, and a delay that lasts."""
    measured = flight.positions[surface][:, None]
    left = np.where(np.isfinite(measured), measured - predicted, 0.0)
    noise, delay, share = flight.once(("late", surface), lambda: _late(flight, surface))
    over = left / noise
    return np.asarray(over - share * delay * (delay.T @ over))


def _late(flight: Reconstruction, surface: str) -> tuple[FloatArray, FloatArray, float]:
    """Noise of a surface's samples, what a delay makes of them over that, and how much of it is taken [N, 1], [N, 1].

    All rows start where the surface was recorded: no delay shows in a first sample.
    """
    rate, noise = position_noise(flight, surface)
    there = np.isfinite(flight.positions[surface])
    there[0] = False
    delay = flight.timing * rate / noise * there
    square = float(np.sum(delay**2))
    return noise[:, None], delay[:, None], (1.0 - 1.0 / np.sqrt(1.0 + square)) / max(square, 1e-12)


def position_noise(flight: Reconstruction, surface: str) -> tuple[FloatArray, FloatArray]:
    """Rate of a recorded position, bridged where it was not, and what it may be off its command's by [N].

    Of the record alone: what noise is believed must not depend on the row that stands first. Samples count as if they
    were CORRELATED apart.
    """
    return flight.once(("position noise", surface), lambda: _position_noise(flight, surface))


def _position_noise(flight: Reconstruction, surface: str) -> tuple[FloatArray, FloatArray]:
    measured, good = flight.positions[surface], np.isfinite(flight.positions[surface])
    rate = np.gradient(np.interp(flight.time, flight.time[good], measured[good]), flight.dt)
    least = max(POSITION_NOISE, white(measured[good]), rounding(measured, SEVERAL))
    noise = np.hypot(least, flight.timing * maximum_filter1d(np.abs(rate), AROUND))
    return rate, noise * _weight(_apart(flight, good))


def of_paths(flight: Reconstruction, components: Collection[str]) -> Reconstruction:
    """The record with the commands of some components ("elevator_path", "propulsion") alone."""
    kept = tuple("throttle" if c == "propulsion" else c.removesuffix("_path") for c in components if c in PATHS)
    return replace(flight, commands={n: c for n, c in flight.commands.items() if n.startswith(kept)} if kept else {})


def path_gram(flight: Reconstruction, parameters: NDArray, terms: Sequence[Term] = (), first: int = 0) -> FloatArray:
    """Inner products [rows, rows] of `path_residuals` from sample `first` on; rows but the first as departures."""
    gram = np.zeros((len(parameters), len(parameters)))
    for _, path, own in path_residuals(flight, parameters, terms):
        path = path[first:].copy()
        path[:, 1:] -= path[:, :1]
        gram[np.ix_(own, own)] += path.T @ path
    return gram


def excess(flight: Reconstruction, parameters: NDArray) -> dict[str, float]:
    """Whitened square above noise that the paths of each component leave: as much as any course of it would take.

    Args:
        parameters: one PARAMETERS row.
    """
    out = dict.fromkeys(PATHS, 0.0)
    for component, residual, _ in path_residuals(flight, parameters):
        out[component] += float(np.sum(residual[:, 0] ** 2)) - counted(flight, component)
    return out


def counted(flight: Reconstruction, component: str, first: int = 0) -> int:
    """Samples of a path from `first` on, as many as they would be CORRELATED apart."""
    recorded = flight.positions.get(component.removesuffix("_path"))  # power is known at every step
    there = np.ones(len(flight.time), bool) if recorded is None else np.isfinite(recorded)
    return round(np.count_nonzero(there[first:]) * min(_apart(flight, there) / CORRELATED, 1.0))


def _apart(flight: Reconstruction, there: NDArray[np.bool_]) -> float:
    """Seconds from one sample to the next, where some steps have one."""
    steps = np.diff(np.flatnonzero(there))
    return flight.dt * (float(np.median(steps)) if len(steps) else 1.0)


def _differing(parameters: NDArray, names: list[str]) -> list[int]:
    """Row 0 and the rows that differ from it in one of the parameters named."""
    moved = np.any([parameters[n] != parameters[n][0] for n in names], axis=0)
    return [0, *(int(i) for i in np.flatnonzero(moved))]


def follow(command: FloatArray, start: float, p: NDArray, surface: str, dt: float,
           along: Reconstruction | None = None) -> FloatArray:  # fmt: skip
    """Position [N, rows] of a surface behind its actuator and the recording's low pass.

    The command of sample k acts during the step that ends there.

    Args:
        along: the record, whose airspeed, load and other surfaces may push this one; nothing does if omitted.
    """
    cut = 1.0 - np.exp(-2.0 * np.pi * p["filter_frequency"] * dt)
    share = 1.0 - np.exp(-dt / np.maximum(p[f"{surface}_lag"], 1e-3))
    pushed = np.zeros((len(command), len(p)))
    if along is not None:
        for name in (n for n in bends(surface) if "_of_" in n and np.any(p[n])):
            pushed += values_of(along, name.rpartition("_")[2])[:, None] * p[name]
    gear, offset, cube, side, magnitude, direction, low, high, rate = (np.ascontiguousarray(p[f"{surface}_{name}"]) for
        name in ("gearing", "offset", "cube", "side", "magnitude", "direction", "min", "max", "rate"))  # fmt: skip
    out = np.empty((len(command), len(p)))
    _follow(command, start, gear, offset, cube, side, magnitude, direction, low, high, rate * dt, share, cut, pushed,
            out)  # fmt: skip
    return out


@entry
def _follow(command: Any, start: float, gear: Any, offset: Any, cube: Any, side: Any, magnitude: Any, direction: Any,
            low: Any, high: Any, step: Any, share: Any, cut: Any, pushed: Any, out: Any) -> None:
    """First-order lag with a limited step, then the low pass, for every row; `pushed`, `out`: [N, rows]."""
    for i in range(out.shape[1]):
        position = filtered = start
        out[0, i] = start
        for k in range(1, len(command)):
            told = bent(gear[i]*command[k] + offset[i], position, cube[i], side[i], magnitude[i], direction[i],
                        pushed[k, i])
            target = min(max(told, low[i]), high[i])
            position += min(max((target - position)*share[i], -step[i]), step[i])
            filtered += cut[i]*(position - filtered)
            out[k, i] = filtered


@entry
def full_power(altitude: Any, aircraft: Any) -> Any:
    """Shaft power of one engine with its lever forward at each height [W]; `aircraft`: one PARAMETERS row."""
    out = np.empty(len(altitude))
    for k in range(len(altitude)):
        out[k] = power_available(pressure(altitude[k]), aircraft[0])
    return out


def driven(flight: Reconstruction, parameters: NDArray, paths: Collection[str]) -> Reconstruction:
    """The record with the surfaces of `paths` where the actuator of one PARAMETERS row takes the recorded command.

    Where the command was not recorded the surface stays where it was recorded.
    """
    controls, unrecorded = dict(flight.controls), parameters.copy()
    unrecorded["filter_frequency"] = UNFILTERED
    for surface in paths:
        command = flight.commands.get(f"{surface}_command")
        if command is not None and np.ptp(command) > STILL_COMMAND:
            first = float(flight.controls[surface][0])
            controls[surface] = follow(command, first, unrecorded, surface, flight.dt, flight)[:, 0]
    return replace(flight, controls=controls)


def _engine_residuals(flight: Reconstruction, parameters: NDArray) -> list[tuple[str, FloatArray, list[int]]]:
    if not flight.shaft_powers:
        return []
    rows = _differing(parameters, ["spool_time"])
    lags = parameters["spool_time"][rows]
    if len(rows) > 1:
        return [("propulsion", left, rows) for left in _engines_left(flight, lags)]
    known = flight.once(("engines", float(lags[0])), lambda: _engines_left(flight, lags))
    return [("propulsion", left, rows) for left in known]


def _engines_left(flight: Reconstruction, lags: FloatArray) -> list[FloatArray]:
    """What engines with spools of some lags leave, by side [N, lags]."""
    out = []
    full = full_power(flight.altitude, flight.parameters)
    share = 1.0 - np.exp(-flight.dt / lags)
    for side in ("left", "right"):
        lever = flight.commands.get(f"throttle_{side}")
        if lever is None or np.ptp(lever) < STILL_LEVER:
            continue
        power = np.full(len(lags), flight.controls[f"power_{side}"][0])
        wanted = full * np.clip(lever, 0.0, 1.0)
        found = np.empty((len(lever), len(lags)))
        found[0] = power
        for j, s in enumerate(share):
            found[1:, j] = lfilter([s], [1.0, s - 1.0], wanted[1:], zi=[(1.0 - s) * power[j]])[0]
        left = (flight.controls[f"power_{side}"][:, None] - found) / full[:, None]
        # the chart between lever and power is nobody's claim: a constant share and an offset are taken out, and where
        # the owner's propeller lies between thrust and power, a share that changes with airspeed
        charts = [lever] if flight.power_from == "torque" else [lever, lever * flight.channel("airspeed")]
        out.append(_without_line(left, *charts) / (POWER_NOISE * _weight(flight.dt)))
    return out


def _weight(apart: float) -> float:
    """By which noise is multiplied so that samples some seconds apart count as if they were CORRELATED apart."""
    return float(np.sqrt(max(CORRELATED / apart, 1.0)))


def _without_line(left: FloatArray, *shares: FloatArray) -> FloatArray:
    base = np.column_stack([np.ones(len(left)), *shares])
    return left - base @ np.linalg.lstsq(base, left, rcond=None)[0]
