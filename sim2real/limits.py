"""What these records could have revealed: the smallest size of every effect that would have stood out, flown.

Polynomials between the sizes of the bank, and nuisances that add, hold only nearby: a derivative that is off by 10 %
lies hundreds of noise units away, and what a linear fit misses of that would pass for the effect. Each effect is
therefore flown at its limit with the nuisances that hide it best, and both are corrected by what that shows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.candidates import NUISANCE_STEP, Bank, parameter_rows
from sim2real.evidence import Evidence, compare
from sim2real.references import Baseline
from sim2real.settling import nearer
from sim2real.side_by_side import each
from sim2real.singles import DETECTABLE, EffectFit

ROUNDS = 5  # times that all are flown
MOST = 3.0  # times by which a size is changed at once
EDGE = 1e-6  # of a range


def limits(evidences: Sequence[Evidence], candidates: Bank, baseline: Baseline, tempering: float,
           fits: Mapping[str, EffectFit]) -> dict[str, float | None]:
    """Size of every effect at which its distance from no gap is DETECTABLE; None where its range does not reach it.

    Args:
        evidences: of the records, about the model that they were flown with.
        tempering: of the evidence.
        fits: every effect on its own, as the linear fit has it.
    """
    names = [name for name, fit in fits.items() if fit.smallest is not None]
    families = [fits[name].family for name in names]
    neutral = np.array([f.parameter.neutral for f in families])
    reach = np.array([(p.high if (p.typical or 1.0) > p.neutral else p.low) for p in (f.parameter for f in families)])
    reach -= neutral
    share = np.array([fits[name].smallest for name in names], float)
    share, n = (share - neutral) / reach, len(candidates.nuisances)
    moved, low, high = np.zeros((1 + n + len(names), n)), np.zeros(len(names)), np.full(len(names), np.inf)
    for turn in range(ROUNDS):
        own = tuple(replace(f, nodes=(size,), rows=(1 + n + i,))
                    for i, (f, size) in enumerate(zip(families, neutral + share * reach, strict=True)))
        flown = replace(candidates, families=own, terms=(), size=len(moved))
        grams = each(lambda e, bank=flown, at=moved: compare(e.flight, moved_rows(e, bank, at), e.gain, e.factor).gram,
                     evidences)
        best, left = hiding(per_deviation(np.sum(grams, axis=0), n) / tempering, baseline.precision, moved)
        distance = np.sqrt(np.maximum(np.diag(left)[1 + n :], 1e-12))
        hidden = distance < DETECTABLE
        low = np.where(hidden, share, low)
        if turn > 0:  # at first nuisances do not hide as much as they can
            high = np.where(hidden, high, share)
        wanted = share * np.clip(DETECTABLE / distance, 1.0 / MOST, MOST)
        # a stall that is not reached shows nothing, and then too much: half the way between
        between = ((wanted <= low) | (wanted >= high)) & (low > 0.0) & np.isfinite(high)
        wanted = np.where(between, np.sqrt(low * np.where(between, high, 1.0)), wanted)
        grown = np.minimum(wanted, 1.0)
        moved = nearer(best, candidates)
        moved[: 1 + n] = 0.0  # the model and the nuisances themselves
        moved[1 + n :] *= (grown / share)[:, None]
        never, share = hidden & (share > 1.0 - EDGE), grown
    return {name: None if out else float(size)
            for name, out, size in zip(names, never, neutral + share * reach, strict=True)}


def moved_rows(evidence: Evidence, candidates: Bank, moved: FloatArray) -> NDArray:
    """PARAMETERS of every row for one record, moved by nuisances in standard deviations [rows, nuisances]."""
    return with_nuisances(parameter_rows(evidence.flight, candidates), candidates, moved, evidence.flight.power_from)


def with_nuisances(rows: NDArray, candidates: Bank, moved: FloatArray, power_from: str) -> NDArray:
    """The same of rows that are given, changed in place."""
    for nuisance, sizes in zip(candidates.nuisances, moved.T, strict=True):
        if sizes.any():
            nuisance.apply(rows, slice(None), power_from, sizes)
    return rows


def per_deviation(gram: FloatArray, n: int) -> FloatArray:
    """Inner products of rows flown with steps of `n` nuisances (after the first), as of whole deviations."""
    unit = np.ones(len(gram))
    unit[1 : 1 + n] = 1.0 / NUISANCE_STEP
    return np.asarray(gram * unit[:, None] * unit)


def hiding(gram: FloatArray, precision: FloatArray, moved: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nuisances that hide each signature best [rows, n], and the inner products of what these leave [rows, rows].

    Args:
        gram: of signatures, flown with nuisances `moved` [rows, n]; after the first those of the nuisances themselves.
        precision: of the nuisances' prior [n, n].
    """
    first = slice(1, 1 + len(precision))
    inner, cross = gram[first, first], gram[:, first]
    best: FloatArray = np.asarray(np.linalg.solve(inner + precision, (moved @ inner - cross).T).T, np.float64)
    step = best - moved
    along = cross @ step.T
    return best, np.asarray(gram + along + along.T + step @ inner @ step.T + best @ precision @ best.T)
