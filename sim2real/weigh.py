"""Evidence of all records together, flown again about the fitted model where need be, and tempered by what is left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.actuators.lateness import lateness
from sim2real.actuators.wandering import wandering
from sim2real.baseline.quasi_steady import LOSES
from sim2real.baseline.references import Baseline
from sim2real.baseline.spread import likeliest, of_spread, spread_beside
from sim2real.flown.companions import leading
from sim2real.flown.first_guess import first_guess, likeliest_guess
from sim2real.flown.points import Flying
from sim2real.flown.refine import refine
from sim2real.flown.screen import Points, screen, screened
from sim2real.flown.settling import departs, differ, followed, followed_in_any, gains_with, gather_about, length, nearer
from sim2real.flown.steps import FARTHEST, Places
from sim2real.library.candidates import Bank
from sim2real.over_time.varying import varying
from sim2real.posterior.any_course import course_fits, wander_fits
from sim2real.posterior.any_delay import late_fits
from sim2real.posterior.attribution import Linear, attribute, least_misfit, nuisance_mean, with_prior
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import Hypothesis, Posterior, doubted, leaving_out, normalised
from sim2real.prediction.kalman import Gain
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.courses import Course, Courses
from sim2real.signatures.evidence import Evidence
from sim2real.signatures.gust_intensity import kind_at_first
from sim2real.signatures.tempering import noise, temper, total

RELINEARISE = 8.0  # whitened distance of the fitted nuisances beyond which all is flown again about them
AGAIN = 2  # times at most
ADEQUATE = 2.0  # times the noise that is left, up to which the model lacks no more than what is looked for (assumed)
CALMER = 0.6  # ratio of temperings below which the leading explanations are flown again
Progress = Callable[[str], None]


def fit(flights: Sequence[Reconstruction], candidates: Bank, untestable: dict[str, str], baseline: Baseline,
        progress: Progress) -> tuple[list[Evidence], Posterior, Baseline]:
    """Evidence and posterior, flown about the model that fits best without a gap, and where need be about a better one.

    Signatures are linear in the nuisances only nearby, and turbulence makes them large: derivatives that are off by
    5 % lie some 200 noise units away at sigma_w = 1.5 m/s, of which a first linear step leaves 5 to 30. Flown from
    afar, what is left is blamed on an effect. Gains are those of the best explanation, too (see `explained`).

    Args:
        untestable: effects left out, with the reason; those that these records do not show are added.

    Returns:
        Evidence of every record, the posterior, and the baseline with the spread that the records ask for.
    """
    progress("fitting the model's own uncertainty")
    kind = kind_at_first(flights, baseline.kind)
    guess = likeliest_guess(followed_in_any(flights, candidates, baseline, kind), candidates, baseline, untestable)
    if guess.kind != guess.begun.kind:  # gusts show to be of another kind
        guess = first_guess(followed(flights, candidates, baseline, guess.kind), candidates, baseline, untestable)
    flights, centre, _ = guess.begun
    found = _Weighing(flights, candidates, baseline, untestable, centre)
    progress(f"flying {candidates.size} variants along {len(flights)} records")
    found.gather(guess.gains)
    found.explain(progress)
    found.judge_spread(progress)
    untestable |= found.quiet
    posterior = varying(flights, candidates, found.evidences, found.baseline, found.posterior, found.centre)
    return found.evidences, replace(posterior, hypotheses=doubted(normalised(posterior.hypotheses))), found.baseline


class _Weighing:
    """Evidence of some records about a model moved by `centre` [n] nuisances, and what it says so far.

    known: gains of the best explanation, once it has been flown; quiet: effects that these records do not show;
    published: the baseline as it was given; assumed: that with the spread that weighing begins with; wider: whether
    it may be wider still.
    """

    posterior: Posterior

    def __init__(self, flights: Sequence[Reconstruction], candidates: Bank, baseline: Baseline,
                 untestable: dict[str, str], centre: FloatArray) -> None:
        self.flights, self.candidates = flights, candidates
        self.published = self.assumed = self.baseline = baseline
        self.wider = True
        self.untestable, self.centre = dict(untestable), centre
        self.known: list[Gain] | None = None
        self.quiet = dict(untestable)
        self.evidences: list[Evidence] = []
        self.along: list[Course] = []
        self.points: Points = {}
        self.linear: dict[float, Linear] = {}
        self.places = Places()

    def gather(self, known: Sequence[Gain] | None, tempering: float | None = None) -> bool:
        """Fly the variants about the centre, with gains (and tempering) where known, and weigh what they say.

        Returns:
            Whether that is believed: with gains of an explanation, the model without it may depart from the records.
        """
        for course in self.along:
            course.forget()
        flown = gather_about(self.flights, self.candidates, self.centre, known)
        if departs(flown) and self.evidences:
            return False
        self.evidences = flown
        self.along = [Course(e) for e in self.evidences]
        self.points, self.linear = {}, {}
        self._weigh(tempering, anew=True)
        return True

    def judge_spread(self, progress: Progress) -> None:
        """Judge how uncertain derivatives are with the best explanation flown, and explain with that what was flown.

        A wider spread that was taken for no gap, where one was found all the same, is not believed. Nor is one that the
        numbers no longer ask for which settle with it.
        """
        if self.posterior.none <= 0.5 and self.baseline is not self.published:
            self._explain_with(self.published, progress)
        if self.posterior.none > 0.5 or self.published.spread is None:
            return
        if (spread := self._asked()) > self.published.spread:
            before = dict(vars(self))
            self._explain_with(of_spread(self.published, self.candidates, spread), progress)
            if self.posterior.none <= 0.5 and self._asked() <= self.published.spread:
                vars(self).update(before)

    def _asked(self) -> float:
        """The spread that the numbers ask for which settled beside the best explanation, if that is all there is.

        What it lacks would pass for numbers that are off: another form, where it gains by that, or something else that
        a number went as far for as it may.
        """
        best = self.posterior.best
        if best.unknown is not None or best.varies or best.settled is None or self.posterior.tempering > ADEQUATE:
            return 1.0
        at_end = np.abs(best.settled.nuisances) > FARTHEST - 1e-9
        lacks = best.regained > 0.0 or bool(at_end.any())
        return 1.0 if lacks else spread_beside(best.settled, self.candidates, self.baseline)

    def _explain_with(self, baseline: Baseline, progress: Progress) -> None:
        """Weigh what was flown with the spread of a baseline, judge it no more, and fly the leading explanations."""
        progress("weighing again with another spread of the derivatives")
        self.wider, self.assumed = False, baseline
        self.baseline, self.points, self.linear = baseline, {}, {}
        self._weigh(None)
        self.explain(progress)

    def explain(self, progress: Progress) -> None:
        """Fly the variants again with gains of the best explanation, where that is worth it, and the leading ones."""
        for _ in range(AGAIN):
            if not self.judged():
                break
            progress("flying the variants again, gusts judged with the best explanation")
            if not self.gather(self.known):
                break
        progress("looking for what no generic term follows")
        self.weigh_courses()
        if leading(self.posterior):
            progress("flying the leading explanations where they were fitted")
            self.refine()
            self.refine_anew(progress)

    def weigh_courses(self) -> None:
        """Weigh once more, free courses of time among what is unknown."""
        t, first = self.posterior.tempering, 1 + len(self.candidates.nuisances)
        parts = [[course.model, course.evidence.rows[:, : first - 1]] for course in self.along]
        rows, left = [e.flight.parameters for e in self.evidences], float(self.posterior.reduced[0, 0])
        self._weigh(t, [*course_fits(Courses(self.along, t), parts, self._gram()[:first, :first]),
                        *wander_fits(wandering(self.flights, rows), left, t),
                        *late_fits(lateness(self.flights, rows), left, t)])

    def _weigh(self, tempering: float | None, free: Sequence[UnknownFit] = (), anew: bool = False) -> None:
        """Weigh what was flown; `anew`: how uncertain derivatives are is judged too, where the model is adequate."""
        if anew:
            self.baseline = self.assumed
        linear = self._linear(tempering, free)
        if anew and self.wider and linear.tempering <= ADEQUATE:
            t = linear.tempering
            likely = likeliest(total(self.evidences) / t, self.candidates, self.baseline, self.centre, linear,
                               lambda other: self._weighed(other, t, {}, dict(self.untestable)))  # fmt: skip
            if likely is not self.baseline:
                self.baseline, self.linear = likely, {}
                linear = self._linear(tempering, free)
        if not self.points or linear.tempering != self.posterior.tempering:
            self.posterior = linear
            self.points = screen(self._flying(), self.start, linear, self.places)
        self.posterior = screened(linear, self.points, self.candidates.families)

    def _linear(self, tempering: float | None, free: Sequence[UnknownFit]) -> Posterior:
        self.quiet = dict(self.untestable)
        return self._weighed(self.baseline, tempering, self.linear, self.quiet, free)

    def _weighed(self, baseline: Baseline, tempering: float | None, kept: dict[float, Linear], quiet: dict[str, str],
                 free: Sequence[UnknownFit] = ()) -> Posterior:  # fmt: skip
        return weigh(self.evidences, self.candidates, quiet, baseline, self.centre, kept, tempering, free)

    def _gram(self) -> FloatArray:
        """Inner products of all records, tempered, the nuisances' prior among them."""
        return with_prior(total(self.evidences) / self.posterior.tempering, self.candidates, self.baseline.precision,
                          self.centre)  # fmt: skip

    def start(self, known: Hypothesis) -> FloatArray:
        """Best nuisances [n] of an explanation: where it was flown, or as far as the linear fit knows."""
        if known.unknown is None and known.effects in self.points:
            return self.points[known.effects].nuisances
        return self.centre + nuisance_mean(self._gram(), self.candidates, known.weights)

    def _flying(self) -> Flying:
        t = self.posterior.tempering
        courses = Courses(self.along, t, self.candidates.terms)
        return Flying(self.flights, self.candidates, self.evidences, self.baseline, t, courses)

    def judged(self) -> bool:
        """Find the gains of the likeliest explanation, and where the model is flown beside something unknown.

        Returns:
            Whether they are far enough from what was flown to fly the variants again.
        """
        best = self._likeliest()
        if not best.effects and best.unknown is None:
            return False
        there = self.start(best)
        worth = self._judged(best, np.clip(there, -FARTHEST, FARTHEST))
        step = np.zeros_like(there) if best.effects else nearer(there, self.candidates) - self.centre
        if not worth and length(self._gram(), step) <= RELINEARISE:
            return False
        self.centre = self.centre + step
        return True

    def _likeliest(self) -> Hypothesis:
        """The likeliest explanation that was flown, or unknown alone."""
        return next(h for h in self.posterior.hypotheses if (h.unknown is None and h.effects in self.points)
                    or (h.unknown is not None and not h.effects))

    def _judged(self, best: Hypothesis, nuisances: FloatArray) -> bool:
        """Find the gains with an explanation in the model; whether they are worth a flight."""
        self.known = gains_with(self._flying(), best, nuisances)
        return differ(self.known, self.evidences)

    def refine(self, before: Hypothesis | None = None) -> None:
        """Fly the leading explanations where they lie, and what was best `before`."""
        self.posterior = refine(self._flying(), self.start, self.posterior, self.places, before)

    def refine_anew(self, progress: Progress) -> None:
        """The same with the gains and the tempering of what was best, unless that is lost with them."""
        before, best = dict(vars(self)), self.posterior.best
        if not self.judged_anew():
            return
        progress("flying the leading explanations again, gusts and remainder judged with them")
        self.refine(best)
        again = [h.fit.misfit for h in self.posterior.hypotheses if h.unknown is None and h.effects == best.effects]
        if again and again[0] * self.posterior.tempering > LOSES * best.fit.misfit * before["posterior"].tempering:
            vars(self).update(before)

    def judged_anew(self) -> bool:
        """Weigh anew with the gains and the tempering of the best explanation flown, where these are others."""
        worth = self._judged(self.posterior.best, np.asarray(self.posterior.settled))
        calm = temper(self.posterior.bare * self.posterior.tempering, self.evidences)
        if not worth and calm >= CALMER * self.posterior.tempering:
            return False
        if not (worth and self.gather(self.known, calm)):
            self._weigh(calm)
        self.weigh_courses()
        return True


