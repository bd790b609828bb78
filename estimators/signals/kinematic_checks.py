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
from estimators.signals.resample import Grid
from icing_env.errors import InputError
from icing_env.record import FloatArray

LATE, LATEST = 0.15, 0.6  # s: gyros and attitude references of a sound record agree to less; how far is looked
SLOW = ("psi", "alpha", "beta")  # compasses and vanes may lag by themselves
FOLLOWS, BETTER = 0.9, 0.05  # correlation of a rate and its angle, one shifted, and by how much it must gain


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
    confirmed |= check_flow(where, grid, v)
    _check_forces(where, grid, half)
    return confirmed | ({"ax"} if check_ax(where, grid) else set())


def _judge(
    where: str, rate: str, angle: str, change: FloatArray, expected: FloatArray, grid: Grid
) -> set[str]:
    """Compare the change of an angle with the rate that should make it (rad/s, each (N,))."""
    rows = grid.good((angle, rate)) & np.isfinite(change) & np.isfinite(expected)
    if rows.sum() < FEWEST or max(np.std(change[rows]), np.std(expected[rows])) < 0.005:
        return set()
    _check_late(where, rate, angle, (np.where(rows, change, 0.0), np.where(rows, expected, 0.0)), grid.dt)
    gain, match = line(expected[rows], change[rows])
    if match < -0.7:
        raise InputError(
            f"{where}: '{rate}' (or '{angle}') has its sign reversed: {angle} changes at {gain:.2f} {rate}"
        )
    if match > 0.7 and not 0.2 < gain < 5.0:
        raise InputError(f"{where}: '{angle}' and '{rate}' are not both in rad: {angle} changes at {gain:.3g} {rate}")
    return {rate, angle} if match > 0.7 else set()


def _check_forces(where: str, grid: Grid, half: int) -> None:
    """Lift and side force come with the flow angles that make them: az or ay that follow late are refused."""
    for flow, force in (("alpha", "az"), ("beta", "ay")):
        if not all(name in grid.values for name in (flow, force, "airspeed")):
            continue
        made = -smooth(grid.values[force] / grid.values["airspeed"] ** 2, half)
        angle = smooth(grid.values[flow], half)
        rows = grid.good((flow, force, "airspeed")) & np.isfinite(made) & np.isfinite(angle)
        if rows.sum() >= FEWEST:
            pair = tuple(np.where(rows, x - np.mean(x[rows]), 0.0) for x in (made, angle))
            _check_late(where, flow, force, (pair[0], pair[1]), grid.dt)


def _check_late(where: str, rate: str, angle: str, pair: tuple[FloatArray, FloatArray], dt: float) -> None:
    """Refuse a rate or an angle that comes late: of the two, the later. A compass (psi) may lag; that is no fault.

    `pair`: change of the angle and the rate that should make it, zero where either is not known.
    """
    change, expected = pair
    reach = round(LATEST / dt)
    if len(change) < 4 * reach:
        return
    inner = expected[reach:-reach]
    shifts = np.arange(-reach, reach + 1)  # of the angle against the rate; positive: the angle is late
    match = np.array([line(inner, change[reach + k : len(change) - reach + k])[1] for k in shifts])
    best = int(np.argmax(match))
    late, name, other = dt * float(shifts[best]), angle, rate
    if late < 0.0:
        late, name, other = -late, rate, angle
    clear = match[best] > FOLLOWS and match[best] > abs(match[reach]) + BETTER and 0 < best < 2 * reach
    if clear and late >= LATE and name not in SLOW:
        raise InputError(f"{where}: column '{name}' is {late:.2f} s late against '{other}'; shift it back")
