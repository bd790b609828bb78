"""Gusts judged with a gap in the model before anything else is flown, where one effect is plain to see."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.baseline.references import Baseline
from sim2real.flown.points import Flying
from sim2real.flown.settling import departs, gains_with, gather_about, model_alone
from sim2real.flown.steps import FARTHEST
from sim2real.library.candidates import Bank, at_few_sizes
from sim2real.posterior.attribution import nuisance_mean, of_one, reduce, with_prior
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.posterior.singles import fit_family
from sim2real.prediction.kalman import Gain
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.courses import Course, Courses
from sim2real.signatures.tempering import temper, total

PLAIN, GUESSES = 20.0, 4  # log evidence by which an effect is plain to see, and how many of these are flown


def first_guess(flights: Sequence[Reconstruction], candidates: Bank, baseline: Baseline, untestable: Iterable[str],
                centre: FloatArray, known: list[Gain]) -> list[Gain]:  # fmt: skip
    """Gains with the likeliest single effect in the model, if one is plain to see; else those known.

    A gap passes for gust. What all variants would have to be flown again for is seen with a few of them.
    """
    few = at_few_sizes(candidates, untestable)
    evidences = gather_about(flights, few, centre, known)
    gram = with_prior(total(evidences), few, baseline.precision, centre)
    reduced = reduce(gram, few, np.zeros_like(baseline.precision))
    tempering = max(temper(float(reduced[0, 0]), evidences), 1.0)
    gram = with_prior(total(evidences) / tempering, few, baseline.precision, centre)
    reduced = reduce(gram, few, np.zeros_like(baseline.precision))
    fits = sorted((fit_family(reduced, f) for f in few.families), key=lambda fit: -fit.log_evidence)[:GUESSES]
    if not fits or fits[0].log_evidence < PLAIN:
        return known
    courses = Courses([Course(e) for e in evidences], tempering, few.terms)
    flying = Flying(flights, few, evidences, baseline, tempering, courses)
    alone = [of_one(fit) for fit in fits if fit.log_evidence > PLAIN]
    starts = [np.clip(centre + nuisance_mean(gram, few, fit.weights or {}), -FARTHEST, FARTHEST) for fit in alone]
    points = flying.descended(alone, starts)
    best = min(range(len(points)), key=lambda i: points[i].cost)
    point = points[best]
    fit = replace(alone[best], estimate=tuple(point.sizes))
    found = gains_with(flying, Hypothesis(fit, None, 0.0, 0.0), point.nuisances, 1)
    return known if departs(model_alone(flights, few, centre, found)) else found
