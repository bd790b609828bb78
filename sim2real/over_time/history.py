"""How the size of a diagnosed effect went: one in all records, another in every flight or record, or changing in time.

Ice grows and leaves; a bias wanders; what is diagnosed as one size may be the mean of many. Every effect is flown once
more with its size a little off during one stretch of a record alone, and passed through the same filter as the record.
Departures of stretches from the common size are Gaussian, by flight or by record, or in time as a random walk; what
says most about the records is told, by evidence in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.baseline.references import Baseline
from sim2real.closing.discrepancy import Description, moved_by
from sim2real.closing.remedy import Remedy
from sim2real.flown.steps import ranges, size_steps
from sim2real.library.candidates import Bank, shifted
from sim2real.over_time.by_stretch import SHARED, Way, cut_up, flown_products, gaussian, inwards, spans, ways, without
from sim2real.posterior.hypotheses import Posterior
from sim2real.posterior.sets import SetFit
from sim2real.posterior.widened import SIZES
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.courses import projected
from sim2real.signatures.evidence import Evidence

# Standard deviations of departures (in time: from end to end of a record), in sizes of the effect (assumed)
SPREADS = (0.1, 0.3, 1.0)
ROUNDS = 3  # times that sizes which vary are flown
VARIES = 0.1  # prior probability that a size is not the same everywhere (assumed)
INEXACT = 0.01  # of a size: what no model is exact enough to tell a change by, stretch by stretch (assumed)


@dataclass(frozen=True)
class Stretch:
    """The size of an effect from one time to another (s, of the record's own clock) of a record (its index)."""

    record: int
    start: float
    end: float
    estimate: float
    low95: float
    high95: float


@dataclass(frozen=True)
class History:
    """Where the size of an effect is the same (`scope`), and its stretches where it is not the same everywhere."""

    scope: str = SHARED
    in_time: bool = False
    stretches: tuple[Stretch, ...] = ()

    def answer(self) -> dict[str, Any]:
        """As the interface has it; `sizes`: by stretch of every record, with intervals."""
        course = [[0.5 * (s.start + s.end), s.estimate] for s in self.stretches]
        return {"scope": self.scope, "history": course if self.in_time else None,
                "sizes": [asdict(s) for s in self.stretches] or None}  # fmt: skip


SAME = History()


def histories(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence], baseline: Baseline,
              posterior: Posterior, fit: SetFit, change: Remedy, described: Description | None = None
              ) -> dict[str, History]:  # fmt: skip
    """How every effect of an explanation went along the records.

    Args:
        flights: the diagnosed records about the baseline.
        candidates: what was flown along them.
        evidences: theirs, for gains, whitening, slopes by nuisances, and where the model has been moved to.
        baseline: the model and its precision.
        posterior: what the records say.
        fit: the explanation's effects.
        change: the model's change by these, in the form in which they were found.
        described: the terms of that form, with where the model's own numbers settled beside them.
    """
    beside = None if described is None else described.settled
    nuisances = posterior.settled if beside is None else beside.nuisances
    if nuisances is None:
        nuisances = moved_by(flights[0], evidences[0].flight.parameters, candidates.nuisances)
    cuts = [cut_up(flight) for flight in flights]
    counts = [len(cut) - 1 for cut in cuts]
    estimate, steps = np.array(fit.estimate), size_steps(fit, np.array(fit.estimate))
    low, high = (np.array([getattr(f.parameter, end) for f in fit.families]) for end in ("low", "high"))
    tried, found = ways(flights, cuts), list[tuple[Way, FloatArray, FloatArray]]()
    sizes, at = np.tile(estimate, (sum(counts), 1)), np.cumsum(counts)[:-1]
    for _ in range(ROUNDS):
        signs = inwards(sizes, steps, low, high)
        rows = [_stepped(flight, candidates, nuisances, fit, change, own, steps * sign)
                for flight, own, sign in zip(flights, np.split(sizes, at), np.split(signs, at), strict=True)]
        gram = flown_products(evidences, rows, cuts, signs, baseline.precision, nuisances, posterior.tempering)
        gram = projected(gram, 1 + len(nuisances))
        gram = without(gram, ((sizes - estimate) / steps).ravel())
        found = [_likeliest(gram, m, fit, tried) for m in range(len(steps))]
        sizes = np.clip(estimate + np.column_stack([departure for _, departure, _ in found]), low, high)
        if all(way is tried[0] for way, _, _ in found):
            break
    out = {}
    for m, (family, (way, _, error)) in enumerate(zip(fit.families, found, strict=True)):
        band = np.clip(sizes[:, m, None] + SIZES * error[:, None] * np.array([0.0, -1.96, 1.96]), low[m], high[m])
        told = tuple(Stretch(*at, *map(float, size)) for at, size in zip(spans(flights, cuts), band, strict=True))
        out[family.effect.name] = History(way.scope, way.in_time, told if way is not tried[0] else ())
    return out


def _stepped(flight: Reconstruction, candidates: Bank, nuisances: FloatArray, fit: SetFit, change: Remedy,
             sizes: FloatArray, steps: FloatArray) -> NDArray:  # fmt: skip
    """PARAMETERS with the explanation at `sizes` [S, k] by stretch: as it is, then a step [S, k] of each [S, 1 + k]."""
    base = shifted(flight.parameters, candidates.nuisances, nuisances, flight.power_from)
    steps = np.concatenate([np.zeros_like(steps)[:, None], steps[:, None] * np.eye(len(fit.families))], axis=1)
    moved = sizes[:, None, :] + steps
    values: dict[str, dict[str, float | FloatArray]] = {name: {**own} for name, own in change.values.items()}
    for m, family in enumerate(fit.families):
        values[family.effect.name][family.parameter.name] = moved[:, :, m].ravel()
    return effects.with_effects(np.repeat(base, moved[:, :, 0].size), values).reshape(moved.shape[:2])


def _likeliest(gram: FloatArray, m: int, fit: SetFit, tried: Sequence[Way]) -> tuple[Way, FloatArray, FloatArray]:
    """Of the `m`-th size: the likeliest way, departures of all stretches from the estimate [T], their standard errors.

    The common sizes of all effects are free to give way, and every stretch by what is INEXACT, in any way.
    """
    k, steps = len(fit.families), size_steps(fit, np.array(fit.estimate))
    count = (len(gram) - 1) // k
    size = abs(fit.estimate[m] - fit.families[m].parameter.neutral)
    found = list[tuple[float, Way, FloatArray, FloatArray]]()
    for way in tried:
        prior = np.log(1.0 - VARIES if way is tried[0] else VARIES / (len(tried) - 1) / len(SPREADS))
        own = way.columns.shape[1]
        for spread in SPREADS if own else SPREADS[:1]:
            moves = np.zeros((count * k, k + own + count))
            moves[:, :k] = np.tile(np.diag(1.0 / steps), (count, 1))
            moves[m::k, k:] = np.hstack([way.columns, np.eye(count)]) / steps[m]
            deviation = np.r_[ranges(fit), np.full(own, spread * size), np.full(count, INEXACT * size)]
            log, mean, covariance = gaussian(gram, moves * deviation)
            told = np.zeros((count, len(deviation)))
            told[:, m], told[:, k : k + own] = 1.0, way.columns
            told *= deviation
            variance = np.einsum("ti,ij,tj->t", told, covariance, told)
            found.append((log + prior, way, told @ mean, np.asarray(np.sqrt(variance), np.float64)))
    _, best, departures, errors = max(found, key=lambda one: one[0])
    return best, departures, errors
