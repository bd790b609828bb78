"""Flights of the same aircraft without the gap: they correct the model, and say how well it is known then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from icing_env import aircraft
from icing_env.record import FloatArray
from sim2real.candidates import NUISANCE_STEP, Bank, shifted
from sim2real.evidence import gather
from sim2real.reconstruct import Reconstruction


@dataclass(frozen=True)
class Baseline:
    """The model a gap is looked for against: its PARAMETERS row and the precision of its nuisances [n, n]."""

    parameters: NDArray
    precision: FloatArray


def fit_baseline(flights: Sequence[Reconstruction], candidates: Bank) -> Baseline:
    """Nuisances estimated on reference flights (Gauss-Newton's first step from the published model).

    Their prior N(0, 1) and the records' information give mean -(I + G'G)^-1 G'v and precision I + G'G.
    """
    only = replace(candidates, families=(), terms=(), size=1 + len(candidates.nuisances))
    gram = np.sum([gather(flight, only).gram for flight in flights], axis=0)
    n = len(candidates.nuisances)
    precision = np.eye(n) + gram[1 : n + 1, 1 : n + 1] / NUISANCE_STEP**2
    mean = -np.linalg.solve(precision, gram[1 : n + 1, 0] / NUISANCE_STEP)
    for j, nuisance in enumerate(candidates.nuisances):
        if nuisance.name in ("mass", "thrust"):  # a matter of each record
            mean[j], precision[j], precision[:, j] = 0.0, 0.0, 0.0
            precision[j, j] = 1.0
    return Baseline(shifted(aircraft.load(), candidates.nuisances, mean, ""), precision)
