"""How far the model's own numbers are off in this aircraft: as published sets differ, or a multiple of that.

The published spread of derivatives is itself a guess. Where it is too small, numbers that are off as a whole look like
a gap in whichever number is off most. Evidence decides between a few multiples, all explanations counted (type II
maximum likelihood: MacKay, Neural Computation 4(3), 1992): one number that is far off is an effect, for the others pay
for a wider prior of all; thirty that are off by half as much again are that. Where there is a gap even so, that is
asked once an explanation was flown and the numbers settled beside it: before, what an explanation leaves, another form
or a response that bends, would pass for numbers off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from icing_env.types import DERIVATIVE_NAMES
from sim2real.baseline.references import Baseline
from sim2real.library.candidates import NUISANCE_STEP, Bank
from sim2real.posterior.attribution import with_prior
from sim2real.posterior.hypotheses import Posterior, Settled

SPREADS = {1.0: 0.9, 1.5: 0.07, 2.0: 0.03}  # times the published spread, and how probable beforehand (assumed)
WORTH_WEIGHING = 20.0  # log evidence that explanations may add to what no gap says of a spread (assumed)


def likeliest(gram: FloatArray, candidates: Bank, baseline: Baseline, centre: FloatArray, before: Posterior,
              weighed: Callable[[Baseline], Posterior]) -> Baseline:  # fmt: skip
    """The baseline with the spread that explains the records best, if there is no gap then.

    As it is where reference flights told it.

    Args:
        gram: inner products of all records, tempered, without a prior.
        candidates, centre: what was flown, and nuisances [n] by which the model had been moved.
        before: what the records say with the spread of `baseline`.
        weighed: what they say with that of another.
    """
    if baseline.spread is None:
        return baseline
    best, most = baseline, _evidence(gram, candidates, baseline, centre, before)
    for spread in sorted(SPREADS.keys() - {baseline.spread}):
        other = of_spread(baseline, candidates, spread)
        if _nothing(gram, candidates, other, centre) + WORTH_WEIGHING > most:
            posterior = weighed(other)
            told = _evidence(gram, candidates, other, centre, posterior)
            if told > most and posterior.none > 0.5:
                best, most = other, told
    return best


def spread_beside(settled: Settled, candidates: Bank, baseline: Baseline) -> float:
    """How many times the published spread the numbers ask for that settled in flight beside an explanation.

    What was flown is taken as quadratic there.
    """
    at, flown = settled.nuisances, np.linalg.inv(settled.covariance)

    def told(spread: float) -> float:
        precision = of_spread(baseline, candidates, spread).precision
        less = precision - baseline.precision
        cost = 0.5 * at @ less @ np.linalg.solve(flown + less, flown @ at)
        room = np.linalg.slogdet(flown + less)[1] - np.linalg.slogdet(precision)[1]
        return float(np.log(SPREADS[spread]) - cost - 0.5 * room)

    return max(SPREADS, key=told)


def of_spread(baseline: Baseline, candidates: Bank, spread: float) -> Baseline:
    """The baseline with derivatives that are uncertain by so many times the published spread."""
    if baseline.spread is None:
        raise ValueError("reference flights say how well this model is known")
    less = np.where(_derivatives(candidates), baseline.spread / spread, 1.0)
    return replace(baseline, precision=baseline.precision * np.outer(less, less), spread=spread)


def _derivatives(candidates: Bank) -> NDArray[np.bool_]:
    """Which nuisances are derivatives [n]."""
    return np.array([n.name in DERIVATIVE_NAMES for n in candidates.nuisances])


def _evidence(gram: FloatArray, candidates: Bank, baseline: Baseline, centre: FloatArray, posterior: Posterior
              ) -> float:  # fmt: skip
    """Log evidence of a spread, all explanations counted; but for a constant."""
    none = max((h for h in posterior.hypotheses if not h.things), key=lambda h: h.log_posterior)
    return _nothing(gram, candidates, baseline, centre) - float(np.log(max(none.probability, 1e-300))) + none.log_prior


def _nothing(gram: FloatArray, candidates: Bank, baseline: Baseline, centre: FloatArray) -> float:
    """The same without any gap."""
    nuisances = np.arange(1, 1 + len(candidates.nuisances))
    full = with_prior(gram, candidates, baseline.precision, centre)
    inner, onto = full[np.ix_(nuisances, nuisances)], full[nuisances, 0]
    square = float(full[0, 0] - onto @ np.linalg.solve(inner, onto))
    room = np.linalg.slogdet(inner / NUISANCE_STEP**2)[1] - np.linalg.slogdet(baseline.precision)[1]
    return -0.5 * (square + float(room)) + float(np.log(SPREADS[baseline.spread or 1.0]))
