"""Gusts judged with a gap in the model before anything else is flown, where one effect is plain to see."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sim2real.baseline.references import Baseline
from sim2real.flown.points import Flying
from sim2real.flown.settling import (
    Followed,
    about,
    departs,
    explained,
    gains_with,
    gather_about,
    likelihood,
    model_alone,
)
from sim2real.flown.steps import FARTHEST
from sim2real.library.candidates import Bank, at_few_sizes
from sim2real.posterior.attribution import nuisance_mean, of_one, reduce, with_prior
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.posterior.singles import fit_family
from sim2real.prediction.gusts import Kind
from sim2real.prediction.kalman import Gain
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.courses import Course, Courses
from sim2real.signatures.gust_intensity import TURNING, asked, strongest
from sim2real.signatures.tempering import temper, total

PLAIN, GUESSES = 20.0, 4  # log evidence by which an effect is plain to see, and how many of these are flown


class Guess(NamedTuple):
    """Where the model settled, the records about it with what is plain to see in it, and their gains with that.

    gap: whether an effect is plain to see.
    """

    begun: Followed
    flights: list[Reconstruction]
    gains: list[Gain]
    gap: bool

    @property
    def kind(self) -> Kind:
        """That of the gusts."""
        return self.gains[0].gusts.kind

    def likelihood(self) -> float:
        """Sum of the records' log likelihoods of a sample."""
        return likelihood(self.flights, self.gains)


def likeliest_guess(ways: Sequence[Followed], candidates: Bank, baseline: Baseline, untestable: Iterable[str]) -> Guess:
    """The likeliest of the guesses about a model that was settled in gusts of several kinds.

    What a gap makes of a model that has none passes for a kind of gusts; with the gap in it, the likelihood tells. It
    has to gain a little by gusts of another kind than those of the first guess, by air that turns what is asked of it:
    that passes for what another form of a gap in roll leaves, too; else half as much where it is likelier without the
    gap as well, and nothing where there is no gap in it and one in the first guess. Where only the strongest make sense
    even so, what is not understood passes for gusts, and nothing is in favour of another kind.
    """
    best, *others = [first_guess(way, candidates, baseline, untestable) for way in ways]
    for other in others:
        needed = 0.0 if other.kind == best.kind else TURNING[0] * len(other.gains)
        if other.kind.rotation and not best.kind.rotation:
            needed = sum(asked(gain) for gain in other.gains)
        elif best.gap and not other.gap:
            needed = 0.0
        elif other.begun.likelihood(candidates) > best.begun.likelihood(candidates):
            needed *= 0.5
        sense = other.kind == best.kind or not strongest(other.gains)
        if sense and other.likelihood() > best.likelihood() + needed:
            best = other
    return best


def first_guess(begun: Followed, candidates: Bank, baseline: Baseline, untestable: Iterable[str]) -> Guess:
    """Gains with the likeliest single effect in the model, if one is plain to see; else those known.

    A gap passes for gust. What all variants would have to be flown again for is seen with a few of them.
    """
    flights, centre, known = begun
    alone = Guess(begun, about(flights, candidates, centre), known, False)
    few = at_few_sizes(candidates, untestable)
    evidences = gather_about(flights, few, centre, known)
    gram = with_prior(total(evidences), few, baseline.precision, centre)
    reduced = reduce(gram, few, np.zeros_like(baseline.precision))
    tempering = max(temper(float(reduced[0, 0]), evidences), 1.0)
    gram = with_prior(total(evidences) / tempering, few, baseline.precision, centre)
    reduced = reduce(gram, few, np.zeros_like(baseline.precision))
    fits = sorted((fit_family(reduced, f) for f in few.families), key=lambda fit: -fit.log_evidence)[:GUESSES]
    if not fits or fits[0].log_evidence < PLAIN:
        return alone
    courses = Courses([Course(e) for e in evidences], tempering, few.terms)
    flying = Flying(flights, few, evidences, baseline, tempering, courses)
    plain = [of_one(fit) for fit in fits if fit.log_evidence > PLAIN]
    starts = [np.clip(centre + nuisance_mean(gram, few, fit.weights or {}), -FARTHEST, FARTHEST) for fit in plain]
    points = flying.descended(plain, starts)
    best = min(range(len(points)), key=lambda i: points[i].cost)
    point = points[best]
    fit = replace(plain[best], estimate=tuple(point.sizes))
    guess = Hypothesis(fit, None, 0.0, 0.0)
    found = gains_with(flying, guess, point.nuisances, 1)
    if departs(model_alone(flights, few, centre, found)):
        return alone
    return Guess(begun, [explained(flight, few, guess, point.nuisances) for flight in flights], found, True)
