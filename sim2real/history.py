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
from scipy.linalg import block_diag

from icing_env.record import FloatArray
from sim2real.by_stretch import cut_up, inner, responses, spans, stepped
from sim2real.candidates import Bank
from sim2real.discrepancy import moved_by
from sim2real.evidence import Evidence
from sim2real.hypotheses import Posterior
from sim2real.reconstruct import Reconstruction
from sim2real.references import Baseline
from sim2real.remedy import Remedy
from sim2real.sets import SetFit, firm
from sim2real.side_by_side import each
from sim2real.steps import ranges, size_steps

# Standard deviations of departures (in time: from end to end of a record), in sizes of the effect (assumed)
SPREADS = (0.1, 0.3, 1.0)
VARIES = 0.1  # prior probability that a size is not the same everywhere (assumed)
SHARED, BY_FLIGHT, BY_RECORD = "shared", "per_flight", "per_record"  # as the interface has them


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


@dataclass(frozen=True)
class Way:
    """One way for a size to depart from the common one: departures of all stretches, one column each [T, q]."""

    scope: str
    in_time: bool
    columns: FloatArray


def histories(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence], baseline: Baseline,
              posterior: Posterior, fit: SetFit, change: Remedy) -> dict[str, History]:  # fmt: skip
    """How every effect of an explanation went along the records.

    Args:
        flights: the diagnosed records about the baseline.
        candidates: what was flown along them.
        evidences: theirs, for gains, whitening, slopes by nuisances, and where the model has been moved to.
        baseline: the model and its precision.
        posterior: what the records say.
        fit: the explanation's effects.
        change: the model's change by these, in the form in which they were found.
    """
    nuisances = posterior.settled
    if nuisances is None:
        nuisances = moved_by(flights[0], evidences[0].flight.parameters, candidates.nuisances)
    cuts = [cut_up(flight) for flight in flights]
    rows = [stepped(flight, candidates, nuisances, fit, change) for flight in flights]
    made = each(responses, evidences, rows, cuts)
    gram = inner(made, baseline.precision, nuisances, posterior.tempering)
    owner = np.repeat(np.arange(len(flights)), [len(cut) - 1 for cut in cuts])
    ways = _ways(owner, [flight.record.meta.flight for flight in flights])
    found = {}
    for m, family in enumerate(fit.families):
        way, departure, spread = _likeliest(gram, m, fit, ways)
        sizes = fit.estimate[m] + departure[:, None] + spread[:, None] * np.array([0.0, -1.96, 1.96])
        sizes = np.clip(sizes, family.parameter.low, family.parameter.high)
        told = tuple(Stretch(*at, *map(float, size)) for at, size in zip(spans(flights, cuts), sizes, strict=True))
        varies = way.scope != SHARED or way.in_time
        found[family.effect.name] = History(way.scope, way.in_time, told if varies else ())
    return found


def _ways(owner: NDArray[np.intp], flights: Sequence[str]) -> list[Way]:
    """Ways of departing from a common size, none of them first; `owner`: record of every stretch [T]."""
    records = np.arange(len(flights))
    flight_of = np.array([flights.index(name) for name in flights])[owner]
    by_flight = (flight_of[:, None] == np.unique(flight_of)).astype(np.float64)
    by_record = (owner[:, None] == records).astype(np.float64)
    in_time = block_diag(*(_random_walk(int(np.sum(owner == i))) for i in records))
    ways = [Way(SHARED, False, np.zeros((len(owner), 0)))]
    if in_time.shape[1]:
        ways.append(Way(SHARED, True, in_time))
    if 1 < by_flight.shape[1] < len(records):
        ways.append(Way(BY_FLIGHT, False, by_flight))
    if len(records) > 1:
        ways.append(Way(BY_RECORD, False, by_record))
        ways += [Way(BY_RECORD, True, np.column_stack([by_record, in_time]))] * (in_time.shape[1] > 0)
    return ways


def _random_walk(stretches: int) -> FloatArray:
    """Departures from their mean, for a unit of each step of a walk that goes as far as one unit in a record."""
    walk = np.tril(np.ones((stretches, stretches - 1)), -1) / np.sqrt(max(stretches - 1, 1))
    return np.asarray(walk - walk.mean(axis=0))


def _likeliest(gram: FloatArray, m: int, fit: SetFit, ways: Sequence[Way]) -> tuple[Way, FloatArray, FloatArray]:
    """Of the `m`-th size: the likeliest way, departures of all stretches from the estimate [T], their standard errors.

    The common sizes of all effects are free to give way.
    """
    k, steps = len(fit.families), size_steps(fit, np.array(fit.estimate))
    count = (len(gram) - 1) // k
    size = abs(fit.estimate[m] - fit.families[m].parameter.neutral)
    tried = list[tuple[float, Way, FloatArray, FloatArray]]()
    for way in ways:
        prior = np.log(1.0 - VARIES if way is ways[0] else VARIES / (len(ways) - 1) / len(SPREADS))
        for spread in SPREADS if way.columns.shape[1] else SPREADS[:1]:
            moves = np.zeros((count * k, k + way.columns.shape[1]))
            moves[:, :k] = np.tile(np.diag(1.0 / steps), (count, 1))
            moves[m::k, k:] = way.columns / steps[m]
            deviation = np.r_[ranges(fit), np.full(way.columns.shape[1], spread * size)]
            log, mean, covariance = _gaussian(gram, moves * deviation)
            told = np.zeros((count, len(deviation)))
            told[:, m], told[:, k:] = 1.0, way.columns
            told *= deviation
            variance = np.einsum("ti,ij,tj->t", told, covariance, told)
            tried.append((log + prior, way, told @ mean, np.asarray(np.sqrt(variance), np.float64)))
    _, best, departures, errors = max(tried, key=lambda one: one[0])
    return best, departures, errors


def _gaussian(gram: FloatArray, moves: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Log evidence, mean and covariance of unit Gaussian coefficients of `moves` [steps, coefficients]."""
    information = firm(moves.T @ gram[1:, 1:] @ moves) + np.eye(moves.shape[1])
    onto = -moves.T @ gram[1:, 0]
    covariance: FloatArray = np.asarray(np.linalg.inv(information), np.float64)
    mean = covariance @ onto
    return 0.5 * float(onto @ mean) - 0.5 * float(np.linalg.slogdet(information)[1]), mean, covariance
