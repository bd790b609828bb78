"""Evidence of all records together, flown again about the fitted model where need be, and tempered by what is left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.any_course import course_fits
from sim2real.attribution import attribute, least_misfit, nuisance_mean, reduce, with_prior
from sim2real.candidates import NUISANCE_STEP, Bank, shifted
from sim2real.companions import leading
from sim2real.courses import Course, Courses
from sim2real.evidence import SIGMAS, Evidence, choose_gain, gather
from sim2real.generic import UnknownFit
from sim2real.hypotheses import Hypothesis, Posterior, doubted, leaving_out, normalised
from sim2real.kalman import Gain, follow, gains
from sim2real.points import Flying
from sim2real.predictor import innovations, predicted
from sim2real.reconstruct import Reconstruction
from sim2real.references import Baseline
from sim2real.refine import refine
from sim2real.screen import Points, screen, screened
from sim2real.side_by_side import each
from sim2real.terms import pushes

SETTLING, SETTLED = 4, 3.0  # steps towards the best nuisances, and the whitened length of a step that ends them
RELINEARISE = 8.0  # whitened distance of the fitted nuisances beyond which all is flown again about them
AGAIN = 2  # times at most
CALMER = 0.6  # ratio of temperings below which the leading explanations are flown again
UNLIKE = 0.25  # log of the ratio of innovation variances beyond which another gain is worth a flight: two of SIGMAS
FIRST_ORDER = 3.0  # least tempering where another simulator's accelerations stand in for its flight (assumed)
FARTHEST = 4.0  # standard deviations: what is beyond is no nuisance
Progress = Callable[[str], None]


def fit(flights: Sequence[Reconstruction], candidates: Bank, untestable: dict[str, str], baseline: Baseline,
        progress: Progress) -> tuple[list[Evidence], Posterior]:
    """Evidence and posterior, flown about the model that fits best without a gap, and where need be about a better one.

    Signatures are linear in the nuisances only nearby, and turbulence makes them large: derivatives that are off by
    5 % lie some 200 noise units away at sigma_w = 1.5 m/s, of which a first linear step leaves 5 to 30. Flown from
    afar, what is left is blamed on an effect. Gains are those of the best explanation, too (see `explained`).

    Args:
        untestable: effects left out, with the reason; those that these records do not show are added.
    """
    progress("fitting the model's own uncertainty")
    centre, known = settle(flights, candidates, baseline)
    found = _Weighing(flights, candidates, baseline, untestable, centre)
    progress(f"flying {candidates.size} variants along {len(flights)} records")
    found.gather(known)
    for _ in range(AGAIN):
        if not found.judged():
            break
        progress("flying the variants again, gusts judged with the best explanation")
        found.gather(found.known)
    progress("looking for what no generic term follows")
    found.weigh_courses()
    untestable |= found.quiet
    if leading(found.posterior):
        progress("flying the leading explanations where they were fitted")
        found.refine()
        if found.judged_anew():
            progress("flying the leading explanations again, gusts and remainder judged with them")
            found.refine()
    return found.evidences, replace(found.posterior, hypotheses=doubted(normalised(found.posterior.hypotheses)))


class _Weighing:
    """Evidence of some records about a model moved by `centre` [n] nuisances, and what it says so far.

    known: gains of the best explanation, once it has been flown; quiet: effects that these records do not show.
    """

    evidences: list[Evidence]
    along: list[Course]
    posterior: Posterior

    def __init__(self, flights: Sequence[Reconstruction], candidates: Bank, baseline: Baseline,
                 untestable: dict[str, str], centre: FloatArray) -> None:
        self.flights, self.candidates, self.baseline = flights, candidates, baseline
        self.untestable, self.centre = untestable, centre
        self.known: list[Gain] | None = None
        self.quiet = dict(untestable)
        self.points: Points = {}

    def gather(self, known: Sequence[Gain] | None, tempering: float | None = None) -> None:
        """Fly the variants about the centre, with gains (and tempering) where known, and weigh what they say."""
        self.evidences = gather_about(self.flights, self.candidates, self.centre, known)
        self.along = [Course(e) for e in self.evidences]
        self.points = {}
        self._weigh(tempering)

    def weigh_courses(self) -> None:
        """Weigh once more, free courses of time among what is unknown."""
        t, first = self.posterior.tempering, 1 + len(self.candidates.nuisances)
        parts = [[course.model, course.evidence.rows[:, : first - 1]] for course in self.along]
        self._weigh(t, course_fits(Courses(self.along, t), parts, self._gram()[:first, :first]))

    def _weigh(self, tempering: float | None, free: Sequence[UnknownFit] = ()) -> None:
        self.quiet = dict(self.untestable)
        linear = weigh(self.evidences, self.candidates, self.quiet, self.baseline, self.centre, tempering, free)
        if not self.points or linear.tempering != self.posterior.tempering:
            self.posterior = linear
            self.points = screen(self._flying(), self.start, linear)
        self.posterior = screened(linear, self.points)

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
        return Flying(self.flights, self.candidates, self.evidences, self.baseline, t, Courses(self.along, t))

    def judged(self) -> bool:
        """Find the gains of the likeliest explanation, and where the model is flown beside something unknown.

        Returns:
            Whether they are far enough from what was flown to fly the variants again.
        """
        best = self._likeliest()
        if not best.effects and best.unknown is None:
            return False
        there = self.start(best)
        other = self._judged(best, np.clip(there, -FARTHEST, FARTHEST))
        step = np.zeros_like(there) if best.effects else nearer(there, self.candidates) - self.centre
        if not other and _length(self._gram(), step) <= RELINEARISE:
            return False
        self.centre = self.centre + step
        return True

    def _likeliest(self) -> Hypothesis:
        """The likeliest explanation that was flown, or unknown alone."""
        return next(h for h in self.posterior.hypotheses if (h.unknown is None and h.effects in self.points)
                    or (h.unknown is not None and not h.effects))

    def _judged(self, best: Hypothesis, nuisances: FloatArray) -> bool:
        """Find the gains with an explanation in the model; whether they are worth a flight."""
        self.known = each(lambda e, f: explained(e, f, self.candidates, best, nuisances), self.evidences, self.flights)
        return max(unlike(g, e.gain) for g, e in zip(self.known, self.evidences, strict=True)) > UNLIKE

    def refine(self) -> None:
        """Fly the leading explanations where they lie."""
        self.posterior = refine(self._flying(), self.start, self.posterior)

    def judged_anew(self) -> bool:
        """Weigh anew with the gains and the tempering of the best explanation flown, where these are others."""
        other = self._judged(self.posterior.best, np.asarray(self.posterior.settled))
        calm = temper(self.posterior.bare * self.posterior.tempering, self.evidences)
        if not other and calm >= CALMER * self.posterior.tempering:
            return False
        if other:
            self.gather(self.known, calm)
        else:
            self._weigh(calm)
        self.weigh_courses()
        return True


def explained(evidence: Evidence, flight: Reconstruction, candidates: Bank, best: Hypothesis,
              nuisances: FloatArray) -> Gain:
    """The gain of the best explanation, with the gust intensity that is likeliest with it in the model.

    Without it, what a gap makes of a record passes for gust, or for calm; and the innovations of an aircraft whose
    vanes lag by far more than published are not white in gusts: their colour would be blamed on something.
    """
    row = shifted(flight.parameters, candidates.nuisances, nuisances, flight.power_from)
    if best.effects:
        row = effects.with_effects(row, best.fit.values)
    moved, weights = replace(flight, parameters=row), best.pushed
    base = innovations(moved, row, evidence.gain.K)[:, 0]
    terms = [term for term in candidates.terms if term.row in weights]
    pushed = [replace(push, series=weights[push.row] * push.series)
              for push in pushes(replace(moved, measured=predicted(moved, base)), terms)]
    return follow(moved, choose_gain(moved, gains(moved, SIGMAS), pushed))


def unlike(one: Gain, other: Gain) -> float:
    """Largest log of the ratio of two gains' innovation variances, once steady."""
    a, b = (np.diagonal(gain.S, axis1=-2, axis2=-1).reshape(-1, gain.S.shape[-1])[-1] for gain in (one, other))
    return float(np.max(np.abs(np.log(a / b))))


