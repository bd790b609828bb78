"""Multiple models in white noise: every effect alone at its best size, and none, compared by Schwarz's criterion.

The bank of multiple-model adaptive estimation (Magill, IEEE Trans. Automatic Control 10, 434, 1965): one filter for
every effect and size, each predicting one step. The filters know no gusts and the model is taken as it is published, so
that whatever gusts and derivatives a few per cent off leave counts as white noise of unknown size:
BIC = n log(RSS/n) + k log n (Schwarz, Annals of Statistics 6, 461, 1978).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from icing_env.record import FlightRecord
from sim2real.library.candidates import Bank, bank, not_testable, unbroken
from sim2real.posterior.singles import EffectFit, fit_family
from sim2real.prediction.kalman import gains
from sim2real.records.reconstruct import reconstruct
from sim2real.signatures.evidence import gather
from testbed.rivals.opinion import Opinion, Scale, Size

SCALE = Scale(level=10100.0, width=1.01, sharpness=5.67e-4, doubt=0.299)  # testbed.rivals.scales, 90 development cases
CALM = 0.02  # m/s of gusts, as good as none
SIZES = 2  # flown of each effect, beside none; in between by a parabola


def consider(records: Sequence[FlightRecord]) -> Opinion:
    """What the criterion says of the records of one aircraft.

    Raises:
        InputError: a record that cannot be used.
    """
    flights, candidates = [reconstruct(record) for record in records], effects_alone()
    evidences = [gather(flight, candidates, gains(flight, (CALM,))[0]) for flight in flights]
    gram, samples = np.sum([e.gram for e in evidences], axis=0), sum(e.samples for e in evidences)
    untestable = not_testable(flights, candidates)
    best: dict[str, EffectFit] = {}
    least = float(gram[0, 0])
    for family in candidates.families:
        name = family.effect.name
        if name in untestable:
            continue
        fit = fit_family(gram * (samples / least), family)  # white noise as large as what the model leaves
        if name not in best or fit.misfit < best[name].misfit:
            best[name] = fit
    evidence = {name: 0.5 * samples * math.log(samples / max(fit.misfit, 1e-9)) - 0.5 * math.log(samples)
                for name, fit in best.items()}  # fmt: skip
    sizes = {name: Size(fit.family.parameter, fit.estimate, fit.low95, fit.high95) for name, fit in best.items()}
    return Opinion(max(max(evidence.values()), 1.0), evidence, sizes)


def effects_alone() -> Bank:
    """The library without nuisances and generic terms, each effect at the sizes nearest to its typical one."""
    families, row = [], 1
    for family in unbroken(bank().families):
        nearest = sorted(family.nodes, key=lambda size: abs(abs(size) - abs(family.parameter.typical)))
        nodes = tuple(sorted(nearest[:SIZES]))
        families.append(replace(family, nodes=nodes, rows=tuple(range(row, row + len(nodes)))))
        row += len(nodes)
    return replace(bank(), nuisances=(), terms=(), families=tuple(families), size=row)
