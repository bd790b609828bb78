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
from sim2real.actuators.paths import path_gram
from sim2real.baseline.references import Baseline
from sim2real.flown.settling import nearer
from sim2real.library.candidates import NUISANCE_STEP, Bank, Family, parameter_rows
from sim2real.posterior.singles import DETECTABLE, EffectFit
from sim2real.records.side_by_side import each
from sim2real.signatures.evidence import Evidence, compare
from sim2real.signatures.whitening import SETTLE

ROUNDS = 5  # times that all are flown
MOST = 3.0  # times by which a size is changed at once
EDGE = 1e-6  # of a range
SETTLED = 0.02  # of a size, by which the last flight changes it


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
    inner = np.sum([e.gram[1 : 1 + n, 1 : 1 + n] for e in evidences], axis=0) / NUISANCE_STEP**2 / tempering
    moved, low, high = np.zeros((len(names), n)), np.zeros(len(names)), np.full(len(names), np.inf)
    never, left = np.zeros(len(names), bool), np.arange(len(names))
    for turn in range(ROUNDS):
        own = tuple(replace(families[i], nodes=(neutral[i] + share[i] * reach[i],), rows=(1 + k,))
                    for k, i in enumerate(left))
        gram, cross = _signatures(evidences, candidates, own, moved[left])
        best, beyond = hiding(inner, cross / tempering, gram / tempering, baseline.precision, moved[left])
        distance = np.sqrt(np.maximum(np.diag(beyond), 1e-12))
        hidden = distance < DETECTABLE
        low[left] = np.where(hidden, share[left], low[left])
        if turn > 0:  # at first nuisances do not hide as much as they can
            high[left] = np.where(hidden, high[left], share[left])
        wanted, lower, upper = share[left] * np.clip(DETECTABLE / distance, 1.0 / MOST, MOST), low[left], high[left]
        # a stall that is not reached shows nothing, and then too much: half the way between
        between = ((wanted <= lower) | (wanted >= upper)) & (lower > 0.0) & np.isfinite(upper)
        wanted = np.where(between, np.sqrt(lower * np.where(between, upper, 1.0)), wanted)
        grown = np.minimum(wanted, 1.0)
        ratio = grown / share[left]
        moved[left] = nearer(best, candidates) * ratio[:, None]
        never[left], share[left] = hidden & (share[left] > 1.0 - EDGE), grown
        left = left[(np.abs(ratio - 1.0) > SETTLED) | (turn == 0)]
        if not len(left):
            break
    return {name: None if out else float(size)
            for name, out, size in zip(names, never, neutral + share * reach, strict=True)}


def _signatures(evidences: Sequence[Evidence], candidates: Bank, families: tuple[Family, ...], moved: FloatArray
                ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Inner products of some effects' signatures [m, m], and theirs with a deviation of each nuisance [m, n].

    What a deviation makes of the records is known from where the variants were flown.

    Args:
        families: flown at their one node, rows 1 to m.
        moved: nuisances of each [m, n].
    """
    n, rows = moved.shape[1], range(1, 1 + len(families))
    alone = replace(candidates, nuisances=(), families=families, terms=(), size=1 + len(families))
    only = replace(candidates, families=(), terms=(), size=1 + n)

    def of_record(e: Evidence) -> tuple[FloatArray, FloatArray]:
        own = with_nuisances(parameter_rows(e.flight, alone), candidates, np.vstack([np.zeros(n), moved]),
                             e.flight.power_from)
        found = compare(e.flight, own, e.gain, e.factor, keep=rows)
        of_paths = path_gram(e.flight, np.concatenate([own, parameter_rows(e.flight, only)[1:]]), (),
                             round(SETTLE / e.flight.dt))[1 : len(own), len(own) :]  # fmt: skip
        return found.gram[1:, 1:], (found.rows.T @ e.rows[:, :n] + of_paths) / NUISANCE_STEP

    grams, across = zip(*each(of_record, evidences), strict=True)
    return np.sum(grams, axis=0), np.sum(across, axis=0)


def with_nuisances(rows: NDArray, candidates: Bank, moved: FloatArray, power_from: str) -> NDArray:
    """PARAMETERS of rows moved by nuisances in standard deviations [rows, nuisances], changed in place."""
    for nuisance, sizes in zip(candidates.nuisances, moved.T, strict=True):
        if sizes.any():
            nuisance.apply(rows, slice(None), power_from, sizes)
    return rows


def per_deviation(gram: FloatArray, n: int) -> FloatArray:
    """Inner products of rows flown with steps of `n` nuisances (after the first), as of whole deviations."""
    unit = np.ones(len(gram))
    unit[1 : 1 + n] = 1.0 / NUISANCE_STEP
    return np.asarray(gram * unit[:, None] * unit)


def hiding(inner: FloatArray, cross: FloatArray, gram: FloatArray, precision: FloatArray, moved: FloatArray
           ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Nuisances that hide each signature best [rows, n], and the inner products of what these leave [rows, rows].

    Args:
        inner: inner products of what a deviation of each nuisance makes [n, n].
        cross, gram: of signatures, flown with nuisances `moved` [rows, n], with these and with one another.
        precision: of the nuisances' prior [n, n].
    """
    best: FloatArray = np.asarray(np.linalg.solve(inner + precision, (moved @ inner - cross).T).T, np.float64)
    step = best - moved
    along = cross @ step.T
    return best, np.asarray(gram + along + along.T + step @ inner @ step.T + best @ precision @ best.T)
