"""Loading: what neither a published model nor reference flights tell of a flight with its own fuel and freight aboard.

Weighing and fuel gauges leave the centre of gravity and the inertias of every loading uncertain. Moments about another
centre of gravity are those of Etkin & Reid (Dynamics of Flight, 1996, appendix B.12): Cm + (dx/c) CZ, Cn - (dx/b) CY.
Inertias that are off by a share are nuisances as they are: they turn the aircraft by its rates too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from icing_env import aircraft
from icing_env.record import FlightRecord, FloatArray
from sim2real.baseline.references import Baseline
from sim2real.library.candidates import INERTIAS, Nuisance

CENTRE = 0.01  # m forward: how well a loading is known (assumed: half a per cent of the chord)
ALIKE = 2e-3  # share of the mass up to which two loadings are one
RATIO = "Cm_elevator_CT"  # of two moments of one loading


def otherwise_loaded(references: Iterable[FlightRecord], records: Iterable[FlightRecord]) -> bool:
    """Whether a record's loading is not that of the references, as far as side files tell."""
    stated = [{(r.meta.mass, r.meta.inertia, r.meta.cg) for r in some} for some in (references, records)]
    masses = [mass for some in stated for mass, _, _ in some if mass is not None]
    return stated[0] != stated[1] and len(masses) > 0 and max(masses) > (1.0 + ALIKE) * min(masses)


def of_published(nuisances: Sequence[Nuisance]) -> Baseline:
    """The published model, of an aircraft that is loaded as its side file says."""
    published = Baseline(aircraft.load(), np.eye(len(nuisances)))
    return _less_known(published, _of_centre(published.parameters, nuisances))


def of_another_loading(baseline: Baseline, nuisances: Sequence[Nuisance]) -> Baseline:
    """A baseline as it is known of flights whose loading is told by weighing and gauges alone."""
    of_inertias = [np.eye(len(nuisances))[j] for j, nuisance in enumerate(nuisances) if nuisance.name in INERTIAS]
    return _less_known(baseline, _of_centre(baseline.parameters, nuisances), *of_inertias)


def _less_known(baseline: Baseline, *moves: FloatArray) -> Baseline:
    """The baseline with nuisances uncertain by some moves too, each of one standard deviation [n]."""
    together = np.array(moves)
    precision = np.linalg.inv(np.linalg.inv(baseline.precision) + together.T @ together)
    return replace(baseline, precision=0.5 * (precision + precision.T))


def _of_centre(row: NDArray, nuisances: Sequence[Nuisance]) -> FloatArray:
    """What a standard deviation of the centre of gravity moves the nuisances by [n]."""
    p, out = row[0], np.zeros(len(nuisances))
    for j, nuisance in enumerate(nuisances):
        axis, _, of = nuisance.parameter.partition("_")
        size = nuisance.factor * float(p[nuisance.parameter]) if axis in ("Cm", "Cn") else 0.0
        if nuisance.absolute or nuisance.parameter == RATIO or not size:
            continue
        if axis == "Cm":
            out[j] = CENTRE / float(p["chord"]) * float(p[f"CZ_{of}"]) / size
        elif f"CY_{of}" in (row.dtype.names or ()):
            out[j] = -CENTRE / float(p["span"]) * float(p[f"CY_{of}"]) / size
    return out
