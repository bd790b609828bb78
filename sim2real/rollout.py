"""A simulator of the user's in the place of ours: all that it has to do is fly freely from a state under controls.

Where the gap lies needs no more than that (`gap_by_channel`). Which effect causes it needs effects, and those live in
our plant; so our plant is made to fly as yours. At every sample of a record both are started from the measured state
and fly one step under the recorded controls; the difference of the accelerations that they read,

    known = yours - ours     (along and about the three axes),

is given to our plant along that record as something it is known to do. What is then left unexplained is the gap between
your simulator and the aircraft, and every signature of an effect passes through the same filter as before. First order:
the difference is taken at the measured states, and how an effect acts is our plant's.

A simulator started anew has forgotten what it remembers beside the state of the flight (the downwash on its way to the
tail, lags of its own). What that is worth is found where it has flown for 0.3 s and more: its acceleration there less
that of a restart from the same state. For ours likewise; the difference is added.

A gap can also be told without any effect: `sim2real.closing.missing_terms`.
"""

from __future__ import annotations

import runpy
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from icing_env import aircraft
from icing_env.atmosphere import density
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray
from icing_env.sensors import SENSOR_PARAMETERS
from sim2real.prediction.predictor import Predictor, put
from sim2real.prediction.windows import COMPARED, FREE, cut
from sim2real.records.channels import TOLERANCE
from sim2real.records.powers import thrust_per_power
from sim2real.records.reconstruct import LONGITUDINAL, Inadequacy, Reconstruction, reconstruct

BEGIN = 0.5  # s of the record that the start of a window is taken from
SMOOTH = 0.3  # s of the measured states from which both simulators are started at every sample
WARM, RUN = 0.3, 1.0  # s after which your simulator remembers what it would in flight; s flown at a time
SECOND_HAND = 10.0  # times as much that states are disturbed, for accelerations taken at noisy ones (assumed)
_FELT = ("ax", "ay", "az", "p", "q", "r")
_FORCES, _RATES = ([COMPARED.index(c) for c in names] for names in (_FELT[:3], _FELT[3:]))
_RATES_FREE, _STATE, _ALPHA = [FREE.index(c) for c in _FELT[3:]], [COMPARED.index(c) for c in FREE], FREE.index("alpha")


class Rollout(Protocol):
    """A simulator that flies freely: what `icing diagnose --simulator FILE.py` looks for under the name `rollout`."""

    def __call__(self, initial_state: Mapping[str, float], controls: Mapping[str, FloatArray], dt: float,
                 parameters: Mapping[str, float]) -> Mapping[str, FloatArray]:
        """Fly from `initial_state` under `controls`.

        Args:
            initial_state: airspeed [m/s], alpha, beta [rad], p, q, r [rad/s], phi, theta [rad], altitude [m].
            controls: at times 0, dt, ... (each (N + 1,)): elevator, aileron, rudder, flap [rad], thrust_left,
                thrust_right [N], power_left, power_right [W at the shaft]; signs as in a flight record.
            dt: s.
            parameters: what the record knows of the aircraft: mass [kg], inertia_xx, _yy, _zz, _xz [kg m2], wing_area
                [m2], span, chord [m], density [kg/m3].

        Returns:
            Readings at dt, 2 dt, ... N dt (each (N,)) of any of airspeed, alpha, beta, p, q, r, phi, theta, ax, ay, az
            [m/s2, specific force at the c.g.], altitude; without noise, lag or filter. What is left out is not
            compared.
        """


def from_file(path: str | Path) -> Rollout:
    """The function `rollout` of a Python file (which is run).

    Raises:
        InputError: the file does not run, or has no such function.
        FileNotFoundError: there is no such file.
    """
    if not Path(path).is_file():
        raise FileNotFoundError(2, "no such file with a simulator", str(path))
    try:
        found = runpy.run_path(str(path), run_name="a_simulator_of_your_own").get("rollout")
    except Exception as problem:
        raise InputError(f"simulator '{path}': the file does not run, {type(problem).__name__}: {problem}"
                         ) from problem  # fmt: skip
    if not callable(found):
        raise InputError(f"simulator '{path}': no function `rollout(initial_state, controls, dt, parameters)` in it")
    return found  # type: ignore[no-any-return]


