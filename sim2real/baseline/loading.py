"""Loading: what neither a published model nor reference flights tell of a flight with its own fuel and freight aboard.

Weighing and fuel gauges leave the centre of gravity and the inertias of every loading uncertain. Moments about another
centre of gravity are those of Etkin & Reid (Dynamics of Flight, 1996, appendix B.12): Cm + (dx/c) CZ, Cn - (dx/b) CY;
an inertia that is off by a share leaves all coefficients of its axis off by as much.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from icing_env import aircraft
from icing_env.record import FlightRecord, FloatArray
from sim2real.baseline.references import Baseline
from sim2real.library.candidates import Nuisance

CENTRE, INERTIA = 0.01, 0.02  # m forward; share: how well a loading is known (assumed: half a per cent of the chord)
ALIKE = 2e-3  # share of the mass up to which two loadings are one
AXES = ("Cl_", "Cm_", "Cn_")
RATIO = "Cm_elevator_CT"  # of two moments of one loading


def otherwise_loaded(references: Iterable[FlightRecord], records: Iterable[FlightRecord]) -> bool:
    """Whether a record's loading is not that of the references, as far as side files tell."""
    stated = [{(r.meta.mass, r.meta.inertia, r.meta.cg) for r in some} for some in (references, records)]
    masses = [mass for some in stated for mass, _, _ in some if mass is not None]
    return stated[0] != stated[1] and len(masses) > 0 and max(masses) > (1.0 + ALIKE) * min(masses)


def of_published(nuisances: Sequence[Nuisance]) -> Baseline:
    """The published model, of an aircraft that is loaded as its side file says."""
    return of_another_loading(Baseline(aircraft.load(), np.eye(len(nuisances))), nuisances)


def of_another_loading(baseline: Baseline, nuisances: Sequence[Nuisance]) -> Baseline:
    """A baseline as it is known of flights whose loading is told by weighing and gauges alone."""
    moves = _moves(baseline.parameters, nuisances)
    covariance = np.linalg.inv(baseline.precision) + moves.T @ moves
    precision = np.linalg.inv(covariance)
    return replace(baseline, precision=0.5 * (precision + precision.T))


def _moves(row: NDArray, nuisances: Sequence[Nuisance]) -> FloatArray:
    """What a standard deviation of the centre of gravity, and of each inertia, moves the nuisances by [4, n]."""
    p, out = row[0], np.zeros((1 + len(AXES), len(nuisances)))
    for j, nuisance in enumerate(nuisances):
        axis, _, of = nuisance.parameter.partition("_")
        if nuisance.absolute or f"{axis}_" not in AXES or nuisance.parameter == RATIO:
            continue
        out[1 + AXES.index(f"{axis}_"), j] = INERTIA / nuisance.factor
        size = nuisance.factor * float(p[nuisance.parameter])
        if axis == "Cm" and size:
            out[0, j] = CENTRE / float(p["chord"]) * float(p[f"CZ_{of}"]) / size
        if axis == "Cn" and size and f"CY_{of}" in (row.dtype.names or ()):
            out[0, j] = -CENTRE / float(p["span"]) * float(p[f"CY_{of}"]) / size
    return out