def settle(flights: Sequence[Reconstruction], candidates: Bank, baseline: Baseline) -> tuple[FloatArray, list[Gain]]:
    """Nuisances [n] that fit best where there is no gap, and the gains found on the way.

    Gauss-Newton, flown anew at every step; gust intensities are chosen at the published model and once more after the
    first step.
    """
    only = replace(candidates, families=(), terms=(), size=1 + len(candidates.nuisances))
    centre = np.zeros(len(candidates.nuisances))
    known: list[Gain] | None = [choose_gain(f, gains(f, SIGMAS)).with_start() for f in flights]
    for k in range(SETTLING):
        evidences = gather_about(flights, only, centre, known)
        known = [e.gain for e in evidences] if k > 0 else None
        gram = with_prior(total(evidences), only, baseline.precision, centre)
        tempering = temper(float(reduce(gram, only, np.zeros_like(baseline.precision))[0, 0]), evidences)
        gram = with_prior(total(evidences) / tempering, only, baseline.precision, centre)
        step = nearer(centre + nuisance_mean(gram, only, {}), only) - centre
        centre = centre + step
        if k > 0 and _length(gram, step) < SETTLED:
            break
    return centre, [e.gain for e in evidences]


def gather_about(flights: Sequence[Reconstruction], candidates: Bank, centre: FloatArray,
                 known: Sequence[Gain] | None = None) -> list[Evidence]:
    """Evidence of every record about the model moved by `centre` [n] standard deviations, with gains where known."""
    moved = [replace(f, parameters=shifted(f.parameters, candidates.nuisances, centre, f.power_from)) for f in flights]
    return each(lambda flight, gain: gather(flight, candidates, gain), moved, known or [None] * len(moved))


