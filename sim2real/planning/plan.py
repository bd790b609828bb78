"""Before a flight: the smallest size of every effect that planned manoeuvres would reveal, and what they would confuse.

The manoeuvres are flown by the model; signatures of the library along them are whitened with the noise of the
instruments and the gusts expected, and nuisances integrated out, as after a flight; what counts as revealed, and as
told apart, is the same distance. Every size is flown, with the nuisances at their best for it, so that nothing is
interpolated where a limit or a stall sets in, nor taken for linear.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from icing_env import effects
from icing_env.errors import InputError, nearest
from icing_env.record import FloatArray
from sim2real.library.candidates import Bank, Family, bank, not_testable, unbroken
from sim2real.planning.manoeuvre import DURATION, MANOEUVRES, Manoeuvre
from sim2real.planning.planned import evidence, planned, template
from sim2real.posterior.singles import DETECTABLE, INDISTINGUISHABLE
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.side_by_side import algebra_in_one_thread
from sim2real.weigh import Progress

SIZES, FINEST = 10, 1e-3  # of every parameter that are flown, from this share of its range to all of it
ALTITUDE, GUSTS = 2200.0, 0.5  # m, m/s
SILENT = "not excited: these manoeuvres would not show it anywhere in its range"


@dataclass(frozen=True)
class Plan:
    """What planned manoeuvres would reveal.

    Attributes:
        manoeuvres: those planned with: name, airspeed [m/s] and duration [s].
        refused: manoeuvres of the list that the aircraft cannot fly at that height, with the reason.
        altitude, sigma_w: m, m/s.
        noise: standard deviation by channel.
        detection_limits: by effect {"parameter", "smallest", "unit", "typical"}; the first three as after a flight.
        indistinguishable_from: effects that one of typical size would be taken for; only those that would show then.
        not_testable: effects that no size of would show, with the reason.
        seconds: that the plan took.
    """

    manoeuvres: list[dict[str, Any]]
    refused: dict[str, str]
    altitude: float
    sigma_w: float
    noise: dict[str, float]
    detection_limits: dict[str, dict[str, Any]]
    indistinguishable_from: dict[str, list[str]]
    not_testable: list[dict[str, str]]
    seconds: float


@dataclass(frozen=True)
class _Shown:
    """How one parameter of an effect would show: size at which it is first seen (None: never), and at its typical one.

    Attributes:
        row, distance: of the typical size.
        likeness, at: row and size that stand for the signature of other sizes; the typical ones where they show.
    """

    family: Family
    smallest: float | None
    typical: float
    row: int
    distance: float
    likeness: int
    at: float

    @property
    def ease(self) -> float:
        """Of several parameters of an effect the one that shows first, against its typical size, is stated."""
        return np.inf if self.smallest is None else abs(self.smallest / self.typical)


@algebra_in_one_thread
def plan(manoeuvres: Sequence[Manoeuvre], sigma: float = GUSTS, noise: Mapping[str, float] | None = None,
         without: Iterable[str] = (), altitude: float = ALTITUDE,
         progress: Progress = lambda text: None) -> Plan:  # fmt: skip
    """Detection limits of a set of manoeuvres that nobody has flown yet.

    Args:
        manoeuvres: each flown once, from a trim of its own.
        sigma: gust intensity expected, m/s.
        noise: standard deviation by channel where it is not that of the aircraft's instruments.
        without: effects to leave out.
        altitude: m.
        progress: told what is being done.

    Raises:
        InputError: no manoeuvre, an unknown effect or channel, or a manoeuvre that the aircraft cannot fly there
            (of the whole list: none that it can).
    """
    began = time.perf_counter()
    candidates, empty = _sizes(bank(_known(without))), template(altitude, noise or {})
    flights, refused = _flights(manoeuvres, empty)
    gram, reduced = evidence([flight for _, flight in flights], candidates, sigma, progress)
    untestable = not_testable([flight for _, flight in flights], candidates)
    shown = _first_seen(reduced, [f for f in candidates.families if f.effect.name not in untestable])
    missed = {n: _why(gram, reduced, candidates, s.family) for n, s in shown.items() if s.smallest is None}
    seen = {n: s for n, s in shown.items() if s.smallest is not None}
    return Plan([{"name": m.name, "airspeed": m.airspeed, "duration": DURATION} for m, _ in flights], refused,
                altitude, sigma, dict(zip(MEASURED, empty.noise.tolist(), strict=True)),
                {n: {"parameter": s.family.parameter.name, "smallest": s.smallest, "unit": s.family.parameter.unit,
                     "typical": s.typical} for n, s in seen.items()},
                _classes(reduced, seen), [{"effect": n, "why": w} for n, w in sorted((missed | untestable).items())],
                time.perf_counter() - began)  # fmt: skip


def _known(names: Iterable[str]) -> tuple[str, ...]:
    names = tuple(names)
    for name in names:
        if name not in effects.LIBRARY:
            raise InputError(f"no effect '{name}' to leave out: {nearest(name, list(effects.LIBRARY))}")
    return names


def _flights(manoeuvres: Sequence[Manoeuvre], empty: Reconstruction
             ) -> tuple[list[tuple[Manoeuvre, Reconstruction]], dict[str, str]]:  # fmt: skip
    """The manoeuvres flown; of the whole list those that cannot be are left out, with the reason."""
    if not manoeuvres:
        raise InputError("no manoeuvre to plan with: name at least one")
    flights, refused = [], {}
    for manoeuvre in manoeuvres:
        try:
            flights.append((manoeuvre, planned(empty, manoeuvre)))
        except InputError as why:
            refused[manoeuvre.name] = str(why)
    whole = {m.name for m in MANOEUVRES} <= {m.name for m in manoeuvres}
    if refused and not (whole and flights):
        raise InputError(next(iter(refused.values())))
    return flights, refused


def _sizes(full: Bank) -> Bank:
    """The candidates without generic terms, every parameter towards its typical sign at sizes of a geometric series."""
    row, families = 1 + len(full.nuisances), []
    for family in unbroken(full.families):
        p = family.parameter
        end = p.high if (p.typical or 1.0) > p.neutral else p.low
        nodes = sorted({*np.geomspace(FINEST, 1.0, SIZES), abs((_typical(family) - p.neutral) / (end - p.neutral))})
        families.append(replace(family, nodes=tuple(float(p.neutral + share * (end - p.neutral)) for share in nodes),
                                rows=tuple(range(row, row + len(nodes)))))  # fmt: skip
        row += len(nodes)
    return replace(full, families=tuple(families), terms=(), size=row)


def _typical(family: Family) -> float:
    """Its typical size; where none is stated, a quarter of the way to the end of its range."""
    p = family.parameter
    return p.typical if p.typical != p.neutral else p.neutral + 0.25 * (p.high - p.neutral)


def _first_seen(reduced: FloatArray, families: Sequence[Family]) -> dict[str, _Shown]:
    """Every effect by the parameter that shows first, of those with a typical size if any of them shows."""
    out: dict[str, _Shown] = {}
    for family in families:
        found, name = _shown(reduced, family), family.effect.name
        if name not in out or _rank(found) < _rank(out[name]):
            out[name] = found
    return out


def _rank(shown: _Shown) -> tuple[bool, bool, float]:
    p = shown.family.parameter
    return shown.smallest is None, p.typical == p.neutral, shown.ease


def _shown(reduced: FloatArray, family: Family) -> _Shown:
    rows, nodes, p = list(family.rows), np.array(family.nodes), family.parameter
    distance = np.sqrt(np.maximum(reduced[rows, rows], 1e-12))
    typical = int(np.argmin(np.abs(nodes - _typical(family))))
    found = _Shown(family, None, family.nodes[typical], rows[typical], float(distance[typical]), rows[-1],
                   family.nodes[-1])  # fmt: skip
    reached = np.flatnonzero(distance >= DETECTABLE)
    if not len(reached):
        return found
    k = int(reached[0])
    away = np.abs(nodes - p.neutral)
    size = away[0] * DETECTABLE / distance[0]  # in proportion, where the smallest size flown shows already
    if k > 0:
        size = np.exp(np.interp(np.log(DETECTABLE), np.log(distance[k - 1 : k + 1]), np.log(away[k - 1 : k + 1])))
    like = typical if found.distance >= DETECTABLE else k
    return replace(found, smallest=float(p.neutral + size * np.sign(family.nodes[0] - p.neutral)),
                   likeness=rows[like], at=family.nodes[like])  # fmt: skip


def _why(gram: FloatArray, reduced: FloatArray, candidates: Bank, family: Family) -> str:
    """Why no size of an effect would show: nothing moves, or the model's own uncertainty moves it as much."""
    rows = np.array(family.rows)
    row = int(rows[np.argmax(reduced[rows, rows])])
    if np.sqrt(gram[row, row]) < DETECTABLE:
        return SILENT
    g = np.arange(1, 1 + len(candidates.nuisances))
    alike = gram[g, row] ** 2 / np.maximum(gram[g, g], 1e-12)
    name = candidates.nuisances[int(np.argmax(alike))].name
    return f"hidden: within its range it moves these flights as the uncertainty of the model does, most like {name}"


def _classes(reduced: FloatArray, seen: Mapping[str, _Shown]) -> dict[str, list[str]]:
    """For every effect that shows at its typical size the effects that it would be taken for then.

    The other's size is free within its range, its signature in proportion to it.
    """
    out = {}
    for name, own in seen.items():
        if own.distance < DETECTABLE:
            continue
        near = []
        for other, rival in seen.items():
            p = rival.family.parameter
            cross, square = reduced[own.row, rival.likeness], reduced[rival.likeness, rival.likeness]
            ends = sorted((end - p.neutral) / (rival.at - p.neutral) for end in (p.low, p.high))
            times = min(max(cross / square, ends[0]), ends[1])
            apart = own.distance**2 - 2.0 * times * cross + times**2 * square
            if other != name and apart < INDISTINGUISHABLE**2:
                near.append(other)
        out[name] = near
    return out
