"""Instruments: from the log to the channels a recorder sees, first free of noise, then sampled, noisy and rounded.

Accelerometers, gyros, vanes and surface pots go through one second-order Butterworth anti-alias filter; the pitot line
adds a lag; attitude comes from an INS with a latency. Flow angles are measured on a nose boom and corrected to the
c.g. for the rates (taken as exact), but the vanes meet a gust before the c.g. does.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter

from testbed.elsewhere.hooks import Channels
from testbed.elsewhere.propulsion import RPM
from testbed.elsewhere.rigid_body import cross, euler, rotation

BOOM = 5.6  # m, vanes ahead of the c.g.
PITOT_LAG = 0.08  # s
INS_LATENCY = 0.02  # s
ENGINE_FILTER = 0.15  # s
DEG = np.pi / 180.0
NOISE = {"airspeed": 0.15, "alpha": 0.08 * DEG, "beta": 0.10 * DEG, "p": 0.12 * DEG, "q": 0.08 * DEG, "r": 0.08 * DEG,
         "phi": 0.06 * DEG, "theta": 0.06 * DEG, "psi": 0.08 * DEG, "ax": 0.03, "ay": 0.04, "az": 0.06,
         "elevator": 0.03 * DEG, "aileron": 0.04 * DEG, "rudder": 0.03 * DEG, "elevator_command": 0.01 * DEG,
         "aileron_command": 0.01 * DEG, "rudder_command": 0.01 * DEG, "throttle_left": 0.002, "throttle_right": 0.002,
         "thrust_left": 15.0, "thrust_right": 15.0, "torque_left": 8.0, "torque_right": 8.0, "rpm_left": 2.0,
         "rpm_right": 2.0, "altitude": 0.6, "temperature": 0.15, "pressure": 12.0, "ground_speed": 0.08,
         "track": 0.08 * DEG}
BIAS = {"airspeed": 0.15, "alpha": 0.08 * DEG, "beta": 0.08 * DEG, "p": 0.02 * DEG, "q": 0.02 * DEG, "r": 0.02 * DEG,
        "phi": 0.08 * DEG, "theta": 0.08 * DEG, "ax": 0.012, "ay": 0.015, "az": 0.02, "elevator": 0.04 * DEG,
        "aileron": 0.06 * DEG, "rudder": 0.04 * DEG, "altitude": 3.0, "temperature": 0.3}
FILTERED = ("alpha", "beta", "p", "q", "r", "ax", "ay", "az", "elevator", "aileron", "rudder")


def lag(signal: NDArray, time_constant: float, dt: float) -> NDArray:
    """First-order lag along the last axis, settled at the start."""
    pole = np.exp(-dt / time_constant)
    return np.asarray(lfilter([1 - pole], [1, -pole], signal, axis=-1, zi=pole * signal[..., :1])[0])


def late(signal: NDArray, delay: float, dt: float) -> NDArray:
    """The signal `delay` s earlier (may be a fraction of a step), linear in between, along the last axis."""
    at = np.clip(np.arange(signal.shape[-1]) - delay / dt, 0, signal.shape[-1] - 1)
    low = np.floor(at).astype(int)
    high = np.minimum(low + 1, signal.shape[-1] - 1)
    return np.asarray(signal[..., low] + (signal[..., high] - signal[..., low]) * (at - low))


def _vanes(log: Channels, gust: NDArray, speed: NDArray, dt: float) -> tuple[NDArray, NDArray]:
    """Flow angles with the gust taken where the boom is, `gust` (n, 6, steps)."""
    air = log["air"].copy()
    for i, v in enumerate(speed):
        ahead = late(gust[i, :3], -BOOM / v, dt)
        air[:, i] += gust[i, :3] - ahead
    norm = np.sqrt((air**2).sum(0))
    return np.arctan2(air[2], air[0]), np.arcsin(air[1] / norm)


def read(log: Channels, columns: slice, gust: NDArray, speed: NDArray, filter_hz: float, dt: float) -> Channels:
    """Noise-free channels, name -> (n, steps), of the flights in `columns` (a slice), filters and lags included."""
    cut = {k: v[..., columns, :] for k, v in log.items()}
    x = cut["x"]
    arm = -cut["cg_move"]
    accel = cut["specific"] + cross(cut["turn"], arm) + cross(cut["rates"], cross(cut["rates"], arm))
    phi, theta, psi = euler(x[6:10])
    north, east, _ = np.einsum("ij...,j...->i...", rotation(x[6:10]), x[:3])
    alpha, beta = _vanes(cut, gust, speed, dt)
    s = {"airspeed": lag(cut["speed"], PITOT_LAG, dt), "alpha": alpha, "beta": beta}
    s |= dict(zip(("p", "q", "r"), cut["rates"], strict=True)) | dict(zip(("ax", "ay", "az"), accel, strict=True))
    s |= {k: late(v, INS_LATENCY, dt) for k, v in (("phi", phi), ("theta", theta), ("psi", np.unwrap(psi)))}
    for i, name in enumerate(("elevator", "aileron", "rudder")):
        s[name], s[name + "_command"] = cut["position"][i], cut["command"][i]
    for i, side in enumerate(("left", "right")):
        s["throttle_" + side] = cut["throttle"][i]
        s["thrust_" + side] = lag(cut["deck"][i], ENGINE_FILTER, dt)
        s["torque_" + side] = lag(cut["power"][i] / (RPM * np.pi / 30), ENGINE_FILTER, dt)
        s["rpm_" + side] = np.full_like(alpha, RPM)
    s |= {"altitude": -x[12], "temperature": cut["temperature"], "pressure": cut["pressure"]}
    s |= {"ground_speed": np.hypot(north, east), "track": np.unwrap(np.arctan2(east, north))}
    top, bottom = butter(2, filter_hz, fs=1 / dt)
    for name in FILTERED:
        level = s[name][..., :1]
        s[name] = level + lfilter(top, bottom, s[name] - level, axis=-1)
    return s


def imperfections(rng: np.random.Generator) -> dict[str, Any]:
    """One instrument set: bias and scale error by channel, noise factor; the same through all flights of a case."""
    bias = {k: v * float(np.clip(rng.standard_normal(), -2, 2)) for k, v in BIAS.items()}
    scale = {k: 1 + 0.004 * float(np.clip(rng.standard_normal(), -2, 2)) for k in ("alpha", "beta", "p", "q", "r")}
    return {"bias": bias, "scale": scale, "noise": float(rng.uniform(0.7, 1.4))}


def sample(channels: Channels, record: int, pick: NDArray, faults: Mapping[str, Any],
           rng: np.random.Generator) -> Channels:
    """Noisy, rounded samples of one record: name -> values at the indices `pick`."""
    out = {}
    for name, values in channels.items():
        sigma = NOISE[name] * faults["noise"]
        clean = values[record, pick] * faults["scale"].get(name, 1.0) + faults["bias"].get(name, 0.0)
        step = NOISE[name] / 3
        out[name] = np.round((clean + sigma * rng.standard_normal(clean.size)) / step) * step
    for name in ("throttle_left", "throttle_right"):
        out[name] = np.clip(out[name], 0.0, 1.0)
    return out
