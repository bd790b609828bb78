"""Manoeuvres that nobody has flown yet, as records: what instruments would read, and how innovations would scatter."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from icing_env import aircraft
from icing_env.atmosphere import density
from icing_env.errors import InputError, nearest
from icing_env.parameters import UNITS
from icing_env.record import FlightRecord, FloatArray, RecordMeta
from sim2real.actuators.paths import driven, follow, full_power
from sim2real.actuators.surfaces import EXACT
from sim2real.baseline.loading import of_published
from sim2real.flown.settling import nearer
from sim2real.library.candidates import Bank, parameter_rows
from sim2real.planning.limits import hiding, per_deviation, with_nuisances
from sim2real.planning.manoeuvre import MANOEUVRES, Manoeuvre, asked, flown
from sim2real.prediction.gusts import Gusts
from sim2real.prediction.kalman import DRYDEN, gains, linearise, roughness
from sim2real.prediction.kalman import follow as follow_gain
from sim2real.prediction.readings import apart
from sim2real.records.channels import FED_BACK, G0, MEASURED, NOISE_FLOOR, SURFACES
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.evidence import compare
from sim2real.weigh import Progress

STEP, SLOW = 0.02, ("altitude", "thrust_left", "thrust_right")  # s between samples; channels sampled every fifth
UPSET = {"beta": 0.35, "phi": 1.2, "theta": 0.8}  # rad, beyond which nobody plans to fly (assumed)
SETTLING = 2  # times that the best of the nuisances is flown
_NAME = re.compile(r"(?P<kind>.+) (?P<word>at|from) (?P<speed>\d+(\.\d+)?) m/s")
_LOWEST, _HIGHEST = 20.0, 110.0  # m/s, as of a scenario's start


def named(names: Iterable[str], amplitude: float = 1.0) -> tuple[Manoeuvre, ...]:
    """Manoeuvres by their names, "elevator doublets at 55 m/s", at any speed; "all" for every one of the list.

    Args:
        names: a manoeuvre named twice is flown twice.
        amplitude: of doublets and steps, times that of the list.

    Raises:
        InputError: there is none of that name (the nearest is told), or the speed is none of an aircraft's.
    """
    out = [m for name in names for m in (MANOEUVRES if name == "all" else (_named(name),))]
    return tuple(replace(m, doublets=tuple((c, start, size * amplitude, half) for c, start, size, half in m.doublets))
                 for m in out)  # fmt: skip


def _named(name: str) -> Manoeuvre:
    """The manoeuvre of that kind whose speed is nearest, flown at the speed of the name."""
    found = _NAME.fullmatch(name)
    kind = f"{found['kind']} {found['word']} " if found else "?"
    alike = [m for m in MANOEUVRES if m.name.startswith(kind)]
    if found is None or not alike:
        raise InputError(f"no manoeuvre '{name}': {nearest(name, ['all', *(m.name for m in MANOEUVRES)])}")
    speed = float(found["speed"])
    if not _LOWEST <= speed <= _HIGHEST:
        raise InputError(f"manoeuvre '{name}': airspeed must be {_LOWEST:g} to {_HIGHEST:g} m/s")
    return replace(min(alike, key=lambda m: abs(m.airspeed - speed)), name=name, airspeed=speed)


def template(altitude: float, noise: Mapping[str, float]) -> Reconstruction:
    """A record of nothing, in every channel.

    Args:
        altitude: m.
        noise: standard deviation by channel where it is not that of the aircraft's instruments.

    Raises:
        InputError: no such channel, or a noise that is not positive.
    """
    row = aircraft.load()
    row["wind_reference_altitude"] = altitude
    own = {n: float(row[f"noise_{n}"][0]) for n in MEASURED if f"noise_{n}" in UNITS}
    own |= dict.fromkeys(("thrust_left", "thrust_right"), float(row["noise_thrust"][0]))
    own["altitude"] = float(row["noise_pressure"][0]) / (density(altitude) * G0)  # it is read from static pressure
    for name, value in noise.items():
        if name not in MEASURED:
            raise InputError(f"no channel '{name}' to have noise: {nearest(name, list(MEASURED))}")
        if not 0.0 < value < np.inf:
            raise InputError(f"noise of '{name}' must be positive, got {value:g}")
    spread = np.array([max(NOISE_FLOOR[n], (own | dict(noise))[n]) for n in MEASURED])
    time: FloatArray = np.array([0.0, STEP])
    return Reconstruction("plan", FlightRecord({"time": time}, RecordMeta(name="plan")), time, STEP,
                          np.zeros((2, len(MEASURED))), {}, {}, {}, row, np.full(2, altitude), "torque", spread, ())


def planned(empty: Reconstruction, manoeuvre: Manoeuvre) -> Reconstruction:
    """A manoeuvre as the model would fly it, asked for by commands that actuators and engines follow.

    Raises:
        InputError: the aircraft cannot fly steadily at that speed and height, or is far into a stall or an upset.
    """
    try:
        made, start = asked(empty, manoeuvre)
    except InputError as why:
        raise InputError(f"'{manoeuvre.name}' cannot be flown: {why}") from None
    made = flown(_commanded(made), start)
    _check_flown(made, manoeuvre.name)
    slow = [MEASURED.index(name) for name in SLOW]
    made.measured[np.ix_(np.arange(len(made.time)) % 5 != 0, slow)] = np.nan
    return made


def _check_flown(made: Reconstruction, name: str) -> None:
    """Refuse flights far into a stall or an upset: the smallest change grows there and would seem to be revealed."""
    row = made.parameters[0]
    deep = float(row["alpha_stall"] + 0.5 * row["stall_width"])  # half of the flow separated
    for channel, most in ({"alpha": deep} | UPSET).items():
        worst = float(np.max(np.abs(made.measured[:, MEASURED.index(channel)])))
        if not worst <= most:
            raise InputError(f"'{name}' cannot be flown: {channel} reaches {worst:.2f} rad, {most:.2f} is the most; "
                             "make its amplitude smaller")


def _commanded(made: Reconstruction) -> Reconstruction:
    """The planned controls taken as commands: surfaces behind their actuators, powers behind the spool."""
    row = made.parameters
    commands = {f"{s}_command": made.controls[s] for s in SURFACES}
    positions = {s: follow(made.controls[s], float(made.controls[s][0]), row, s, made.dt)[:, 0] for s in SURFACES}
    full, share = full_power(made.altitude, row), 1.0 - np.exp(-made.dt / float(row["spool_time"][0]))
    controls = dict(made.controls)
    for side in ("left", "right"):
        wanted = np.minimum(made.controls[f"power_{side}"], full)
        commands[f"throttle_{side}"] = wanted / full
        controls[f"power_{side}"] = wanted.copy()
        controls[f"power_{side}"][1:] = lfilter([share], [1.0, share - 1.0], wanted[1:],
                                                zi=[(1.0 - share) * wanted[0]])[0]  # fmt: skip
    known = np.full(len(SURFACES), EXACT)
    return driven(replace(made, controls=controls, positions=positions, commands=commands, surface_noise=known), row,
                  SURFACES)


def evidence(flights: Sequence[Reconstruction], candidates: Bank, sigma: float, progress: Progress
             ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Inner products of signatures [rows, rows], and of what nuisances leave of them at the best for each row.

    That best is flown: a derivative 10 % off lies hundreds of noise units away, of which a linear step leaves several,
    and they would pass for the effect.

    Args:
        flights: of `planned`; the aircraft is the same in all of them.
        candidates: the rows.
        sigma: gust intensity expected, m/s.
        progress: told what is being done.
    """
    n, precision = len(candidates.nuisances), of_published(candidates.nuisances).precision
    moved = np.zeros((candidates.size, n))
    found = []
    for k in range(1 + SETTLING):
        progress(f"flying {candidates.size} variants through {len(flights)} manoeuvres, {1 + k} of {1 + SETTLING}")
        gram = np.sum([_signatures(flight, candidates, sigma, moved) for flight in flights], axis=0)
        found.append(gram)
        best, left = hiding(gram[1 : 1 + n, 1 : 1 + n], gram[:, 1 : 1 + n], gram, precision, moved)
        moved = nearer(best, candidates)
        moved[: 1 + n] = 0.0  # the model and the nuisances themselves
    return found[0], left


