"""How well the model flies an aircraft once its numbers are at their best: as reference flights tell.

Derivatives that bend, jump or remember, and a propeller's chart that is another, disturb the states and the readings
of every flight. Counted as noise on flights without a gap, they are proof of nothing on others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from icing_env.record import FloatArray
from sim2real.library.candidates import Bank
from sim2real.posterior.attribution import reduce, with_prior
from sim2real.posterior.generic import fit_unknown
from sim2real.prediction.gusts import LATER, Kind
from sim2real.prediction.kalman import Gain, gains
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.evidence import Evidence, gather
from sim2real.signatures.gust_intensity import SIGMAS, likelihoods
from sim2real.signatures.tempering import total

BATCHES = (100, 30, 10, 4)  # into which a flight is cut
CHANCE = 1e-3  # that white noise has such a ratio
WALKS = (1.0, 3.0, 10.0, 30.0, 100.0)  # times `kalman.WALK`
OF_REFERENCES = WALKS[:-1]  # more of it would pass for gusts, or gusts for it


def walk(flights: Sequence[Reconstruction], kind: Kind) -> float:
    """The likeliest of OF_REFERENCES in gusts of a kind, whatever their intensity in each flight."""
    return max(OF_REFERENCES, key=lambda times: sum(_likely(f, times, kind) for f in flights))


def _likely(flight: Reconstruction, times: float, kind: Kind) -> float:
    """Log likelihood of a sample in the likeliest gusts of a kind."""
    disturbed = replace(flight, inadequacy=replace(flight.inadequacy, walk=times))
    return max(likelihoods(disturbed, gains(disturbed, SIGMAS if kind == LATER else SIGMAS[::2], kind)))


def colour(evidences: Sequence[Evidence]) -> tuple[dict[str, float], dict[str, float]]:
    """Long-run variance of every channel's whitened innovations, all flights together, where it is above one.

    What a mean of many of them is worth less than of white noise, by batch means over ever longer batches (Law &
    Kelton, Simulation Modeling and Analysis); a ratio counts where chance would hardly make it.

    Returns:
        That of changes within a flight, and how many times as much that of a flight's mean is.
    """
    within, means = dict[str, float](), dict[str, float]()
    for c, name in enumerate(MEASURED):
        left = [e.whitened[:, c][e.whitened[:, c] != 0.0] for e in evidences]
        left = [series for series in left if len(series) > BATCHES[0]]
        away = [series - np.mean(series) for series in left]
        if found := [ratio for ratio in (_beyond_chance(away, parts) for parts in BATCHES) if ratio > 1.0]:
            within[name] = max(found)
        if (ratio := _beyond_chance(left, 1) / within.get(name, 1.0)) > 1.0:
            means[name] = ratio
    return within, means


def _beyond_chance(flights: Sequence[FloatArray], parts: int) -> float:
    """Variance of means over batches, `parts` of a flight, times their length; one where chance may have made it."""
    if not flights:
        return 1.0
    means = [np.sqrt(len(batch)) * np.mean(batch) for series in flights for batch in np.array_split(series, parts)]
    free = len(flights) * max(parts - 1, 1)
    ratio = float(np.sum(np.square(means))) / free
    return ratio if free * ratio > chi2.isf(CHANCE, free) else 1.0


def clean(flights: Sequence[Reconstruction], known: Sequence[Gain], candidates: Bank, precision: FloatArray
          ) -> dict[str, float]:  # fmt: skip
    """Log evidence of generic terms of every component on flights without a gap, where they have any.

    That of all flights together or of each by itself, whichever is more: what bends between many conditions is
    straight over a few.
    """
    only, nothing = replace(candidates, families=()), np.zeros_like(precision)
    evidences = [gather(flight, only, gain) for flight, gain in zip(flights, known, strict=True)]

    def explained(some: Sequence[Evidence]) -> dict[str, float]:
        gram = with_prior(total(some), only, precision, np.zeros(len(precision)))
        return {u.component: max(u.log_evidence, 0.0) for u in fit_unknown(reduce(gram, only, nothing), only)}

    together, alone = explained(evidences), [explained([evidence]) for evidence in evidences]
    return {name: max(log, sum(one.get(name, 0.0) for one in alone)) for name, log in together.items()}
