"""How robust a designed law is: poles, margins and changed derivatives over the whole grid, in discrete time.

The loop is the one that flies: actuators, aircraft with its downwash lag, instruments, the hold of a step, and the law
as it is run. Attitude loops alone; guidance closes slower ones around them. Margins are those of each surface with the
others at work (Skogestad & Postlethwaite, Multivariable Feedback Control, 2nd ed., sections 2.4 and 9.2).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from itertools import product

import numpy as np

from controllers.design.models import DT, FloatArray, Point, clean, grid, plant

AXES = {"longitudinal": ("elevator",), "lateral": ("aileron", "rudder")}
CHANGED = {"longitudinal": ("Cm_alpha", "Cm_q", "Cm_elevator"), "lateral": ("Cl_p", "Cl_aileron")}
FACTORS = (0.7, 1.3)  # ice takes up to 30 % (NASA tailplane icing programme: elevator power)
OMEGA = np.geomspace(0.02, 0.98*np.pi/DT, 1500)  # rad/s
System = tuple[FloatArray, ...]


@dataclass(frozen=True)
class Margins:
    """Of one surface's loop: gain margin [dB], phase margin [deg], crossover [rad/s], peak of the sensitivity."""

    gain: float
    phase: float
    crossover: float
    peak: float


def closed(process: System, law: System) -> FloatArray:
    """State matrix of the closed loop of a plant (A, B, C) and a law (A, B, C, D)."""
    a, b, c = process
    ak, bk, ck, dk = law
    return np.block([[a + b @ dk @ c, b @ ck], [bk @ c, ak]])


def decay(process: System, law: System) -> float:
    """Rate [1/s] at which the slowest mode of the closed loop dies out; negative: unstable."""
    return float(-np.log(np.abs(np.linalg.eigvals(closed(process, law))).max())/DT)


def response(system: System, omega: FloatArray) -> FloatArray:
    """Frequency response [frequencies, outputs, inputs] of a discrete system A, B, C and, if it has one, D."""
    a, b, c = system[:3]
    z = np.exp(1j*omega*DT)
    inner = np.linalg.solve(z[:, None, None]*np.eye(len(a)) - a, np.broadcast_to(b, (len(z), *b.shape)))
    return np.asarray(c @ inner + (system[3] if len(system) > 3 else 0.0))


def margins(process: System, law: System, surface: int) -> Margins:
    """Margins of one surface, the others' loops closed."""
    import control

    m = response(law, OMEGA) @ response(process, OMEGA)
    rest = [k for k in range(m.shape[1]) if k != surface]
    loop = -m[:, surface, surface]
    if rest:
        others = np.linalg.solve(np.eye(len(rest)) - m[:, rest][:, :, rest], m[:, rest][:, :, [surface]])
        loop = loop - (m[:, [surface]][:, :, rest] @ others)[:, 0, 0]
    gain, phase, _sm, _wg, crossover, _ws = control.stability_margins(control.frd(loop, OMEGA))
    return Margins(float(20.0*np.log10(gain)), float(phase), float(crossover), float((1.0/abs(1.0 + loop)).max()))


def changed(axis: str) -> Iterator[tuple[float, ...]]:
    """Every combination of factors on the derivatives CHANGED of an axis."""
    return product(FACTORS, repeat=len(CHANGED[axis]))


@cache
def places() -> tuple[tuple[int, int, Point], ...]:
    """The grid of the clean aircraft."""
    return tuple(grid(clean()))


@cache
def plants(axis: str, factors: tuple[float, ...] = ()) -> tuple[System, ...]:
    """The plant at every place of the grid, the derivatives CHANGED of the axis times `factors`."""
    flown = grid(clean(**dict(zip(CHANGED[axis], factors, strict=True)))) if factors else places()
    return tuple(plant(point, axis) for _i, _j, point in flown)


def laws(name: str, tables: dict[str, FloatArray], axis: str) -> list[System]:
    """The law as it is run at every place of the grid."""
    module = import_module(f"controllers.design.{name}")
    return [module.compensator(tables, i, j, point, axis) for i, j, point in places()]


def slowest(name: str, tables: dict[str, FloatArray], axis: str, factors: tuple[float, ...] = ()) -> float:
    """The least `decay` over the grid, the aircraft changed by `factors`, the law as designed."""
    return min(map(decay, plants(axis, factors), laws(name, tables, axis)))


def summary(surface: str, found: list[Margins]) -> str:
    """The worst of a surface's margins over the grid, in a line."""
    gain, phase = min(f.gain for f in found), min(f.phase for f in found)
    crossovers, peak = [f.crossover for f in found], max(f.peak for f in found)
    return (f"  {surface}: gain margin at least {gain:.1f} dB, phase margin {phase:.0f} deg, crossover "
            f"{min(crossovers):.1f} to {max(crossovers):.1f} rad/s, peak sensitivity {peak:.2f}")


def verdict(rate: float) -> str:
    """A slowest mode in words."""
    return f"slowest mode {rate:.3f} 1/s, {'stable' if rate > 0.0 else 'UNSTABLE'}"


def report(name: str, tables: dict[str, FloatArray]) -> str:
    """Poles, least margins and what changed derivatives do, as plain text."""
    lines = []
    for axis, surfaces in AXES.items():
        lines.append(f"{axis}: {verdict(slowest(name, tables, axis))} over the grid")
        for k, surface in enumerate(surfaces):
            pairs = zip(plants(axis), laws(name, tables, axis), strict=True)
            lines.append(summary(surface, [margins(process, law, k) for process, law in pairs]))
        rates = [slowest(name, tables, axis, factors) for factors in changed(axis)]
        lines.append(f"  {', '.join(CHANGED[axis])} each at 70 and 130 %, {len(rates)} combinations: "
                     f"{verdict(min(rates))}")
    return "\n".join(lines)
