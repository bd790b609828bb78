"""What the instruments of docs/model.md section 15 make of a flown trajectory, and how they may be wrong.

Whole time series through SciPy's filters; the recording's low pass is part of the description, not of the plant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter, lfilter_zi

from testbed.withheld import plant as pl
from testbed.withheld.published import PUBLISHED

FAST = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "psi", "ax", "ay", "az",
        "elevator", "aileron", "rudder")  # fmt: skip
SLOW = ("altitude", "thrust_left", "thrust_right", "torque_left", "torque_right", "rpm_left", "rpm_right", "pressure",
        "temperature")  # fmt: skip
SLOW_EVERY = 5  # samples: 10 Hz
TORQUE_NOISE = 3.0  # N m, assumed
G0, R_AIR = 9.80665, 287.05287


def noise_sizes() -> dict[str, float]:
    """Standard deviation of each channel at noise level 1."""
    out = {name: PUBLISHED[f"noise_{name}"] for name in FAST}
    out |= {"thrust_left": PUBLISHED["noise_thrust"], "thrust_right": PUBLISHED["noise_thrust"],
            "torque_left": TORQUE_NOISE, "torque_right": TORQUE_NOISE, "pressure": PUBLISHED["noise_pressure"],
            "temperature": PUBLISHED["noise_temperature"]}  # fmt: skip
    return out


def low(x: NDArray, gain: float) -> NDArray:
    """First-order low pass `y += gain (x - y)` sample by sample, settled at the first."""
    out, _ = lfilter([gain], [1.0, gain - 1.0], x, zi=np.array([(1.0 - gain) * x[0]]))
    return np.asarray(out)


def gain(lag: float) -> float:
    """Gain of a lag of `lag` seconds at the sample interval."""
    return 1.0 - math.exp(-pl.DT / lag) if lag > 0.0 else 1.0


def oscillator(x: NDArray, hertz: float, damping: float) -> NDArray:
    """Response of a second-order mode to `x` (static gain 1), bilinear with the frequency kept, settled."""
    w = 2.0 * math.pi * hertz
    k = w / math.tan(w * pl.DT / 2.0)
    b = np.array([w * w, 2.0 * w * w, w * w])
    a = np.array([k * k + 2.0 * damping * w * k + w * w, 2.0 * (w * w - k * k), k * k - 2.0 * damping * w * k + w * w])
    out, _ = lfilter(b / a[0], a / a[0], x, zi=lfilter_zi(b / a[0], a / a[0]) * x[0])
    return np.asarray(out)


def geopotential_pressure(altitude: NDArray) -> NDArray:
    """Standard pressure [Pa] below 11 km."""
    h = 6356766.0 * altitude / (6356766.0 + altitude)
    return np.asarray(101325.0 * ((288.15 - 0.0065 * h) / 288.15) ** (G0 / (R_AIR * 0.0065)))


def altitude_of(pressure: NDArray) -> NDArray:
    """Altitude [m] of a standard pressure, as an altimeter shows it."""
    h = 288.15 / 0.0065 * (1.0 - (pressure / 101325.0) ** (R_AIR * 0.0065 / G0))
    return np.asarray(6356766.0 * h / (6356766.0 - h))


def vanes(Y: NDArray, seen: NDArray, s: Mapping[str, float]) -> tuple[NDArray, NDArray]:
    """Angle of attack and sideslip as the recorder gets them, errors of vane and boom in."""
    n = PUBLISHED
    offset = s.get("vane_error", 0.0) / np.maximum(seen[:, pl.VT], 1.0)
    aside = s.get("vane_aside", 0.0) / np.maximum(seen[:, pl.VT], 1.0)
    alpha = seen[:, pl.ALPHA] + offset * Y[:, pl.Q] + aside * Y[:, pl.P]
    beta = seen[:, pl.BETA] - (offset + s.get("vane_cross", 0.0) / np.maximum(seen[:, pl.VT], 1.0)) * Y[:, pl.R]
    lag = n["vane_lag"] + s.get("vane_extra", 0.0)
    alpha, beta = low(alpha, gain(lag)), low(beta, gain(lag))
    if s.get("vane_second"):
        hertz = 0.7 * 2.0 / (2.0 * math.pi * s["vane_second"])  # delay 2 zeta/w
        alpha, beta = oscillator(alpha, hertz, 0.7), oscillator(beta, hertz, 0.7)
    alpha = sticking(alpha + _upwash(Y, seen, s.get("power_alpha", 0.0)), s.get("stuck_alpha", 0.0))
    beta = (1.0 + s.get("scale_beta", 0.0)) * beta + _upwash(Y, seen, s.get("power_beta", 0.0))
    shaken = seen[:, pl.FZ] + n["gravity_sea_level"]
    boom = (n["boom_gain"] + s.get("boom_extra", 0.0)) * oscillator(shaken, n["boom_frequency"], n["boom_damping"])
    if s.get("boom_other"):
        boom = boom + s["boom_other"] * oscillator(shaken, 6.4, 0.06)
    recorder = 1.0 - math.exp(-2.0 * math.pi * n["filter_frequency"] * pl.DT)
    return low(alpha + boom, recorder), low(beta, recorder)


def sticking(x: NDArray, grip: float) -> NDArray:
    """What an instrument shows that does not move before its input has by `grip`, and then follows it."""
    out = x.copy()
    for k in range(1, len(x) if grip > 0.0 else 0):
        out[k] = x[k] if abs(x[k] - out[k - 1]) > grip else out[k - 1]
    return out


def _upwash(Y: NDArray, seen: NDArray, size: float) -> NDArray | float:
    """Angle at a vane that goes with the thrust coefficient."""
    if size == 0.0:
        return 0.0
    ct = (seen[:, pl.TL] + seen[:, pl.TR]) / (_dynamic(Y, seen) * PUBLISHED["wing_area"])
    return np.asarray(size * (ct - PUBLISHED["CT_reference"]))


def _dynamic(Y: NDArray, seen: NDArray) -> NDArray:
    """Dynamic pressure, Pa."""
    density = geopotential_pressure(Y[:, pl.H]) / (R_AIR * (288.15 - 0.0065 * Y[:, pl.H]))
    return np.asarray(0.5 * density * seen[:, pl.VT] ** 2)


def exact(Y: NDArray, seen: NDArray, s: Mapping[str, float], start: float = 0.0) -> dict[str, NDArray]:
    """Every channel of FAST and SLOW, samples from `start` s on, without noise, instruments wrong as `s` says."""
    recorder = 1.0 - math.exp(-2.0 * math.pi * PUBLISHED["filter_frequency"] * pl.DT)
    t = start + np.arange(len(Y)) * pl.DT
    speed = seen[:, pl.VT] * (1.0 + s.get("airspeed_alpha", 0.0) * seen[:, pl.ALPHA])
    speed = speed * (1.0 - s.get("sideslip_airspeed", 0.0) * seen[:, pl.BETA] ** 2)
    speed = speed * np.sqrt(1.0 - s.get("static_alpha", 0.0) * seen[:, pl.ALPHA])
    speed = np.sqrt(np.maximum(speed**2 + 2.0 * s.get("pressure_airspeed", 0.0) * 72.0**2, 1.0))
    speed = speed * (1.0 + s.get("pitot_water", 0.0) * np.exp(-(((t - 18.0) / 1.5) ** 2)))
    c = {"airspeed": (1.0 + s.get("scale_airspeed", 0.0)) * low(speed, gain(PUBLISHED["pitot_lag"]))}
    c["alpha"], c["beta"] = vanes(Y, seen, s)
    c["alpha"] = c["alpha"] * (1.0 + s.get("scale_alpha", 0.0)) + s.get("scale_alpha2", 0.0) * c["alpha"] ** 2 / 0.06
    raw = {"p": Y[:, pl.P], "q": Y[:, pl.Q], "r": Y[:, pl.R],
           "ax": seen[:, pl.FX], "ay": seen[:, pl.FY], "az": seen[:, pl.FZ], "elevator": Y[:, pl.DE],
           "aileron": Y[:, pl.DA], "rudder": Y[:, pl.DR]}  # fmt: skip
    if s.get("flexible_az"):
        raw["az"] = raw["az"] + s["flexible_az"] * (oscillator(raw["az"], 3.2, 0.08) - raw["az"])
    raw["az"] = raw["az"] + s.get("square_az", 0.0) * (raw["az"] + G0) ** 2
    raw["az"] = raw["az"] + s.get("arm_az", 0.0) * np.gradient(Y[:, pl.Q], pl.DT)
    raw["r"] = low(raw["r"], gain(s.get("lag_r", 0.0)))
    raw["ax"], raw["az"] = (raw["ax"] + s.get("tilt", 0.0) * raw["az"], raw["az"] - s.get("tilt", 0.0) * raw["ax"])
    raw["p"] = (1.0 + s.get("scale_p", 0.0)) * raw["p"] + s.get("warm_p", 0.0) * (1.0 - np.exp(-t / 12.0))
    raw["q"] = raw["q"] + s.get("gyro_g", 0.0) * (raw["az"] + G0) + s.get("gyro_cross", 0.0) * Y[:, pl.P]
    c |= {name: low(x, recorder) for name, x in raw.items()}
    c |= {"phi": (1.0 + s.get("scale_phi", 0.0)) * Y[:, pl.PHI],
          "theta": sticking(Y[:, pl.THETA], s.get("stuck_theta", 0.0)) + s.get("attitude_cross", 0.0) * Y[:, pl.PHI]
          + s.get("square_phi", 0.0) * Y[:, pl.PHI] ** 2,
          "psi": Y[:, pl.PSI]}  # fmt: skip
    for name in ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az"):
        wander = s.get(f"wander_{name}", 0.0)
        c[name] = c[name] + s.get(f"bias_{name}", 0.0) + wander * (1.0 + 0.15 * np.sin(2.0 * math.pi * t / 55.0))
    c |= {"thrust_left": seen[:, pl.TL], "thrust_right": seen[:, pl.TR], "pressure": geopotential_pressure(Y[:, pl.H])}
    c["pressure"] = c["pressure"] + s.get("static_alpha", 0.0) * seen[:, pl.ALPHA] * _dynamic(Y, seen)
    c["pressure"] = low(c["pressure"], gain(s.get("static_lag", 0.0)))
    rpm = PUBLISHED["propeller_rpm"]
    c |= {f"torque_{side}": Y[:, column] * 30.0 / (math.pi * rpm) for side, column in
          (("left", pl.PL), ("right", pl.PR))}  # fmt: skip
    c |= {"rpm_left": np.full(len(Y), rpm), "rpm_right": np.full(len(Y), rpm),
          "temperature": 288.15 - 0.0065 * 6356766.0 * Y[:, pl.H] / (6356766.0 + Y[:, pl.H])}  # fmt: skip
    c["altitude"] = altitude_of(c["pressure"])
    return c


def read(channels: Mapping[str, NDArray], level: float, rng: np.random.Generator) -> dict[str, NDArray]:
    """The channels with noise `level` times the published one; the altitude follows the noisy pressure."""
    sizes = noise_sizes()
    out = {name: x + level * sizes[name] * rng.standard_normal(len(x)) if name in sizes else x.copy()
           for name, x in channels.items()}
    out["altitude"] = altitude_of(out["pressure"])
    return out
