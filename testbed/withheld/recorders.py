"""Ways to record one and the same flight: slower, on fewer levels, held, with holes, by a clock that jitters, in part.

None of these is a fault: formats and recorders differ so, and what is diagnosed of the aircraft must not.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Channels = dict[str, NDArray[np.float64]]
Recorder = Callable[[Channels, np.random.Generator], Channels]
DEG, FOOT, G0 = np.pi / 180.0, 0.3048, 9.80665
FLOW, ANGLES, RATES, FORCES = ("alpha", "beta"), ("alpha", "beta", "phi", "theta"), ("p", "q", "r"), ("ax", "ay", "az")
SURFACES = ("elevator", "aileron", "rudder")
FAST = ("airspeed", *ANGLES, *RATES, *FORCES, *SURFACES)
JITTER, MISSING, SPIKES = 0.003, 0.03, 0.002  # s; shares of the samples
WANDER, WANDER_TIME = 1.5e-3, 0.3  # rad, s: noise of a vane that is not white


def _every(n: int, *names: str) -> Recorder:
    """Each n-th sample: of the whole record, or of some channels (blank between)."""

    def record(channels: Channels, rng: np.random.Generator) -> Channels:
        if not names:
            return {name: values[::n] for name, values in channels.items()}
        kept = np.arange(len(channels["time"])) % n == 0
        return channels | {name: np.where(kept, channels[name], np.nan) for name in names}

    return record


def _held(n: int, *names: str) -> Recorder:
    """Each n-th sample of some channels, repeated until the next."""

    def record(channels: Channels, rng: np.random.Generator) -> Channels:
        last = np.arange(len(channels["time"])) // n * n
        return channels | {name: channels[name][last] for name in names}

    return record


def _levels(step: float, *names: str) -> Recorder:
    """Channels in whole steps [their unit]."""

    def record(channels: Channels, rng: np.random.Generator) -> Channels:
        return channels | {name: step * np.round(channels[name] / step) for name in names}

    return record


def _coarse_torque(share: float) -> Recorder:
    """Torques in steps of a share of what they mostly are."""

    def record(channels: Channels, rng: np.random.Generator) -> Channels:
        names = ("torque_left", "torque_right")
        step = share * float(np.nanmedian(np.abs(channels[names[0]])))
        return channels | {name: step * np.round(channels[name] / step) for name in names}

    return record


def _without(*begins: str) -> Recorder:
    """No channels whose names begin so."""
    return lambda channels, rng: {name: x for name, x in channels.items() if not name.startswith(begins)}


def _as_drawn(channels: Channels, rng: np.random.Generator) -> Channels:
    return channels


def _jitter(channels: Channels, rng: np.random.Generator) -> Channels:
    """Stamps that stray though samples do not."""
    off = JITTER * rng.uniform(-1.0, 1.0, len(channels["time"]))
    off[0] = 0.0
    return channels | {"time": channels["time"] + off}


def _holes(channels: Channels, rng: np.random.Generator) -> Channels:
    """Rows that are missing here and there."""
    kept = rng.random(len(channels["time"])) > MISSING
    kept[0] = True
    return {name: values[kept] for name, values in channels.items()}


def _spikes(channels: Channels, rng: np.random.Generator) -> Channels:
    """Single samples that are far off, in every fast channel: by thirty times what differs from one to the next."""
    out = dict(channels)
    for name in FAST:
        values = channels[name].copy()
        at = rng.random(len(values)) < SPIKES
        step = float(np.nanmedian(np.abs(np.diff(values))))
        values[at] += 30.0 * step * rng.choice([-1.0, 1.0], int(at.sum()))
        out[name] = values
    return out


def _wander(channels: Channels, rng: np.random.Generator) -> Channels:
    """A vane of alpha whose noise lasts."""
    step = float(np.median(np.diff(channels["time"])))
    keep = np.exp(-step / WANDER_TIME)
    noise = np.zeros(len(channels["time"]))
    drawn = WANDER * np.sqrt(1.0 - keep**2) * rng.standard_normal(len(noise))
    for k in range(1, len(noise)):
        noise[k] = keep * noise[k - 1] + drawn[k]
    return channels | {"alpha": channels["alpha"] + noise}


RECORDERS: dict[str, Recorder] = {
    "as drawn (50 a second)": _as_drawn,
    "25 a second": _every(2),
    "16.7 a second": _every(3),
    "12.5 a second": _every(4),
    "10 a second": _every(5),
    "vanes 10 a second": _every(5, *FLOW),
    "air data 10 a second": _every(5, "airspeed", *FLOW),
    "attitude 10 a second": _every(5, "phi", "theta"),
    "vanes held for 0.1 s": _held(5, *FLOW),
    "attitude held for 0.1 s": _held(5, "phi", "theta"),
    "surfaces held for 0.1 s": _held(5, *SURFACES),
    "altitude in 10 ft": _levels(10.0 * FOOT, "altitude"),
    "altitude in 100 ft": _levels(100.0 * FOOT, "altitude"),
    "airspeed in 1 knot": _levels(0.5144, "airspeed"),
    "angles in 0.25 deg": _levels(0.25 * DEG, *ANGLES),
    "rates in 0.5 deg/s": _levels(0.5 * DEG, *RATES),
    "accelerations in 0.01 g": _levels(0.01 * G0, *FORCES),
    "surfaces in 0.1 deg": _levels(0.1 * DEG, *SURFACES),
    "surfaces in 0.5 deg": _levels(0.5 * DEG, *SURFACES),
    "torque in 1 %": _coarse_torque(0.01),
    "torque in 4 %": _coarse_torque(0.04),
    "stamps stray by 3 ms": _jitter,
    "3 % of rows missing": _holes,
    "0.2 % of samples far off": _spikes,
    "vane wanders by 1.5 mrad over 0.3 s": _wander,
    "no commands": _without("elevator_c", "aileron_c", "rudder_c"),
    "no torque and speed": _without("torque", "rpm"),
    "no engines": _without("torque", "rpm", "thrust"),
    "no beta": _without("beta"),
    "no altitude": _without("altitude", "pressure"),
    "no ax": _without("ax"),
}
