"""Gusts and the model's own numbers, found together: neither is known without the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.baseline.inadequacy import WALKS
from sim2real.baseline.references import Baseline
from sim2real.flown.points import Flying
from sim2real.library.candidates import NUISANCE_STEP, Bank, shifted
from sim2real.library.pushes import pushes
from sim2real.posterior.attribution import nuisance_mean, reduce, with_prior
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.prediction.as_predicted import as_predicted
from sim2real.prediction.gusts import LATER, Kind
from sim2real.prediction.kalman import Gain, follow
from sim2real.prediction.predictor import Push, innovations
from sim2real.prediction.readings import slow
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.side_by_side import each
from sim2real.signatures.evidence import Evidence, gather
from sim2real.signatures.gust_intensity import (
    SIGMAS,
    STRAIGHT,
    TURNING_KINDS,
    choose_gain,
    kind_of_gusts,
    likelihoods,
    strongest,
    turns,
)
from sim2real.signatures.tempering import temper, total
from sim2real.signatures.whitening import whitening

SETTLING, SETTLED = 6, 10.0  # steps towards the best nuisances, and the whitened length of a step that ends them
NEAR = 2  # of SIGMAS to either side are tried
TURNS = 4
UNLIKE = 0.06  # log of the ratio of innovation variances beyond which another gain is worth a flight (assumed)
DEPARTED = 1e6  # mean whitened square of a model that does not follow the record: an effect far off makes 1e4
ODD = 0.05  # of aircraft, whose numbers are farther off together (assumed)
MOVED = 4.0  # standard deviations by which the model that variants are flown about is moved at most


def settle(flights: Sequence[Reconstruction], candidates: Bank, baseline: Baseline, kind: Kind = LATER
           ) -> tuple[FloatArray, list[Gain]]:  # fmt: skip
    """Nuisances [n] that fit best where there is no gap, and the gains found on the way.

    Gauss-Newton, flown anew at every step, gusts judged anew before each. Both are needed together: what derivatives
    that are off make of a record passes for gust, and stronger gusts than there were let derivatives be off by more
    (two standard deviations in 1.5 m/s, where the noise of the instruments is low).

    Args:
        kind: of the gusts.
    """
    only = replace(candidates, families=(), terms=(), size=1 + len(candidates.nuisances))
    centre = np.zeros(len(candidates.nuisances))
    known = each(_at_first, flights, [kind] * len(flights))
    for k in range(SETTLING):
        evidences = gather_about(flights, only, centre, known)
        gram = with_prior(total(evidences), only, baseline.precision, centre)
        tempering = temper(float(reduce(gram, only, np.zeros_like(baseline.precision))[0, 0]), evidences)
        gram = with_prior(total(evidences) / tempering, only, baseline.precision, centre)
        step = nearer(centre + nuisance_mean(gram, only, {}), only) - centre
        centre = centre + step
        if k > 0 and length(gram, step) < SETTLED:
            break
        known = each(likeliest, about(flights, only, centre), known)
    return centre, known


def _at_first(flight: Reconstruction, kind: Kind) -> Gain:
    """The gain of the record's likeliest gusts, along it where a channel is slow."""
    found = choose_gain(flight, SIGMAS, (), kind)
    return follow(flight, found) if slow(flight) else found.with_start()


class Followed(NamedTuple):
    """Records, and where the model settles that has no gap: its nuisances [n], and the gains of each record."""

    flights: list[Reconstruction]
    centre: FloatArray
    known: list[Gain]

    @property
    def kind(self) -> Kind:
        """That of the gusts."""
        return self.known[0].gusts.kind

    def likelihood(self, candidates: Bank) -> float:
        """Sum of the records' log likelihoods of a sample."""
        return likelihood(about(self.flights, candidates, self.centre), self.known)


def followed(flights: Sequence[Reconstruction], candidates: Bank, baseline: Baseline, kind: Kind = LATER) -> Followed:
    """The records, with the settled model's nuisances and gains; arguments as in `settle`.

    A model that is no longer corrected enough to keep to a record departs from it, and nothing can be told of what
    departs. Its filter has to expect more noise, though some of a gap may pass for that.
    """
    for least in WALKS:
        flights = [replace(f, inadequacy=f.inadequacy.with_walk(least)) for f in flights]
        centre, known = settle(flights, candidates, baseline, kind)
        if not departs(model_alone(flights, candidates, centre, known)):
            break
    return Followed(list(flights), centre, known)