def nearer(centre: FloatArray, candidates: Bank) -> FloatArray:
    """Nuisances [..., n] that the model may be moved by: within reach, and none that it does not follow."""
    follows = np.array([nuisance.follows for nuisance in candidates.nuisances])
    return np.where(follows, np.clip(centre, -FARTHEST, FARTHEST), 0.0)


def _length(gram: FloatArray, step: FloatArray) -> float:
    """Whitened length of a step of the nuisances."""
    return float(np.sqrt(step @ gram[1 : len(step) + 1, 1 : len(step) + 1] @ step)) / NUISANCE_STEP


def total(evidences: Sequence[Evidence]) -> FloatArray:
    """Inner products of all records together."""
    return np.asarray(np.sum([e.gram for e in evidences], axis=0))


def weigh(evidences: Sequence[Evidence], candidates: Bank, untestable: dict[str, str], baseline: Baseline,
          centre: FloatArray, tempering: float | None = None, free: Sequence[UnknownFit] = ()) -> Posterior:
    """Posterior of all records together; effects whose whole range would not show are added to `untestable`.

    Args:
        evidences, candidates: what was flown.
        untestable: effects left out, with the reason; changed in place.
        baseline: the model and its precision.
        centre: nuisances [n] by which the flown model had been moved.
        tempering: of the evidence; as what is left says if omitted.
        free: free courses of time, by component.
    """
    data, nothing = total(evidences), np.zeros_like(baseline.precision)

    def tempered(by: float) -> FloatArray:
        return with_prior(data / by, candidates, baseline.precision, centre)

    if tempering is None:
        left = least_misfit(tempered(1.0), candidates, tuple(untestable), nothing)
        tempering = max(temper(left, evidences), 1.0)
    noise = sum(e.samples for e in evidences) / tempering if tempering > 1.0 else np.inf
    posterior = replace(attribute(tempered(tempering), candidates, tuple(untestable), nothing, noise, free),
                        tempering=tempering)
    quiet = [name for name, found in posterior.fits.items() if found.smallest is None]
    for name in quiet:
        untestable[name] = "no excitation: these records would not show it anywhere in its range"
    return leaving_out(posterior, quiet)


def temper(misfit: float, evidences: Sequence[Evidence]) -> float:
    """What to divide the evidence by because even the best explanation leaves more than noise, and that coloured.

    With the mean whitened square c of what is left over and the time tau that it stays correlated (in samples):
    1 + (c - 1) tau, and 1 where c is below one. Model error that nobody can name is thus counted as noise, instead of
    as thousands of independent proofs of whatever lies nearest. tau is that of the model's own innovations; an
    explanation that takes most of what they have above noise takes as much of their colour.

    Args:
        misfit: whitened square that the best explanation leaves, nuisances at their best.
        evidences: of the records.
    """
    samples = sum(e.samples for e in evidences)
    excess = max(misfit / samples - 1.0, 0.0)
    whole = max(float(np.sum([np.sum(e.whitened**2) for e in evidences])) / samples - 1.0, excess, 1e-9)
    coloured = float(np.mean([correlation_time(e.whitened) for e in evidences])) - 1.0
    least = FIRST_ORDER if any(e.flight.known is not None for e in evidences) else 1.0
    return least + excess * (1.0 + coloured * excess / whole)


def correlation_time(series: FloatArray) -> float:
    """Samples in which innovations stay correlated [N, channels], the channels weighted by their energy."""
    n = len(series)
    spectrum = np.abs(np.fft.rfft(series, 2 * n, axis=0)) ** 2
    together = np.fft.irfft(spectrum.sum(axis=1), 2 * n)[:n]
    if together[0] <= 0.0:
        return 1.0
    rho = together / together[0]
    below = np.flatnonzero(rho < 0.05)
    return float(1.0 + 2.0 * np.sum(rho[1 : below[0] if len(below) else n]))