def _signatures(made: Reconstruction, candidates: Bank, sigma: float, moved: FloatArray) -> FloatArray:
    """Inner products of whitened signatures along one planned manoeuvre [rows, rows].

    Args:
        made: of `planned`.
        candidates: the rows.
        sigma: gust intensity expected, m/s. Gusts count as what innovations scatter by; what they would shake by
            themselves is not counted upon.
        moved: nuisances that each row is flown with, in standard deviations [rows, nuisances].
    """
    made = replace(made, noise=_apparent(made, sigma))
    gain = follow_gain(made, gains(made, (sigma,))[0])
    rows: NDArray = parameter_rows(made, candidates)
    with_nuisances(rows, candidates, moved, made.power_from)
    return per_deviation(compare(made, rows, gain, _factor(made, gain.S)).gram, len(candidates.nuisances))


def _apparent(made: Reconstruction, sigma: float) -> FloatArray:
    """Noise as a record would show it, gusts included: the gain takes off again what gusts add to it."""
    A, C, _ = (matrix[0] for matrix in linearise(made))
    C = C[:FED_BACK]
    added = roughness(A, C, A[:, DRYDEN], C[:, DRYDEN], Gusts(sigma).noise(made), apart(made))
    out = made.noise.copy()
    out[:FED_BACK] = np.sqrt(out[:FED_BACK] ** 2 + added)
    return out


def _factor(made: Reconstruction, S: FloatArray) -> FloatArray:
    """Whitens innovations whose covariance is `S` [steps, ...]: [steps, channels, channels], as after a flight."""
    n, use = len(MEASURED), np.arange(FED_BACK - 1)
    out = np.zeros((len(S), n, n))
    out[:, use[:, None], use] = np.linalg.inv(np.linalg.cholesky(S[:, use[:, None], use]))
    for c in range(FED_BACK - 1, n):
        out[:, c, c] = 1.0 / made.noise[c]
    return out