def weigh(evidences: Sequence[Evidence], candidates: Bank, untestable: dict[str, str], baseline: Baseline,
          centre: FloatArray, kept: dict[float, Linear], tempering: float | None = None,
          free: Sequence[UnknownFit] = ()) -> Posterior:
    """Posterior of all records together; effects whose whole range would not show are added to `untestable`.

    Args:
        evidences, candidates: what was flown.
        untestable: effects left out, with the reason; changed in place.
        baseline: the model and its precision.
        centre: nuisances [n] by which the flown model had been moved.
        kept: what the same evidence said before, by tempering; added to.
        tempering: of the evidence; as what is left says if omitted.
        free: free courses of time, by component.
    """
    def tempered(by: float) -> Linear:
        if by not in kept:
            gram = with_prior(total(evidences) / by, candidates, baseline.precision, centre)
            kept[by] = Linear(gram, candidates, tuple(untestable), np.zeros_like(baseline.precision))
        return kept[by]

    if tempering is None:
        tempering = max(temper(least_misfit(tempered(1.0)), evidences), 1.0)
    posterior = replace(attribute(tempered(tempering), noise(evidences, tempering), free), tempering=tempering)
    quiet = [name for name, found in posterior.fits.items() if found.smallest is None]
    for name in quiet:
        untestable[name] = "no excitation: these records would not show it anywhere in its range"
    return leaving_out(posterior, quiet)
