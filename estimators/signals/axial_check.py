"""The axial acceleration against airspeed, gravity and the lift that alpha tilts forward: sign, unit, lateness.

u' = r v - q w - g sin(theta) + k ax (Klein & Morelli, Aircraft System Identification, AIAA 2006, section 3.3). Summed
up from the start, airspeed less the other terms is k times the sum of ax, beside: a constant, a slope (biases of
accelerometer and attitude, 0.1 m/s2 beforehand), gusts along x (first-order with the time constant L/V of Dryden's
u gust, strength as is most likely) and noise. Generalised least squares gives k with its standard error. In steady
flight the mean of ax must be g sin(theta): that is the constant slope of the same equation. k is 1 in a sound record,
-1 with the sign reversed, g where ax was recorded in g.

Axial force CX = CL sin(alpha) - CD cos(alpha) with CD = CD_0 + K CL^2 changes with alpha at CL (1 - 2 K CL_alpha) and a
little more at a large alpha: by 0 to 1 of the lift while the flow is attached, 0.46 to 0.85 in recorded and simulated
flights, clean and iced, down to -0.1 as the wing stalls. With the sign reversed that is -0.6 and less, in ft/s2 1.7 and
more; in g it lies between -1.2 and 0.2 and cannot be told from a stalling wing.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from estimators.regression.least_squares import least_squares
from estimators.signals.gust_level import LENGTH
from estimators.signals.resample import Grid
from icing_env.atmosphere import G0
from icing_env.errors import InputError
from icing_env.record import FloatArray

NEEDED = ("airspeed", "ax", "theta", "alpha")
BLOCK = 0.5  # s: means over this long are compared
LONGEST = 240  # blocks
BIAS = 0.1  # m/s2 beforehand: 0.01 g, or 0.6 deg of attitude (assumed)
LEVEL = 10.0  # m/s: the constant is free
LAG = 0.2  # m/s: airspeed's error of position and lag, at least (recorded flights: 0.05 to 0.2)
LINE = 0.05  # m/s: the same, where the lag is what is sought
GUSTS = (0.0, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)  # m/s
FACTORS = {"has its sign reversed": -1.0, "looks like g": G0, "looks like ft/s2": 0.3048}
REVERSED, SOUND, FEET = -0.4, 0.35, 1.5  # bounds of the change of axial force with alpha, of the lift
CLEAR = 2.0  # standard errors beyond a bound
MOVED, FEWEST = 0.005, 20  # rad rms of alpha, samples
ATTACHED, STEEP = 0.8, 5.0  # R2 of lift on alpha, and its growth of itself per rad, in attached flow
MODEL = 0.15  # of the factor itself: what the equation leaves out (assumed)
SURE, ENOUGH = 30.0, 9.0  # chi squared by which one factor must beat another to refuse, and to be called checked


def check_ax(where: str, grid: Grid) -> bool:
    """Whether the record confirms the sign and the unit of ax.

    Args:
        where: begins the message.
        grid: the record's channels.

    Raises:
        InputError: another sign or unit explains airspeed or lift far better.
    """
    if "ax" not in grid.values:
        return False
    tilted = _check_tilt(where, grid)
    if not all(name in grid.values for name in NEEDED) or not grid.good(NEEDED).all():
        return tilted
    k, error = factor(grid)
    near = {"right": 1.0, **FACTORS}.items()
    chi = {what: (k - h) ** 2 / (error**2 + (MODEL * h) ** 2) for what, h in near}
    best = min(chi, key=chi.__getitem__)
    if not tilted and chi[best] < ENOUGH and chi["right"] - chi[best] > SURE:
        raise InputError(f"{where}: column 'ax' {best}: airspeed and gravity need {k:.2g} +- {error:.2g} of it")
    return tilted or (best == "right" and all(x - chi["right"] > ENOUGH for what, x in chi.items() if what != "right"))


def _check_tilt(where: str, grid: Grid) -> bool:
    """Whether ax grows with alpha as lift makes it; refuses where it cannot be."""
    share, error = tilt(grid)
    for wrong, beyond in (("has its sign reversed", REVERSED - share), ("looks like ft/s2", share - FEET)):
        if beyond > CLEAR * error:
            raise InputError(f"{where}: column 'ax' {wrong}: it changes with alpha by {share:.2g} +- {error:.2g} of "
                             "az; lift makes that 0 to 1")  # fmt: skip
    return SOUND + CLEAR * error < share < FEET - CLEAR * error


def tilt(grid: Grid) -> tuple[float, float]:
    """Change of the axial force per rad, over the lift, and its standard error; (0, inf) where it does not show."""
    names = ("ax", "az", "alpha", "airspeed")
    if not all(name in grid.values for name in names):
        return 0.0, np.inf
    good, v = grid.good(names), grid.values
    if good.sum() < FEWEST or np.std(v["alpha"][good]) < MOVED:
        return 0.0, np.inf
    pressure = v["airspeed"][good] ** 2
    alpha = np.column_stack([v["alpha"][good], np.ones(int(good.sum())), np.mean(pressure) / pressure])  # last: thrust
    axial = least_squares(alpha, v["ax"][good] / pressure, fade=True)
    normal = least_squares(alpha, -v["az"][good] / pressure, fade=True)
    lift = float(np.mean(-v["az"][good] / pressure))
    if normal.r2 < ATTACHED or normal.theta[0] < STEEP * lift:
        return 0.0, np.inf
    return float(axial.theta[0]) / lift, float(axial.std_error[0]) / lift


def factor(grid: Grid) -> tuple[float, float]:
    """The factor k that ax needs to give the airspeed, and its standard error.

    (1, inf) where the aircraft turns and slips so much that an error of beta counts as much as one of ax: the recorded
    rudder doublet (r v of 0.27 m/s2 rms) would else have its sign doubted.
    """
    zero, v = np.zeros(len(grid.time)), grid.values
    beta = v.get("beta", zero)
    speed = v["airspeed"]
    u = speed * np.cos(v["alpha"]) * np.cos(beta)
    w, lateral = speed * np.sin(v["alpha"]) * np.cos(beta), speed * np.sin(beta)
    turning = v.get("r", zero) * lateral
    if float(np.std(turning)) > BIAS:
        return 1.0, np.inf
    rest = turning - v.get("q", zero) * w - G0 * np.sin(v["theta"])
    return _summed(grid, u, rest, np.cumsum(v["ax"]) * grid.dt, LAG)


def lateness(grid: Grid) -> tuple[float, float]:
    """By how much airspeed trails what accelerations and gravity make of it, s, and its standard error.

    (0, inf) where a channel for it is missing. Summed up from the start, the rate of airspeed is airspeed but for the
    same as in `factor`; and airspeed that is late by T lacks T times its rate.
    """
    names = ("airspeed", "ax", "ay", "az", "alpha", "beta", "phi", "theta")
    if not all(name in grid.values for name in names) or not grid.good(names).all():
        return 0.0, np.inf
    ax, ay, az, alpha, beta, phi, theta = (grid.values[name] for name in names[1:])
    along = (ax - G0 * np.sin(theta)) * np.cos(alpha) + (az + G0 * np.cos(theta) * np.cos(phi)) * np.sin(alpha)
    rate = along * np.cos(beta) + (ay + G0 * np.cos(theta) * np.sin(phi)) * np.sin(beta)
    return _summed(grid, grid.values["airspeed"], rate, -rate, LINE)


def _summed(grid: Grid, speed: FloatArray, rate: FloatArray, felt: FloatArray, least: float) -> tuple[float, float]:
    """The factor of `felt` that a speed has beside the sum of a rate, each (N,), and its standard error.

    Args:
        least: of the speed's own error, m/s.
    """
    steps = max(1, round(BLOCK / grid.dt), len(speed) // LONGEST)
    noise = (np.median(np.abs(np.diff(speed, 2))) / 0.6745) ** 2 / 6.0 / steps + least**2
    beside = _blocks(speed - speed[0] - np.cumsum(rate) * grid.dt, steps)
    return _weighted(beside, _blocks(felt, steps), *_unknown(grid, steps, float(noise)))


def _unknown(grid: Grid, steps: int, noise: float) -> tuple[FloatArray, FloatArray]:
    """Covariance of what is not known beside a sum of accelerations in blocks but for gusts, and gusts' correlation."""
    t = _blocks(grid.time - grid.time[0], steps)
    known = noise * np.eye(len(t)) + BIAS**2 * np.outer(t, t) + LEVEL**2
    return known, np.exp(-np.abs(t[:, None] - t[None, :]) * float(np.mean(grid.values["airspeed"])) / LENGTH)


def _weighted(beside: FloatArray, felt: FloatArray, known: FloatArray, gust: FloatArray) -> tuple[float, float]:
    """Generalised least squares of one factor, with the gusts that are most likely beside it.

    Args:
        beside: what the factor times `felt` should be (N,), with the covariance `known` (N, N) but for gusts.
        felt: as above.
        known: as above.
        gust: (N, N) correlation of gusts.
    """
    best, result = -np.inf, (1.0, np.inf)
    for sigma in GUSTS:
        root = cho_factor(known + sigma**2 * gust, lower=True)
        weighted = cho_solve(root, felt)
        information = max(float(felt @ weighted), 1e-12)
        k = float(weighted @ beside) / information
        left = beside - k * felt
        likelihood = -0.5 * float(left @ cho_solve(root, left)) - float(np.sum(np.log(np.diag(root[0]))))
        if likelihood > best:
            best, result = likelihood, (k, information**-0.5)
    return result


def _blocks(signal: FloatArray, steps: int) -> FloatArray:
    """Means over `steps` samples, shape (N // steps,)."""
    return np.asarray(signal[: len(signal) // steps * steps].reshape(-1, steps).mean(axis=1))