def followed_in_any(flights: Sequence[Reconstruction], candidates: Bank, baseline: Baseline, kind: Kind
                    ) -> list[Followed]:  # fmt: skip
    """The same in gusts of `kind`, or where the air turns, in the likelier of the kinds that turn it.

    Settled in gusts of another kind, often several times as strong as they were, derivatives go as far as they may, and
    terms of a wrong explanation would tell which kind turns the air; settled in each, the model says it by itself. A
    gap may look like that, too. In both is settled what a first guess has to decide: where numbers of rolling and
    yawing moments are together odder in air that turns than ODD of aircraft have them; and where any number goes as far
    as it may, or only the strongest gusts make sense, in which the tail meets them later or not. The latter is not
    asked of an aircraft that the model follows poorly.
    """
    found = followed(flights, candidates, baseline, kind)
    if not kind.rotation and turns(about(found.flights, candidates, found.centre), found.known):
        turning = [followed(flights, candidates, baseline, other) for other in TURNING_KINDS]
        likely = max([found, *turning], key=lambda one: one.likelihood(candidates))
        rolls = [nuisance.name.startswith(("Cl_", "Cn_")) for nuisance in candidates.nuisances]
        believed = likely is found or float(np.sum(likely.centre[rolls] ** 2)) < chi2.isf(ODD, sum(rolls))
        return [likely] if believed else [found, likely]
    told = all(flight.inadequacy.followed for flight in found.flights)
    doubtful = strongest(found.known) or bool(np.max(np.abs(found.centre)) >= MOVED)
    others = STRAIGHT if told and doubtful else ()
    return [found, *(followed(flights, candidates, baseline, other) for other in others if other != kind)]


def likelihood(flights: Sequence[Reconstruction], known: Sequence[Gain]) -> float:
    """Sum of the records' log likelihoods of a sample with their gains."""
    return float(np.sum(each(lambda flight, gain: likelihoods(flight, [gain])[0], flights, known)))


def model_alone(flights: Sequence[Reconstruction], candidates: Bank, centre: FloatArray, known: Sequence[Gain]
                ) -> list[Evidence]:  # fmt: skip
    """Evidence of every record of the model alone, moved by `centre` [n] standard deviations."""
    model = replace(candidates, nuisances=(), families=(), terms=(), size=1)
    return each(lambda flight, gain: gather(flight, model, gain), about(flights, candidates, centre), known)


def departs(evidences: Sequence[Evidence]) -> bool:
    """Whether the model does not follow some record."""
    return any(not float(e.gram[0, 0]) < DEPARTED * e.samples for e in evidences)


def likeliest(flight: Reconstruction, last: Gain, pushed: Sequence[Push] = (), kind: Kind | None = None) -> Gain:
    """The gain along a record with the gust intensity that is likeliest, sought from where it was found last.

    Args:
        pushed: generic discrepancies in the model.
        kind: of the gusts; as it was found last if omitted.
    """
    at, kind = _nearest(last.sigma), kind or last.gusts.kind
    while True:
        tried = SIGMAS[max(at - NEAR, 0) : at + NEAR + 1]
        found = choose_gain(flight, tried, pushed, kind)
        if found.sigma not in (tried[0], tried[-1]) or found.sigma in (SIGMAS[0], SIGMAS[-1]):
            return follow(flight, found)
        at = _nearest(found.sigma)


def likeliest_explained(flights: Sequence[Reconstruction], last: Sequence[Gain], pushed: Sequence[Sequence[Push]]
                        ) -> list[Gain]:  # fmt: skip
    """The same of a model with an explanation in it, which shows of what kind the gusts of the records are."""
    found = each(likeliest, flights, last, pushed)
    kind = kind_of_gusts(flights, found, pushed)
    if kind == found[0].gusts.kind:
        return found
    return each(likeliest, flights, found, pushed, [kind] * len(found))


def _nearest(sigma: float) -> int:
    """Index of the gust intensity of SIGMAS that is nearest."""
    return int(np.argmin(np.abs(np.log(np.array(SIGMAS) / sigma))))


def about(flights: Sequence[Reconstruction], candidates: Bank, centre: FloatArray) -> list[Reconstruction]:
    """Records about the model moved by `centre` [n] standard deviations."""
    return [replace(f, parameters=shifted(f.parameters, candidates.nuisances, centre, f.power_from)) for f in flights]


