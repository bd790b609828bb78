"""Stepwise regression on what the model lacks in each coefficient, and the effect whose signature points the same way.

Regressors are chosen as the founding paper's own tool does (modified stepwise regression, Klein & Morelli, Aircraft
System Identification, AIAA 2006, section 5.4). What they describe is compared with each effect's own lack by the cosine
of the angle between the two, every coefficient in units of what regression leaves of it; of actuators and engines the
whole residual from command to position is compared.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimators.regression.stepwise import stepwise
from icing_env.record import FlightRecord, FloatArray
from sim2real.records.reconstruct import reconstruct
from testbed.rivals.coefficients import Lack, lack, variants
from testbed.rivals.opinion import Opinion, Scale, Size

SCALE = Scale(level=27.1, width=1.21, sharpness=188.0, doubt=0.503)  # testbed.rivals.scales, 90 development cases
REGRESSORS = {
    "CX": ("alpha", "alpha*alpha", "airspeed", "elevator", "q"),
    "CZ": ("alpha", "q", "elevator", "alpha*alpha", "airspeed"),
    "Cm": ("alpha", "q", "elevator", "alpha*alpha", "airspeed"),
    "CY": ("beta", "p", "r", "rudder", "aileron"), "Cl": ("beta", "p", "r", "aileron", "rudder", "alpha"),
    "Cn": ("beta", "p", "r", "aileron", "rudder", "alpha"),
}  # fmt: skip


def consider(records: Sequence[FlightRecord]) -> Opinion:
    """What regression says of the records of one aircraft.

    Raises:
        InputError: a record that cannot be used.
    """
    tried = variants()
    seen, made, samples = _vectors(lack([reconstruct(record) for record in records], tried))
    length, square = float(seen @ seen), np.maximum(np.sum(made**2, axis=1), 1e-12)
    along = made @ seen
    cosine = np.abs(along) / np.sqrt(square * max(length, 1e-12))
    evidence: dict[str, float] = {}
    sizes: dict[str, Size] = {}
    for variant, c, share, each in zip(tried, cosine, along / square, square, strict=True):
        p = variant.parameter
        error = variant.size / np.sqrt(each)
        if c > evidence.get(variant.effect, -1.0):
            evidence[variant.effect] = float(c)
            middle = p.neutral + share * (variant.size - p.neutral)
            sizes[variant.effect] = Size(p, *(float(np.clip(middle + k * abs(error), p.low, p.high))
                                              for k in (0.0, -1.96, 1.96)))
    return Opinion(max(length / samples, 1e-6), evidence, sizes)


def _vectors(found: Lack) -> tuple[FloatArray, FloatArray, int]:
    """What the aircraft lacks [n] and what every effect would [variants, n], whitened, and how many instants there are.

    Of the aircraft only the part that regressors describe.
    """
    seen, made = [], []
    away = {name: series - series.mean() for name, series in found.channels.items()}
    for name, terms in REGRESSORS.items():
        candidates = {term: np.prod([away[f] for f in term.split("*")], axis=0) for term in terms}
        target = found.residual[name]
        model = stepwise(candidates, target)
        matrix = np.column_stack([*(candidates[term] for term in model.terms[:-1]), np.ones(len(target))])
        described = matrix @ model.fit.theta
        noise = max(float(np.std(target - described)), 1e-12)
        seen.append(described / noise)
        made.append(found.signatures[name] / noise)
    for table in found.paths.values():
        seen.append(table[0])
        made.append(table[1:])
    return np.concatenate(seen), np.concatenate(made, axis=1), len(target)