def gap_by_channel(rollout: Rollout, record: FlightRecord) -> dict[str, float]:
    """e_c of your simulator: RMS of measured less flown freely over windows of 10 s, in tolerances.

    Any channels will do. Windows start from straight lines through the first half second measured.
    """
    flight = reconstruct(record)
    windows = cut(flight)
    total = []
    for first in windows.first:
        yours = fly_yours(rollout, flight, int(first), start_of(flight, int(first)), windows.length)
        measured = flight.measured[first + 1 : first + 1 + windows.length, : len(COMPARED)]
        total.append(np.square((measured - yours) / [TOLERANCE[c] for c in COMPARED]))
    squares = np.concatenate(total)
    known = np.isfinite(squares)
    mean = np.where(known, squares, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return {c: float(np.sqrt(m)) for c, m, k in zip(COMPARED, mean, known.any(axis=0), strict=True) if k}


def flying_as(flight: Reconstruction, rollout: Rollout) -> Reconstruction:
    """The record over our plant flying as your simulator does (`known`, see the module).

    Args:
        flight: reconstructed over the published model.
        rollout: your simulator.

    Raises:
        InputError: your simulator fails or reads no ax, az, q (ay, p, r are taken to be ours where it reads none).
    """
    steps = len(flight.time) - 1
    at = np.arange(steps)
    measured = np.column_stack([_smooth(flight.channel(name), flight.dt) for name in FREE])[:-1]
    flown, kept, reached = _runs(rollout, flight, measured)
    settled = _yours(rollout, flight, measured) - _ours(flight, at, measured, measured[:, _ALPHA])
    remembered = flown - _yours(rollout, flight, reached)
    ours = _ours(flight, at, reached, kept) - _ours(flight, at, reached, reached[:, _ALPHA])
    known = np.zeros((steps + 1, 6))
    known[1:] = settled + remembered - ours
    absent = [bool(np.isnan(column).any()) for column in known.T]
    lacking = [name for name, gone in zip(_FELT, absent, strict=True) if gone and name in LONGITUDINAL]
    if lacking:
        raise InputError(f"your simulator reads no {', '.join(lacking)}: a diagnosis needs ax, az and q")
    known[:, absent] = 0.0
    return replace(flight, known=known, inadequacy=Inadequacy(SECOND_HAND))


def _accelerations(readings: FloatArray, start: FloatArray, dt: float) -> FloatArray:
    """Specific forces and angular accelerations [rows, 6] of a step from `start` [rows, FREE] to `readings`."""
    turning = (readings[:, _RATES] - start[:, _RATES_FREE]) / dt
    return np.column_stack([readings[:, _FORCES], turning])


def _yours(rollout: Rollout, flight: Reconstruction, start: FloatArray) -> FloatArray:
    """Accelerations [steps, 6] of your simulator, started anew at every sample."""
    told = np.array([fly_yours(rollout, flight, k, start[k], 1)[0] for k in range(len(start))])
    return _accelerations(told, start, flight.dt)


def _ours(flight: Reconstruction, first: NDArray[np.intp], start: FloatArray, downwash: FloatArray) -> FloatArray:
    """Accelerations [rows, 6] of our plant started at samples `first`, with perfect instruments.

    Args:
        start: [rows, FREE].
        downwash: angle of attack that the tail feels, rad [rows].
    """
    row, perfect = flight.parameters.copy(), aircraft.load(instruments="perfect")
    for name, _, _ in SENSOR_PARAMETERS:
        row[name] = perfect[name]
    flown = Predictor(flight, np.repeat(row, len(first)))
    values = {name: start[:, j] for j, name in enumerate(FREE)}
    values |= {name: series[first] for name, series in flight.controls.items()}
    put(flown.fleet, values | {"altitude": flight.altitude[first]})
    flown.fleet.state["alpha_downwash"] = downwash
    return _accelerations(flown.fly(1, first)[0], start, flight.dt)


def _runs(rollout: Rollout, flight: Reconstruction, measured: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Your simulator flown for a second at a time from the measured state.

    Returns:
        Accelerations at every sample [steps, 6], once it has flown WARM s; the angle of attack that our tail would
        feel there, rad [steps]; the states reached there [steps, FREE].
    """
    warm, length = round(WARM / flight.dt), round(RUN / flight.dt)
    steps, tail = len(measured), float(flight.parameters["tail_arm"][0])
    felt, reached, kept = np.full((steps, 6), np.nan), measured.copy(), np.zeros(steps)
    for first in range(0, steps, length - warm):
        begin = max(first - warm, 0)
        count = min(first + length - warm, steps) - begin
        told = fly_yours(rollout, flight, begin, measured[begin], count)
        states = np.vstack([measured[begin], told[:-1, _STATE]])
        states = np.where(np.isfinite(states), states, measured[begin : begin + count])
        late = _late(states[:, _ALPHA], states[:, 0] / tail, flight.dt)
        new = slice(first, begin + count)
        felt[new] = _accelerations(told, states, flight.dt)[first - begin :]
        reached[new], kept[new] = states[first - begin :], late[first - begin :]
    return felt, kept, reached


def _late(alpha: FloatArray, rate: FloatArray, dt: float) -> FloatArray:
    """First-order lag of `alpha` (straight between samples), settled at its start; `rate`: 1 over the lag, 1/s."""
    out = alpha.copy()
    for k in range(len(alpha) - 1):
        behind = (alpha[k + 1] - alpha[k]) / (dt * rate[k])
        out[k + 1] = alpha[k + 1] - behind + (out[k] - alpha[k] + behind) * np.exp(-dt * rate[k])
    return out


def difference(flight: Reconstruction) -> dict[str, float]:
    """RMS of `known`, as coefficients: how far your simulator is from ours."""
    if flight.known is None:
        return {}
    found = as_coefficients(flight.known[1:], flight, flight.channel("airspeed")[1:])
    return {name: float(np.sqrt(np.mean(series**2))) for name, series in found.items()}


def start_of(flight: Reconstruction, first: int) -> FloatArray:
    """State at sample `first` [FREE]: straight lines through the half second that follows."""
    n = max(3, round(BEGIN / flight.dt))
    time = np.arange(n) * flight.dt
    return np.array([np.polyfit(time, flight.channel(name)[first : first + n], 1)[1] for name in FREE])


def fly_yours(rollout: Rollout, flight: Reconstruction, first: int, start: FloatArray, steps: int) -> FloatArray:
    """Your simulator's readings [steps, COMPARED]; nan for channels that it does not have.

    Raises:
        InputError: it fails, or returns readings of another length, or none that is compared.
    """
    span = slice(first, first + steps + 1)
    state = {n: float(v) for n, v in zip(FREE, start, strict=True)} | {"altitude": float(flight.altitude[first])}
    controls = {name: series[span].copy() for name, series in flight.controls.items()}
    for side in ("left", "right"):
        controls[f"thrust_{side}"] = _thrust(flight, side)[span]
    try:
        told = rollout(state, controls, flight.dt, _parameters(flight, first))
    except Exception as problem:
        raise InputError(f"your simulator fails at {flight.time[first]:.1f} s of record '{flight.name}', "
                         f"{type(problem).__name__}: {problem}") from problem  # fmt: skip
    known = [name for name in COMPARED if name in told]
    if not known:
        raise InputError(f"your simulator returns {', '.join(told) or 'nothing'}: expected any of "
                         f"{', '.join(COMPARED)}")
    out = np.full((steps, len(COMPARED)), np.nan)
    for name in known:
        series = np.asarray(told[name], float)
        if series.shape != (steps,) or not np.isfinite(series).all():
            raise InputError(f"your simulator's {name} has shape {series.shape}: expected {steps} finite numbers")
        out[:, COMPARED.index(name)] = series
    return out


def as_coefficients(lacking: FloatArray, flight: Reconstruction, airspeed: FloatArray) -> dict[str, FloatArray]:
    """Specific forces and angular accelerations [M, 6] as coefficients, those that your simulator has."""
    p = flight.parameters[0]
    force = 0.5 * density(float(np.median(flight.altitude))) * airspeed**2 * p["wing_area"]
    inertia = np.array([[p["inertia_xx"], 0.0, -p["inertia_xz"]], [0.0, p["inertia_yy"], 0.0],
                        [-p["inertia_xz"], 0.0, p["inertia_zz"]]])
    moment = lacking[:, 3:] @ inertia.T
    found = {"CX": p["mass"] * lacking[:, 0] / force, "CY": p["mass"] * lacking[:, 1] / force,
             "CZ": p["mass"] * lacking[:, 2] / force, "Cl": moment[:, 0] / (force * p["span"]),
             "Cm": moment[:, 1] / (force * p["chord"]), "Cn": moment[:, 2] / (force * p["span"])}  # fmt: skip
    return {name: series for name, series in found.items() if np.isfinite(series).all()}


def _smooth(values: FloatArray, dt: float) -> FloatArray:
    """Without most of the noise: parabolas over SMOOTH s (Savitzky & Golay, Analytical Chemistry 36, 1964)."""
    width = 2 * max(1, round(0.5 * SMOOTH / dt)) + 1
    return np.asarray(savgol_filter(values, width, 2) if width > 3 else values)


def _parameters(flight: Reconstruction, first: int) -> dict[str, float]:
    p = flight.parameters[0]
    names = ("mass", "inertia_xx", "inertia_yy", "inertia_zz", "inertia_xz", "wing_area", "span", "chord")
    return {n: float(p[n]) for n in names} | {"density": density(float(flight.altitude[first]))}


def _thrust(flight: Reconstruction, side: str) -> FloatArray:
    """Thrust [N] of the power at the recorded airspeed and angle of attack."""
    per_power = thrust_per_power(flight.parameters[0], flight.channel("airspeed"), flight.channel("alpha"))
    return np.asarray(flight.controls[f"power_{side}"] * per_power)
