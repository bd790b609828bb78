"""Reversed signs and wrong units that the motion itself contradicts: named, and the record refused.

An angle changes as the rates make it, airspeed as accelerations and gravity make it (Klein & Morelli, Aircraft System
Identification, AIAA 2006, section 3.3), with a factor of 1; a reversed channel makes it -1, a wrong unit the ratio of
the units. Thresholds are assumed; gusts and noise leave sound records untouched.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimators.signals.consistency import FEWEST, line
from estimators.signals.differentiate import half_width, slope, smooth
from estimators.signals.flow_checks import REACH, check_flow
from estimators.signals.resample import Grid
from icing_env.atmosphere import G0
from icing_env.errors import InputError
from icing_env.record import FloatArray

DRIFT = 2.0  # m/s by which the axial acceleration must miss the airspeed before it is doubted
LONGEST = 120.0  # s over which accelerations can be summed up: a small bias strays far over more


def check_kinematics(grid: Grid, where: str) -> None:
    """Refuse a record whose channels contradict each other; `where` begins the message.

    Raises:
        InputError: names the channel and what it looks like.
    """
    zero = np.zeros(len(grid.time))
    v = {name: grid.values.get(name, zero) for name in ("phi", "theta", "p", "q", "r")}
    has = grid.values.__contains__
    half = half_width(grid.dt)
    if has("theta") and has("q"):
        expected = smooth(v["q"] * np.cos(v["phi"]) - v["r"] * np.sin(v["phi"]), half)
        _judge(where, "q", "theta", slope(v["theta"], grid.dt, half), expected, grid.good(("theta", "q")))
    if has("phi") and has("p"):
        turn = np.tan(v["theta"]) * (v["q"] * np.sin(v["phi"]) + v["r"] * np.cos(v["phi"]))
        expected = smooth(v["p"] + turn, half)
        _judge(where, "p", "phi", slope(v["phi"], grid.dt, half), expected, grid.good(("phi", "p")))
    if has("psi") and has("r"):
        turn = (v["q"] * np.sin(v["phi"]) + v["r"] * np.cos(v["phi"])) / np.cos(v["theta"])
        reach = round(REACH / grid.dt)  # a directional gyro is coarse
        change = slope(np.unwrap(grid.values["psi"]), grid.dt, reach)
        _judge(where, "r", "psi", change, smooth(turn, reach), grid.good(("psi", "r")))
    check_flow(where, grid, v)
    _check_ax(where, grid, v)


def _check_ax(where: str, grid: Grid, v: Mapping[str, FloatArray]) -> None:
    """u' = r v - q w - g sin(theta) + ax: doubt ax if its opposite, or g times it, gives the airspeed far better."""
    names = ("airspeed", "ax", "theta", "alpha")
    if not all(name in grid.values for name in names) or not grid.good(names).all():
        return
    if grid.time[-1] - grid.time[0] > LONGEST:
        return
    speed = grid.values["airspeed"]
    w, lateral = speed * np.sin(grid.values["alpha"]), speed * np.sin(grid.values.get("beta", np.zeros(len(speed))))
    rest = v["r"] * lateral - v["q"] * w - G0 * np.sin(v["theta"])
    flown = {
        kind: float(np.std(speed - np.cumsum(rest + factor * grid.values["ax"]) * grid.dt))
        for kind, factor in (("right", 1.0), ("has its sign reversed", -1.0), ("looks like g", G0))
    }
    best = min(flown, key=flown.__getitem__)
    if flown["right"] > DRIFT and flown[best] < 0.2 * flown["right"]:
        raise InputError(f"{where}: column 'ax' {best}: with it, airspeed would stray by {flown['right']:.1f} m/s rms")


def _judge(
    where: str, rate: str, angle: str, change: FloatArray, expected: FloatArray, good: NDArray[np.bool_]
) -> None:
    """Compare the change of an angle with the rate that should make it (rad/s, each (N,))."""
    rows = good & np.isfinite(change) & np.isfinite(expected)
    if rows.sum() < FEWEST or max(np.std(change[rows]), np.std(expected[rows])) < 0.005:
        return
    gain, match = line(expected[rows], change[rows])
    if match < -0.7:
        raise InputError(
            f"{where}: '{rate}' (or '{angle}') has its sign reversed: {angle} changes at {gain:.2f} {rate}"
        )
    if match > 0.7 and not 0.2 < gain < 5.0:
        raise InputError(f"{where}: '{angle}' and '{rate}' are not both in rad: {angle} changes at {gain:.3g} {rate}")
