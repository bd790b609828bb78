"""An aircraft whose downwash does not lag: published sets that are quasi-steady, taken at their word.

UIUC's set and those of NASA's flights have the moment of the lagging downwash within Cm_q. The model takes it out
(Cm_alphadot of JSBSim's aircraft, their sum kept); a simulator that was built on such a set by itself has no lag at
all. That is another reading of the same source, and no gap: where records show a `downwash_lag` that undoes the lag,
they are diagnosed again about a model without it, and so they are where the best explanation has that lag among several
causes, three of which one is in pitch, an unknown one there, or needs less of that lag than it is believed to be
uncertain by, if that model then needs fewer.
"""

from __future__ import annotations

from dataclasses import replace

from icing_env import aircraft
from icing_env.record import FloatArray
from sim2real.baseline.references import Baseline
from sim2real.library.candidates import Bank
from sim2real.posterior.hypotheses import Posterior
from sim2real.records.reconstruct import Reconstruction

EFFECT, NUMBER, PITCH = "downwash_lag", "Cm_alphadot", "pitching_moment"
UNDONE, KNOWN = 0.15, 0.1  # share of the lag that may be left, and to which the records tell it (assumed)
LOSES = 1.1  # times what the best explanation left: a model that leaves more has lost the records (assumed)
FAR = -3.0  # deviations of that number, below which an explanation needs less lag than is believed (assumed)
NOTE = "the downwash does not lag, as in a quasi-steady set of derivatives taken by itself: no gap"


def undoes_the_lag(posterior: Posterior, baseline: Baseline) -> bool:
    """Whether the best explanation takes the whole lag away."""
    published = abs(float(baseline.parameters[NUMBER][0]))
    fit = posterior.best.fit
    if published == 0.0 or EFFECT not in fit.effects or posterior.effects[EFFECT] < 0.5:
        return False
    at = fit.effects.index(EFFECT)
    left = abs(fit.estimate[at] - published)
    error = 0.25 * (fit.high95[at] - fit.low95[at])
    return left < UNDONE * published and error < KNOWN * published


def worth_trying(posterior: Posterior, baseline: Baseline, candidates: Bank) -> bool:
    """Whether a model without the lag may say it more simply.

    Several causes with that lag among them, three with one in pitch, something unknown there, or much less lag.
    """
    best = posterior.best
    if not float(baseline.parameters[NUMBER][0]):
        return False
    if best.unknown is not None and best.unknown.component == PITCH:
        return True
    if best.things and best.settled is not None:
        uncertain = [nuisance.name for nuisance in candidates.nuisances]
        if best.settled.nuisances[uncertain.index(NUMBER)] < FAR:
            return True
    places = {place for family in best.fit.families for place in family.effect.enters_at}
    return (best.things > 1 and EFFECT in best.effects) or (best.things > 2 and PITCH in places)


def simpler(now: Posterior, before: Posterior, precision: FloatArray) -> bool:
    """Whether the best explanation has fewer causes, or as many and no unknown one any more, or numbers far less odd.

    None that puts the lag back: an aircraft that has it is told about the model that has it. Nor one that leaves far
    more of the records, with noise and gusts judged as that model has them.

    Args:
        now, before: what is told about the model without the lag, and about the one that has it.
        precision: of the numbers' prior.
    """
    left, least = (told.best.left * told.tempering for told in (now, before))
    if left > LOSES * least or EFFECT in now.best.effects:
        return False
    known = now.best.unknown is None and before.best.unknown is not None
    return now.best.things < before.best.things + known or (
        now.best.things == before.best.things and oddness(now, precision) < oddness(before, precision) - FAR**2)


def oddness(posterior: Posterior, precision: FloatArray) -> float:
    """Square of how far the numbers beside the best explanation are from published ones, in prior deviations."""
    settled = posterior.best.settled
    return 0.0 if settled is None else float(settled.nuisances @ precision @ settled.nuisances)


def without_lag(baseline: Baseline) -> Baseline:
    """The same model, quasi-steady."""
    row = baseline.parameters.copy()
    row[NUMBER] = 0.0
    return replace(baseline, parameters=row)


def lacks_the_lag(flight: Reconstruction) -> bool:
    """Whether the model along a record is the quasi-steady one."""
    return bool(flight.parameters[NUMBER][0] == 0.0 != aircraft.load()[NUMBER][0])
