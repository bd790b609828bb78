"""How strong the gusts in a record were: what the flow angles read beside the motion, and a warning that follows.

V alpha less the integral of q V - p V beta + az + g cos(theta) cos(phi) is the vertical gust (with its sign turned)
beside noise, and beside the drift that biases make; V beta likewise. Noise shows from one sample to the next, gusts
over a second. The mean square change of a Dryden gust over tau, of time constant T = L / V, is 2 sigma^2 (1 - rho) with
rho = exp(-tau / T) (1 - tau / 2T) (the transform of MIL-F-8785C's spectrum), so that the difference of the two gives
sigma. A cubic is taken out for the drift, and the motion itself for a scale error of the vane.
"""

from __future__ import annotations

import numpy as np

from estimators.signals.resample import Grid
from icing_env.atmosphere import G0
from icing_env.record import FloatArray

LENGTH = 533.4  # m: 1750 ft, MIL-F-8785C above 2000 ft; height above ground is not in a record
LAG = 1.0  # s over which gusts change and the drift of gyros does not show
SMOOTHEST = 0.35  # m/s up to which nothing is said: boom and vane lag look like 0.1
LONGITUDINAL, LATERAL = ("airspeed", "alpha", "q", "theta", "az"), ("airspeed", "beta", "p", "r", "phi", "ay")


def gust_level(grid: Grid) -> dict[str, float]:
    """Standard deviation of the vertical ("w") and lateral ("v") gusts, m/s, where the channels for it are there."""
    found = {}
    for axis, needed in (("w", LONGITUDINAL), ("v", LATERAL)):
        if all(name in grid.values for name in needed) and grid.time[-1] - grid.time[0] > 4.0 * LAG:
            found[axis] = _level(*_flow(grid, axis), grid)
    return found


def turbulence_warnings(grid: Grid, method: str) -> dict[str, str]:
    """By axis of motion a sentence, where gusts were strong enough to bias what `method` finds in it."""
    axes = {"w": "longitudinal", "v": "lateral"}
    return {
        axes[axis]: f"turbulence of about {sigma:.1f} m/s: {method} does not know gusts, its {axes[axis]} derivatives "
        "may be biased by more than their standard errors"
        for axis, sigma in gust_level(grid).items() if sigma > SMOOTHEST
    }  # fmt: skip


def _flow(grid: Grid, axis: str) -> tuple[FloatArray, FloatArray]:
    """V alpha or V beta as read (N,), and as the motion makes it but for a drift (N,), m/s."""
    v, zero = grid.values, np.zeros(len(grid.time))
    phi, theta = v.get("phi", zero), v.get("theta", zero)
    speed = v["airspeed"]
    if axis == "w":
        roll = v.get("p", zero) * v.get("beta", zero) * speed
        angle, rate = v["alpha"], v["q"] * speed - roll + v["az"] + G0 * np.cos(theta) * np.cos(phi)
    else:
        roll = v["p"] * v.get("alpha", zero) * speed
        angle, rate = v["beta"], roll - v["r"] * speed + v["ay"] + G0 * np.cos(theta) * np.sin(phi)
    moved = np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])) * grid.dt))
    return speed * angle, moved


def _level(read: FloatArray, moved: FloatArray, grid: Grid) -> float:
    """Sigma (m/s) of the Dryden gust in what was read, beside a cubic drift and a scale error of the motion."""
    t = np.linspace(-1.0, 1.0, len(read))
    known = np.column_stack([np.ones_like(t), t, t**2, t**3, moved])
    beside = read - moved
    r = beside - known @ np.linalg.lstsq(known, beside, rcond=None)[0]
    steps = max(2, round(LAG / grid.dt))
    change = 0.5 * (np.mean((r[steps:] - r[:-steps]) ** 2) - np.mean(np.diff(r) ** 2))
    share = steps * grid.dt * float(np.mean(grid.values["airspeed"])) / LENGTH
    return float(np.sqrt(max(change, 0.0) / (1.0 - np.exp(-share) * (1.0 - 0.5 * share))))
