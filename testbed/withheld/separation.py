"""Distances of a case from none, from every library effect and from every pair of them, nuisances integrated out.

Measured on the published aircraft: the effects of a case, flown in still air without the case's own spread. A rival
may be any combination of its departures at SIZES of its typical size, which follows its curvature with size (and a
little more: distances to strongly curved rivals are rather too small).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from testbed.withheld import distance, effects
from testbed.withheld.conditions import Conditions
from testbed.withheld.distance import Whitener
from testbed.withheld.draw import CALIBRATION, GEARING, MASS_RANGE, MOST, RIGGING, SPREAD, TOLD_ONCE
from testbed.withheld.flights import Aircraft, Flown, fly
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS
from testbed.withheld.published import DERIVATIVES
from testbed.withheld.shadow import shadow

MASS_SPREAD = MASS_RANGE / 3**0.5  # of a uniform distribution
NUISANCES = (*((name, 1.0 + SPREAD) for name in DERIVATIVES if name != "Cn_aileron"), ("mass", 1.0 + MASS_SPREAD),
             *((name, 1.0 + spread) for name, spread in (TOLD_ONCE | GEARING).items()),
             *(CALIBRATION | RIGGING).items())  # fmt: skip
RIVALS = tuple(effect.name for effect in effects.EFFECTS)
SIZES = (0.9, 1.8)  # of the typical size, the same sign
Part = tuple[str, str, float]


@dataclass(frozen=True)
class Bank:
    """Departures of nuisances, then of every rival at SIZES, for each diagnosed manoeuvre of one plan."""

    still: list[Flown]
    motion: list[NDArray]  # [samples, 12, columns]
    inputs: list[NDArray]
    paths: list[NDArray]  # [samples*7, columns] at noise level 1


@lru_cache(maxsize=1)
def bank(plan: int, gain: float) -> Bank:
    """Flown in still air by the published aircraft."""
    stills, motion, inputs, paths = [], [], [], []
    changed = [Aircraft(baseline={name: factor}) for name, factor in NUISANCES]
    rivals = [Aircraft(parts=((e.name, "same", min(size * e.typical, MOST.get(e.name, 9.0))),))
              for e in effects.EFFECTS for size in SIZES]
    for manoeuvre in PLANS[plan][:DIAGNOSED]:
        still = fly(Aircraft(), manoeuvre, gain)
        own = distance.paths(still, 1.0)
        flown = [shadow(aircraft, still, manoeuvre.speed) for aircraft in (*changed, *rivals)]
        stills.append(still)
        motion.append(np.stack([y for y, _, _ in flown], axis=2))
        inputs.append(np.stack([u for _, u, _ in flown], axis=2))
        paths.append(np.column_stack([distance.paths(along, 1.0) - own for _, _, along in flown]))
    return Bank(stills, motion, inputs, paths)


@dataclass(frozen=True)
class Geometry:
    """Whitened bank of one plan, gust and noise level, ready to compare cases with."""

    filters: list[Whitener]
    starts: list[NDArray]  # whitened starts, and the inverse of their Gram matrix with its prior
    columns: list[NDArray]
    gram: NDArray
    level: float


def geometry(plan: int, gain: float, given: Conditions) -> Geometry:
    """Whiten the bank of (plan, gain) as a case in these gusts and noise sees it."""
    held = bank(plan, gain)
    filters = [distance.whitener(m.speed, given) for m in PLANS[plan][:DIAGNOSED]]
    starts, columns = [], []
    for w, y, u, p in zip(filters, held.motion, held.inputs, held.paths, strict=True):
        count = w.starts.shape[1]
        silent = np.zeros((len(y), 12, count)), np.zeros((len(y), 5, count))
        s = distance.whiten(w, *silent, w.starts)
        starts.append(s)
        columns.append(np.vstack([_clear(distance.whiten(w, y, u), s), p / given.level]))
    gram = np.sum([c.T @ c for c in columns], axis=0)
    return Geometry(filters, starts, columns, np.asarray(gram), given.level)


def _clear(y: NDArray, starts: NDArray) -> NDArray:
    """`y` without what another start of the manoeuvre could have made (whose spread is wide: plain projection)."""
    return np.asarray(y - starts @ np.linalg.lstsq(starts, y, rcond=1e-9)[0])


@dataclass(frozen=True)
class Distances:
    """D from none; from each library effect, its size free; from the nearest pair of them.

    own_set, rival_set: of a pair, from itself in the library's forms, and from the nearest other pair or single effect.
    known, strange: of an effect beside an unknown one, each by itself: from none, and from the nearest pair.
    """

    none: float
    rivals: dict[str, float]
    pair: float
    own_set: float | None = None
    rival_set: float | None = None
    known: float | None = None
    strange: float | None = None


def distances(plan: int, gain: float, g: Geometry, parts: Sequence[Part]) -> Distances:
    """Of the effects `parts` on the published aircraft, in the plan, gust and noise of `g`."""
    total, cross, held = 0.0, np.zeros(len(g.gram)), bank(plan, gain)
    everything = zip(PLANS[plan], g.filters, g.starts, g.columns, held.still, strict=False)
    for manoeuvre, w, s, columns, still in everything:
        y, u, along = shadow(Aircraft(parts=tuple(parts)), still, manoeuvre.speed)
        white = _clear(distance.whiten(w, y[:, :, None], u[:, :, None]), s)[:, 0]
        column = np.concatenate([white, distance.paths(along, g.level) - distance.paths(still, g.level)])
        total += float(column @ column)
        cross += columns.T @ column
    k = len(NUISANCES)
    prior = np.linalg.inv(g.gram[:k, :k] + np.eye(k))
    own = float(total - cross[:k] @ prior @ cross[:k])
    to = cross[k:] - g.gram[k:, :k] @ prior @ cross[:k]
    among = g.gram[k:, k:] - g.gram[k:, :k] @ prior @ g.gram[:k, k:]
    singles = dict(zip(RIVALS, _left(own, to, among, np.arange(len(RIVALS))[:, None]).tolist(), strict=True))
    chosen = np.array(list(combinations(range(len(RIVALS)), 2)))
    pairs = _left(own, to, among, chosen)
    found = Distances(max(own, 0.0) ** 0.5, singles, float(pairs.min()))
    names = {effect for effect, _, _ in parts}
    if len(names) < 2 or not names <= set(RIVALS):
        return found
    itself = np.array([{RIVALS[i], RIVALS[j]} == names for i, j in chosen])
    return replace(found, own_set=float(pairs[itself][0]),
                   rival_set=min(float(pairs[~itself].min()), *singles.values()))


def _left(own: float, to: NDArray, among: NDArray, chosen: NDArray) -> NDArray:
    """Distances [sets] that remain when the chosen rivals [sets, members] take any size."""
    at = (len(SIZES) * chosen[:, :, None] + np.arange(len(SIZES))).reshape(len(chosen), -1)
    block = among[at[:, :, None], at[:, None, :]]
    block = block + np.eye(at.shape[1]) * (1e-9 * block + 1e-9)
    explained = np.einsum("sk,sk->s", to[at], np.linalg.solve(block, to[at][..., None])[..., 0])
    return np.asarray(np.maximum(own - explained, 0.0) ** 0.5)
