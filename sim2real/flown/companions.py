"""What is flown at all: the leading explanations, and what may stand beside the best single effect."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.actuators.paths import of_paths, path_gram
from sim2real.flown.points import Flying, rows_of
from sim2real.flown.steps import Point, holding
from sim2real.library.bends import changes
from sim2real.library.candidates import Bank, parameter_rows, piece_at
from sim2real.library.sizes import flown_weights
from sim2real.posterior.attribution import reduce, with_prior
from sim2real.posterior.devices import apart
from sim2real.posterior.form import home
from sim2real.posterior.hypotheses import Hypothesis, Posterior
from sim2real.posterior.sets import SetFit
from sim2real.posterior.singles import EffectFit, fit_family
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.side_by_side import each
from sim2real.signatures.courses import Course, in_time
from sim2real.signatures.evidence import Evidence, compare
from sim2real.signatures.whitening import SETTLE

LEADING, LIKELY = 2, 0.02  # explanations that are flown again, and how probable they have to be
CERTAIN = 0.05  # probability of no gap above which nothing is: sizes near zero have no likelihood of Gaussian shape
COMPANIONS, LEAST_ADDED = 2, 5.0  # effects flown beside the best single one, and the log evidence that they have to add
SUSPECTS = 2  # effects flown beside it because a nuisance went as far as it may


def leading(posterior: Posterior) -> list[Hypothesis]:
    """Explanations to fly again where there is a gap at all: the probable ones, and the best single effects.

    One with what may be forgiven it, one as the library has it: of an enormous gap almost all would be forgiven to any.
    """
    if posterior.none > CERTAIN:
        return []
    known = sorted((h for h in posterior.hypotheses if h.unknown is None), key=lambda h: -h.log_posterior)
    chosen = [h for h in known if h.probability > LIKELY][:LEADING]
    alone = [h for h in known if len(h.effects) == 1]
    as_it_is = sorted(alone, key=lambda h: -h.log_evidence)
    chosen = list(dict.fromkeys([*chosen, *[h for h in alone if h not in chosen][:1], *as_it_is[:1]]))
    return chosen if any(h.effects for h in chosen) else []


def told_by_paths(linear: Posterior, first: SetFit) -> bool:
    """Whether paths tell of another effect than those of a set, whatever that leaves of the flight."""
    return any(fit.log_evidence > LEAST_ADDED and name not in first.effects and apart(fit.family.effect)
               for name, fit in linear.fits.items())


def companions(flying: Flying, linear: Posterior, first: SetFit, point: Point) -> list[EffectFit]:
    """Effects to fly beside a single one, with their sizes there.

    What explains most of what it leaves; of what no free course of time would explain where it enters (its own form
    would hide a second one); what a path tells, whatever the flight leaves; and what changes a number that went as far
    as a nuisance may.
    """
    out: dict[str, EffectFit] = {}
    moving = suspects(flying, linear, point)
    for reduced in _library_beside(flying, first, point, home(first.effects)):
        best: dict[str, EffectFit] = {}
        for family in flying.few.families:
            name = family.effect.name
            if name in linear.fits and name not in first.effects:
                fit = fit_family(reduced, family)
                if not np.isfinite(fit.log_evidence):  # beside this one, flights depart whatever its size
                    continue
                if name not in best or fit.log_evidence > best[name].log_evidence:
                    best[name] = fit
        promising = sorted(best.values(), key=lambda fit: -fit.log_evidence)
        chosen = [fit for k, fit in enumerate(promising) if k < COMPANIONS or apart(fit.family.effect)]
        out |= {fit.family.effect.name: fit for fit in chosen if fit.log_evidence > LEAST_ADDED}
        out |= {name: best[name] for name in moving if name in best}
    return [_in_bank(fit, flying.candidates) for fit in out.values()]


def _library_beside(flying: Flying, fit: SetFit, point: Point, home: Collection[str]) -> list[FloatArray]:
    """Inner products of every effect of the library (rows of `Flying.few`) about a set where it was flown.

    Then the same without what free courses of time at `home`, or a path there, would explain.
    """
    only, names = flying.few, in_time(home)

    def of_record(flight: Reconstruction, evidence: Evidence, course: Course) -> tuple[FloatArray, FloatArray]:
        still = np.zeros(len(point.sizes))
        at = rows_of(flight, flying.candidates, fit, point.sizes, still, point.nuisances)[:1]
        rows = parameter_rows(replace(flight, parameters=at), only)
        found = compare(flight, rows, evidence.gain, evidence.factor, keep=range(len(rows)))
        own = path_gram(of_paths(flight, home), rows, (), round(SETTLE / flight.dt)) / flying.tempering
        courses = course.taken(names, [found.rows], flying.tempering, again=False) if names else 0.0
        return found.gram / flying.tempering, own + courses

    total, taken = np.sum(each(of_record, flying.flights, flying.evidences, flying.courses.along), axis=0)
    prior, nothing = flying.baseline.precision, np.zeros_like(flying.baseline.precision)
    return [reduce(holding(1 + point.held, with_prior(gram, only, prior, point.nuisances)), only, nothing)
            for gram in (total, total - taken)]


def _in_bank(fit: EffectFit, candidates: Bank) -> EffectFit:
    """An effect fitted at a few sizes, with the rows of the whole bank: of the piece of its range where it lies."""
    own = piece_at(fit.family, fit.estimate, candidates.families)
    return replace(fit, family=own, weights=flown_weights(own, fit.estimate))


def suspects(flying: Flying, linear: Posterior, point: Point) -> list[str]:
    """For nuisances that went as far as they may: the effect that changes that number, and least else."""
    tested = {name: changes(fit.family.effect) for name, fit in linear.fits.items()}
    moved = [flying.candidates.nuisances[j].parameter for j in point.held]
    able = [[name for name, changed in tested.items() if number in changed] for number in moved]
    return [min(names, key=lambda name: len(tested[name])) for names in able[:SUSPECTS] if names]


def together(one: SetFit, second: EffectFit) -> SetFit:
    """A set and an effect beside it, with sizes as found beside the set."""
    spread = np.array([[((second.high95 - second.low95) / 3.92) ** 2]])
    covariance = np.zeros((1, 1)) if one.covariance is None else one.covariance
    return SetFit((*one.families, second.family), one.log_evidence + second.log_evidence,
                  (*one.estimate, second.estimate), (*one.low95, second.low95), (*one.high95, second.high95),
                  np.block([[covariance, np.zeros((1, 1))], [np.zeros((1, 1)), spread]]),
                  (one.weights or {}) | second.weights, second.misfit)  # fmt: skip


def without(fit: SetFit, m: int) -> SetFit:
    """A set without one member, the others' sizes as they are."""
    kept = [j for j in range(len(fit.families)) if j != m]
    families = tuple(fit.families[j] for j in kept)
    covariance = None if fit.covariance is None else fit.covariance[np.ix_(kept, kept)]
    estimate, low95, high95 = (tuple(of[j] for j in kept) for of in (fit.estimate, fit.low95, fit.high95))
    rows = {row for family in families for row in family.rows}
    weights = {row: w for row, w in (fit.weights or {}).items() if row in rows}
    return SetFit(families, 0.0, estimate, low95, high95, covariance, weights, fit.misfit)
