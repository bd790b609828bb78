"""Valleys along which an effect and the uncertainty of the numbers that it changes trade places.

A lift slope 29 % low, and one 2 % low of a model whose own is five deviations low, fly alike; what parts them is what
is believed of the model beforehand. Such a valley is curved, (1 + change)(1 + deviation) stays what it is, so that
steps of Gauss and Newton leave it. Its lowest place needs no flight: it is where the same numbers are likeliest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.flown.steps import FARTHEST, Place
from sim2real.library.bends import changes
from sim2real.library.candidates import Bank
from sim2real.posterior.sets import SetFit
from sim2real.records.reconstruct import Reconstruction

TRIED = 121  # sizes between the ends of a range
GAIN = 0.5  # gain of log prior that makes another place worth a flight


def lowest(flight: Reconstruction, candidates: Bank, precision: FloatArray, fit: SetFit, place: Place) -> Place | None:
    """Sizes and nuisances that make the same numbers of the aircraft, and are likelier; None if there are none.

    Args:
        precision: of the nuisances' prior [n, n].
        place: sizes [k] and nuisances [n] of the set.
    """
    found = place
    for m in range(len(fit.families)):
        found = _along_one(flight, candidates, precision, fit, found, m)
    return None if found is place else found


def _along_one(flight: Reconstruction, candidates: Bank, precision: FloatArray, fit: SetFit, place: Place,
               m: int) -> Place:
    """The same along the valley of one member."""
    sizes, nuisances = place
    parameter, changed = fit.families[m].parameter, changes(fit.families[m].effect)
    touched = [j for j, nuisance in enumerate(candidates.nuisances) if nuisance.parameter in changed]
    if not touched:
        return place
    tried = np.tile(sizes, (TRIED, 1))
    tried[:, m] = np.linspace(parameter.low, parameter.high, TRIED)
    now, none, one = (_numbers(flight, candidates, fit, *at, touched) for at in (
        (sizes[None], nuisances[touched]), (tried, np.zeros(len(touched))), (tried, np.ones(len(touched)))))
    moves = np.abs(one - none) > 1e-12
    own = np.where(moves, (now - none) / np.where(moves, one - none, 1.0), nuisances[touched])
    whole = np.tile(nuisances, (TRIED, 1))
    whole[:, touched] = own
    prior = 0.5 * np.einsum("si,ij,sj->s", whole, precision, whole)
    prior[np.any(np.abs(own) > FARTHEST, axis=1)] = np.inf
    best = int(np.argmin(prior))
    if prior[best] > 0.5 * nuisances @ precision @ nuisances - GAIN:
        return place
    return tried[best], whole[best]


def _numbers(flight: Reconstruction, candidates: Bank, fit: SetFit, sizes: FloatArray, nuisances: FloatArray,
             touched: list[int]) -> FloatArray:
    """Those numbers of the aircraft that some nuisances change [sizes, touched]; the others are where they are."""
    rows: NDArray = np.repeat(flight.parameters, len(sizes))
    for j, size in zip(touched, nuisances, strict=True):
        candidates.nuisances[j].apply(rows, slice(None), flight.power_from, float(size))
    rows = effects.with_effects(rows, {f.effect.name: {f.parameter.name: sizes[:, i]}
                                       for i, f in enumerate(fit.families)})  # fmt: skip
    return np.column_stack([rows[candidates.nuisances[j].parameter] for j in touched])
