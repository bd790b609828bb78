"""Reversed signs and wrong units that the motion itself contradicts: named, and the record refused.

An angle changes as the rates make it, airspeed as accelerations and gravity make it (Klein & Morelli, Aircraft System
Identification, AIAA 2006, section 3.3), with a factor of 1; a reversed channel makes it -1, a wrong unit the ratio of
the units, and a late one follows best when shifted back. Thresholds are assumed; gusts and noise leave sound records
untouched.
"""

from __future__ import annotations

import numpy as np

from estimators.signals.axial_check import check_ax
from estimators.signals.consistency import FEWEST, line
from estimators.signals.differentiate import half_width, slope, smooth
from estimators.signals.flow_checks import REACH, check_flow
from estimators.signals.late_checks import check_forces, check_late, check_pair
from estimators.signals.resample import Grid
from icing_env.errors import InputError
from icing_env.record import FloatArray


def check_kinematics(grid: Grid, where: str) -> set[str]:
    """The channels whose sign and unit the motion confirms; `where` begins the message.

    Raises:
        InputError: names the channel and what it looks like.
    """
    zero = np.zeros(len(grid.time))
    v = {name: grid.values.get(name, zero) for name in ("phi", "theta", "p", "q", "r")}
    has = grid.values.__contains__
    half, confirmed = half_width(grid.dt), set[str]()
    if has("theta") and has("q"):
        expected = smooth(v["q"] * np.cos(v["phi"]) - v["r"] * np.sin(v["phi"]), half)
        confirmed |= _judge(where, "q", "theta", slope(v["theta"], grid.dt, half), expected, grid)
    if has("phi") and has("p"):
        turn = np.tan(v["theta"]) * (v["q"] * np.sin(v["phi"]) + v["r"] * np.cos(v["phi"]))
        expected = smooth(v["p"] + turn, half)
        confirmed |= _judge(where, "p", "phi", slope(v["phi"], grid.dt, half), expected, grid)
    if has("psi") and has("r"):
        turn = (v["q"] * np.sin(v["phi"]) + v["r"] * np.cos(v["phi"])) / np.cos(v["theta"])
        reach = round(REACH / grid.dt)  # a directional gyro is coarse
        change = slope(np.unwrap(grid.values["psi"]), grid.dt, reach)
        confirmed |= _judge(where, "r", "psi", change, smooth(turn, reach), grid)
    check_forces(where, grid, half)
    check_late(where, grid)
    confirmed |= check_flow(where, grid, v)
    return confirmed | ({"ax"} if check_ax(where, grid) else set())


def _judge(
    where: str, rate: str, angle: str, change: FloatArray, expected: FloatArray, grid: Grid
) -> set[str]:
    """Compare the change of an angle with the rate that should make it (rad/s, each (N,))."""
    rows = grid.good((angle, rate)) & np.isfinite(change) & np.isfinite(expected)
    if rows.sum() < FEWEST or max(np.std(change[rows]), np.std(expected[rows])) < 0.005:
        return set()
    check_pair(where, rate, angle, (np.where(rows, change, 0.0), np.where(rows, expected, 0.0)), grid.dt)
    gain, match = line(expected[rows], change[rows])
    if match < -0.7:
        raise InputError(
            f"{where}: '{rate}' (or '{angle}') has its sign reversed: {angle} changes at {gain:.2f} {rate}"
        )
    if match > 0.7 and not 0.2 < gain < 5.0:
        raise InputError(f"{where}: '{angle}' and '{rate}' are not both in rad: {angle} changes at {gain:.3g} {rate}")
    return {rate, angle} if match > 0.7 else set()