def gather_about(flights: Sequence[Reconstruction], candidates: Bank, centre: FloatArray,
                 known: Sequence[Gain] | None = None) -> list[Evidence]:
    """Evidence of every record about the model moved by `centre` [n] standard deviations, with gains where known."""
    moved = about(flights, candidates, centre)
    return each(lambda flight, gain: gather(flight, candidates, gain), moved, known or [None] * len(moved))


def gains_with(flying: Flying, best: Hypothesis, nuisances: FloatArray, turns: int = TURNS) -> list[Gain]:
    """Gains of the best explanation, it and the gusts found together, from where it was flown in other gusts.

    Without it, what a gap makes of a record passes for gust, or for calm; and the innovations of an aircraft whose
    vanes lag by far more than published are not white in gusts: their colour would be blamed on something.

    Args:
        nuisances: [n] of the best explanation, where it was flown.
        turns: times at most that gusts are judged with it, and that it is brought to its best in them.
    """
    candidates = flying.candidates
    for turn in range(turns):
        moved = [explained(f, candidates, best, nuisances) for f in flying.flights]
        pushed = [_pushed(e, f, candidates, best.pushed) for e, f in zip(flying.evidences, moved, strict=True)]
        known = likeliest_explained(moved, [e.gain for e in flying.evidences], pushed)
        if best.pushed or not best.effects or not differ(known, flying.evidences) or turn == turns - 1:
            break
        flying = replace(flying, evidences=each(_in_gusts, flying.evidences, known, moved))
        point = flying.settled(best.fit, flying.point(best.fit, np.array(best.fit.estimate), nuisances))
        best, nuisances = replace(best, fit=replace(best.fit, estimate=tuple(point.sizes))), point.nuisances
    return known


def differ(known: Sequence[Gain], evidences: Sequence[Evidence]) -> bool:
    """Whether any of the gains is far enough from what was flown to be worth a flight."""
    return max(unlike(g, e.gain) for g, e in zip(known, evidences, strict=True)) > UNLIKE


def explained(flight: Reconstruction, candidates: Bank, best: Hypothesis, nuisances: FloatArray) -> Reconstruction:
    """A record about the model with the known effects of an explanation in it."""
    row = shifted(flight.parameters, candidates.nuisances, nuisances, flight.power_from)
    return replace(flight, parameters=effects.with_effects(row, best.fit.values) if best.effects else row)


def _in_gusts(evidence: Evidence, gain: Gain, flight: Reconstruction) -> Evidence:
    """Gain and whitening of one record where its gusts are others; what was flown is as it was."""
    left = innovations(flight, flight.parameters, gain.K, (), gain.gusts.kind)[:, 0]
    return replace(evidence, gain=gain, factor=whitening(left, gain, flight))


def _pushed(evidence: Evidence, flight: Reconstruction, candidates: Bank, weights: Mapping[int, float]) -> list[Push]:
    """What generic terms of given weights, by row, push along one record about an explanation."""
    terms = [term for term in candidates.terms if term.row in weights]
    if not terms:
        return []
    gain = evidence.gain
    left = innovations(flight, flight.parameters, gain.K, (), gain.gusts.kind)[:, 0]
    return [replace(push, series=weights[push.row] * push.series)
            for push in pushes(as_predicted(flight, left, gain), terms)]


def unlike(one: Gain, other: Gain) -> float:
    """Largest log of the ratio of two gains' innovation variances, once steady."""
    a, b = (np.diagonal(gain.S, axis1=-2, axis2=-1).reshape(-1, gain.S.shape[-1])[-1] for gain in (one, other))
    return float(np.max(np.abs(np.log(a / b))))


def nearer(centre: FloatArray, candidates: Bank) -> FloatArray:
    """Nuisances [..., n] that the model may be moved by: within reach, and none that it does not follow."""
    follows = np.array([nuisance.follows for nuisance in candidates.nuisances])
    return np.where(follows, np.clip(centre, -MOVED, MOVED), 0.0)


def length(gram: FloatArray, step: FloatArray) -> float:
    """Whitened length of a step of the nuisances."""
    return float(np.sqrt(step @ gram[1 : len(step) + 1, 1 : len(step) + 1] @ step)) / NUISANCE_STEP
