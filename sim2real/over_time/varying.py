"""A gap that no one size of any effect explains: an effect whose size is another elsewhere, or changes in time.

Ice that grows, or a bias that wanders, is something unknown to all that has one size, and the same generic terms in
time may follow it. Where there is a gap for certain, and something unknown is likeliest, alone or beside one effect,
that one, the likeliest of those alone and every other that enters where the unknown does are flown with a size for each
stretch of every record; their departures from a common size are Gaussian (see `over_time.by_stretch`), and what so many
numbers take by luck they pay for. Where a second one so varying says it as well, no effect is told by it: what is known
is that something there varies in time, and that is unknown.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.baseline.references import Baseline
from sim2real.flown.companions import CERTAIN
from sim2real.flown.steps import FARTHEST
from sim2real.library.candidates import Bank, Family, piece_at, shifted, unbroken
from sim2real.over_time.by_stretch import Way, cut_up, flown_products, gaussian, inwards, ways, without
from sim2real.over_time.history import SPREADS
from sim2real.posterior.any_delay import is_delay
from sim2real.posterior.form import forgiven
from sim2real.posterior.generic import COURSE, UnknownFit
from sim2real.posterior.hypotheses import Hypothesis, Posterior, Settled, normalised
from sim2real.posterior.sets import SetFit
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.courses import projected
from sim2real.signatures.evidence import Evidence
from sim2real.signatures.tempering import noise

ROUNDS = 3  # times that the sizes are flown
STEP = 0.05  # of the typical size, for slopes
REACH = 2.5  # typical sizes: standard deviation of the common one (assumed)
# Prior probability that a size varies so much that one size explains nothing (assumed): what goes with speed, and is
# another in every record for that, is rather something unknown.
VARIES = 0.01
UNSURE = 0.015  # of the log evidence of a free course, by which that of another component may be too small (assumed)


@dataclass(frozen=True)
class _Fit:
    """Sizes of one effect [T] and nuisances [n]; log evidence but for that of nothing at all, and square left over."""

    sizes: FloatArray
    nuisances: FloatArray
    log: float
    left: float
    error: float  # of the mean size


def varying(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence], baseline: Baseline,
            posterior: Posterior, centre: FloatArray) -> Posterior:  # fmt: skip
    """The posterior with effects of varying size where something unknown is likeliest, alone or beside one effect.

    Args:
        flights: the diagnosed records about the baseline.
        candidates, evidences: what was flown along them.
        baseline: the model and its precision.
        posterior: what the records say of effects of one size.
        centre: nuisances [n] that the variants were flown about.
    """
    best = posterior.best
    if posterior.none > CERTAIN or best.unknown is None or len(best.effects) > 1 or is_delay(best.unknown):
        return posterior  # of what is late, one number says all
    cuts = [cut_up(flight) for flight in flights]
    if len(tried := ways(flights, cuts)[1:]) == 0:  # one short record
        return posterior
    alone = [h for h in posterior.hypotheses if h.unknown is None and len(h.effects) == 1]
    likeliest = max(alone, key=lambda h: h.log_posterior).effects if alone else ()
    places = _places(best.unknown, posterior.courses)
    home = [f for f in unbroken(candidates.families) if f.effect.name in posterior.fits
            and (places & set(f.effect.enters_at) or f.effect.name in best.effects + likeliest)]
    flying = _Flying(flights, candidates, evidences, baseline, posterior.tempering, cuts, tried)
    found = [(f, flying.fitted(f, centre)) for f in home]
    nothing = float(posterior.reduced[0, 0])
    least = min(noise(evidences, posterior.tempering), *(h.left for h in posterior.hypotheses),
                *(fit.left for _, fit in found))  # fmt: skip
    single = max((h.log_prior for h in posterior.hypotheses if len(h.effects) == 1), default=-np.inf)
    varied = [_hypothesis(candidates, family, fit, single + float(np.log(VARIES)), nothing, least)
              for family, fit in found]
    told = {h.effects: h for h in posterior.hypotheses if h.unknown is None}
    told |= {h.effects: h for h in varied
             if h.effects not in told or h.log_posterior > told[h.effects].log_posterior}  # fmt: skip
    worth = [h.log_evidence + h.regained for h in varied]
    first = home[int(np.argmax(worth))].effect.enters_at if worth else ()
    unknown = _or_any(_placed(best, first, places, posterior.courses), worth)
    others = [unknown if h is best else h for h in posterior.hypotheses if h.unknown is not None]
    return replace(posterior, hypotheses=normalised([*told.values(), *others], 0.0))


def _hypothesis(candidates: Bank, family: Family, fit: _Fit, prior: float, nothing: float, least: float) -> Hypothesis:
    """An effect whose size varies; what it leaves above `least` is forgiven as far as it explains `nothing`."""
    log = fit.log + 0.5 * nothing
    return Hypothesis(_set_fit(candidates, family, fit, log), None, prior, log,
                      regained=forgiven(fit.left - least, nothing - fit.left),
                      settled=Settled(fit.nuisances, np.eye(len(fit.nuisances))), varies=True)  # fmt: skip


def _places(unknown: UnknownFit, courses: Sequence[UnknownFit]) -> set[str]:
    """Components where an effect that varies may be what is unknown: there, and where a free course says about as much.

    Courses go through a linear response: of what a large one explains, it is off by a hundredth and more.
    """
    if unknown.terms[0][0] != COURSE:
        return {unknown.component}
    said = {course.component: course.log_evidence for course in courses}
    enough = (1.0 - UNSURE) * max(said.values(), default=np.inf)
    return {unknown.component} | {component for component, log in said.items() if log > enough}


def _placed(best: Hypothesis, entered: Sequence[str], places: Collection[str], courses: Sequence[UnknownFit]
            ) -> Hypothesis:  # fmt: skip
    """Something unknown where courses say it is, and of these places where the likeliest of what varies enters.

    Args:
        entered: components where that one enters.
        places: of `_places`.
    """
    if best.unknown is None or best.unknown.component in entered:
        return best
    there = [course for course in courses if course.component in set(entered) & set(places)]
    if not there:
        return best
    course = max(there, key=lambda course: course.log_evidence)
    return replace(best, unknown=replace(course, log_evidence=best.unknown.log_evidence, misfit=best.unknown.misfit))


def _or_any(unknown: Hypothesis, worth: Sequence[float]) -> Hypothesis:
    """Something unknown, as good as the second best of the effects that vary: `worth` of each, log evidence."""
    if len(worth) < 2:
        return unknown
    return replace(unknown, log_evidence=max(unknown.log_evidence, sorted(worth)[-2] - unknown.regained))


def _set_fit(candidates: Bank, family: Family, fit: _Fit, log: float) -> SetFit:
    """An effect at its mean size."""
    p, mean = family.parameter, float(np.mean(fit.sizes))
    own = piece_at(family, mean, candidates.families)
    low, high = (float(np.clip(mean + side * 1.96 * fit.error, p.low, p.high)) for side in (-1.0, 1.0))
    return SetFit((own,), log, (mean,), (low,), (high,), np.array([[fit.error**2]]), None, fit.left)


@dataclass(frozen=True)
class _Flying:
    """What flying sizes by stretch along some records takes; `tried`: ways in which sizes may differ."""

    flights: Sequence[Reconstruction]
    candidates: Bank
    evidences: Sequence[Evidence]
    baseline: Baseline
    tempering: float
    cuts: Sequence[NDArray[np.intp]]
    tried: Sequence[Way]

    def fitted(self, family: Family, centre: FloatArray) -> _Fit:
        """Sizes of one effect for every stretch, by Gauss and Newton from none, each step flown anew."""
        p, n, counts = family.parameter, len(centre), [len(cut) - 1 for cut in self.cuts]
        at = np.cumsum(counts)[:-1]
        sizes, nuisances = np.full(sum(counts), p.neutral), np.clip(centre, -FARTHEST, FARTHEST)
        step = STEP * (p.typical or 0.25 * (p.high - p.low))
        for _ in range(ROUNDS):
            own = np.split(sizes, at)
            signs = inwards(sizes, step, p.low, p.high)
            rows = [_rows(flight, self.candidates, nuisances, family, s, step * sign)
                    for flight, s, sign in zip(self.flights, own, np.split(signs, at), strict=True)]
            gram = flown_products(self.evidences, rows, self.cuts, signs, self.baseline.precision, nuisances,
                                  self.tempering)  # fmt: skip
            found = _best(gram, n, (sizes - p.neutral) / step, self.tried)
            now = np.clip(p.neutral + step * found.sizes, p.low, p.high)
            asked = gram[1 : 1 + n, 0] + gram[1 : 1 + n, 1 + n :] @ (now - sizes) / step
            give = np.linalg.solve(gram[1 : 1 + n, 1 : 1 + n], asked)
            sizes, nuisances = now, np.clip(nuisances - give, -FARTHEST, FARTHEST)
        return replace(found, sizes=sizes, nuisances=nuisances, error=abs(step) * found.error)


def _rows(flight: Reconstruction, candidates: Bank, nuisances: FloatArray, family: Family, sizes: FloatArray,
          steps: FloatArray) -> NDArray:
    """PARAMETERS in every stretch with the effect at its size there, and a step [S] beside it [S, 2]."""
    base = shifted(flight.parameters, candidates.nuisances, nuisances, flight.power_from)
    both = np.stack([sizes, sizes + steps], axis=1)
    values: dict[str, dict[str, float | FloatArray]] = {
        family.effect.name: {**family.effect.neutral(), family.parameter.name: both.ravel()}}
    return effects.with_effects(np.repeat(base, both.size), values).reshape(both.shape)


def _best(gram: FloatArray, n: int, sizes: FloatArray, tried: Sequence[Way]) -> _Fit:
    """Sizes that are likeliest, all in steps from none.

    Args:
        gram: of what is left with `sizes`, nuisances [n], and a step in every stretch.
        tried: ways in which sizes may differ.
    """
    flown = without(projected(gram, 1 + n), sizes)
    logs, fits = [], []
    for way in tried:
        for spread in SPREADS:
            moves = np.column_stack([np.full(len(sizes), REACH), spread * way.columns]) / STEP
            log, mean, covariance = gaussian(flown, moves)
            logs.append(log)
            fits.append((moves @ mean, moves.mean(axis=0) @ covariance @ moves.mean(axis=0)))
    there, variance = fits[int(np.argmax(logs))]
    left = float(flown[0, 0] + 2.0 * there @ flown[1:, 0] + there @ flown[1:, 1:] @ there)
    log = float(logsumexp(logs) - np.log(len(logs)) - 0.5 * flown[0, 0])
    return _Fit(there, np.zeros(n), log, left, float(np.sqrt(variance)))
