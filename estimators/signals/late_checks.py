"""Channels that come late against what makes them, or against what they make: named, and the record refused.

Angles follow rates and airspeed what is felt at once; so does lift its angle of attack, side force its sideslip, axial
force the lift that alpha tilts forward (Klein & Morelli, Aircraft System Identification, AIAA 2006, sections 3.3, 5.1),
and the aircraft a surface's measured position. A late channel fits best when it is shifted back. Vanes may lag by
themselves, both by the same: one alone that is late is the recorder's. Thresholds are assumed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.signals.axial_check import lateness
from estimators.signals.consistency import FEWEST, line
from estimators.signals.differentiate import half_width, slope, smooth
from estimators.signals.resample import Grid
from icing_env.errors import InputError
from icing_env.record import FloatArray

LATE, LATEST = 0.15, 0.6  # s: channels of a sound record agree to less; how far is looked
SLOW = ("psi", "alpha", "beta")  # compasses and vanes may lag by themselves
FOLLOWS, BETTER = 0.9, 0.05  # correlation of a rate and its angle, one shifted, and by how much it must gain
STEP, SHIFT = 0.06, 0.04  # s between the rows and the shifts that are compared
TRAILS, CLEAR = 0.2, 4.0  # s by which airspeed may trail (a pressure line fills in 0.1), and standard errors beyond it
KNOWN = 0.05  # s: standard error up to which that is told; gusts bend it


class Relation(NamedTuple):
    """What a channel should fit when it is on time.

    Attributes:
        force: what is fitted, over V^2; the change of a rate if it is one.
        beside: channels that it is fitted with, with the late one.
        channel: the one that may be late; `force` itself if it is none of `beside`.
        follows: correlation that the best shift must reach.
        left: the share of what was unexplained that it may leave at most.
    """

    force: str
    beside: tuple[str, ...]
    channel: str
    follows: float
    left: float


RATES, FORCE = ("p", "q", "r"), "force"
LONGITUDINAL, LATERAL = ("alpha", "elevator", "q"), ("beta", "rudder", "r", "p")
VANES = (Relation("az", LONGITUDINAL, "alpha", 0.95, 0.6), Relation("ay", LATERAL, "beta", 0.95, 0.6))
OTHERS = (Relation("q", LONGITUDINAL, "elevator", 0.9, 0.5), Relation("p", (*LATERAL, "aileron"), "aileron", 0.9, 0.5),
          Relation("r", (*LATERAL, "aileron"), "rudder", 0.9, 0.5), Relation("ax", ("alpha",), "ax", 0.45, 0.85))


def check_late(where: str, grid: Grid) -> None:
    """Refuse a vane that is later than the other one, a surface, the axial force or airspeed that is late.

    Args:
        where: begins the message.
        grid: the record's channels.

    Raises:
        InputError: names the channel and by how much it is late.
    """
    for relation in OTHERS:
        late, clear = _lateness(grid, relation)
        if clear and late >= LATE:
            against = "alpha" if relation.force == "ax" else relation.force
            raise InputError(_late(where, relation.channel, late, against))
    vanes = [_lateness(grid, relation) for relation in VANES]
    for relation, (late, clear), (other, _) in zip(VANES, vanes, vanes[::-1], strict=True):
        if clear and late - max(other, 0.0) >= LATE:
            raise InputError(_late(where, relation.channel, late, relation.force))
    late, error = lateness(grid)
    if error < KNOWN and TRAILS + CLEAR * error < late < LATEST:
        raise InputError(_late(where, "airspeed", late, "ax"))


def _late(where: str, channel: str, late: float, against: str) -> str:
    return f"{where}: column '{channel}' is {late:.2f} s late against '{against}'; shift it back"


def _lateness(grid: Grid, relation: Relation) -> tuple[float, bool]:
    """By how much the channel of a relation is late, s (infinite where it is not told), and whether that is clear."""
    columns, known = _columns(grid, relation)
    reach, step = round(LATEST / grid.dt), max(1, round(SHIFT / grid.dt))
    shifts = np.arange(-reach, reach + 1, step)
    rows = np.arange(reach, len(known) - reach, max(1, round(STEP / grid.dt)))
    rows = rows[known[rows[:, None] + shifts].all(axis=1)]
    if len(rows) < FEWEST * max(len(columns), 1):
        return np.inf, False
    force = columns.pop(FORCE)
    moved = columns.pop(relation.channel, None)
    beside = np.column_stack([*(x[rows] for x in columns.values()), np.ones(len(rows))])
    unexplained = np.array([
        _unexplained(force[rows + k], beside) if moved is None else
        _unexplained(force[rows], np.column_stack([beside, moved[rows + k]])) for k in shifts
    ])  # fmt: skip
    best = int(np.argmin(unexplained))
    if unexplained[best] > 1.0 - relation.follows**2 or best in (0, len(shifts) - 1):
        return np.inf, False
    now = unexplained[int(np.argmin(np.abs(shifts)))]
    return float(shifts[best]) * grid.dt, bool(unexplained[best] < relation.left * now)


def _columns(grid: Grid, relation: Relation) -> tuple[dict[str, FloatArray], NDArray[np.bool_]]:
    """What is fitted (FORCE) and what it is fitted with, each (N,), and where all of it is known (N,).

    Nothing where a channel is missing.
    """
    names = {"airspeed", relation.force, *relation.beside}
    if not all(name in grid.values for name in names):
        return {}, np.zeros(len(grid.time), dtype=bool)
    half = half_width(grid.dt)
    columns = {name: smooth(grid.values[name], half) for name in relation.beside}
    pressure, force = smooth(grid.values["airspeed"], half) ** 2, grid.values[relation.force]
    if relation.force == "ax":  # drag with the square of lift, and thrust
        columns |= {"square": columns["alpha"] ** 2, "thrust": 1.0 / pressure}
    made = slope(force, grid.dt, half) if relation.force in RATES else smooth(force, half)
    columns[FORCE] = made / pressure
    return columns, grid.good(names) & np.all(np.isfinite(list(columns.values())), axis=0)


def _unexplained(force: FloatArray, columns: FloatArray) -> float:
    """Share of the variance of a force (N,) that columns (N, n), a constant among them, do not explain."""
    size = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(size > 0.0, size, 1.0)  # a rudder may rest at zero
    left = force - scaled @ np.linalg.lstsq(scaled, force, rcond=None)[0]
    total = float(np.sum((force - force.mean()) ** 2))
    return float(left @ left) / total if total > 0.0 else 1.0


def check_forces(where: str, grid: Grid, half: int) -> None:
    """Lift and side force come with the flow angles that make them: az or ay that follow late are refused."""
    for flow, force in (("alpha", "az"), ("beta", "ay")):
        if not all(name in grid.values for name in (flow, force, "airspeed")):
            continue
        made = -smooth(grid.values[force] / grid.values["airspeed"] ** 2, half)
        angle = smooth(grid.values[flow], half)
        rows = grid.good((flow, force, "airspeed")) & np.isfinite(made) & np.isfinite(angle)
        if rows.sum() >= FEWEST:
            pair = tuple(np.where(rows, x - np.mean(x[rows]), 0.0) for x in (made, angle))
            check_pair(where, flow, force, (pair[0], pair[1]), grid.dt)


def check_pair(where: str, rate: str, angle: str, pair: tuple[FloatArray, FloatArray], dt: float) -> None:
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
        raise InputError(_late(where, name, late, other))
