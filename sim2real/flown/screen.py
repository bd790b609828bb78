"""Single effects, and the sets that look best, flown to where they fit best before explanations are ranked.

Without its cause the model's nuisances bend to imitate a gap, by several deviations, and signatures are linear in them
only nearby: from there, the effect that is to blame may look no better than none (a wing ice of 27 units of log
evidence passed for nothing). So none and every effect go to their own best sizes and nuisances, side by side, with the
slopes of the flight that the variants were flown about, and so do sets of several that then look better still.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.flown.corrections import corrected, inherited
from sim2real.flown.points import Flying
from sim2real.flown.steps import FARTHEST, Places, Point
from sim2real.library.candidates import Family
from sim2real.posterior.forgiveness import forgive
from sim2real.posterior.form import Form
from sim2real.posterior.hypotheses import Hypothesis, Posterior, normalised

SETS, TURNS = 8, 3  # sets of several flown side by side, and how often, until one that was flown looks best
# Slopes are flown anew for up to MOST that are within so much log likelihood, or such a share of what is explained, of
# the best (assumed).
CLOSE, SHARE, MOST = 15.0, 0.3, 4
Points = Mapping[tuple[str, ...], Point]


def screen(flying: Flying, start: Callable[[Hypothesis], FloatArray], posterior: Posterior, places: Places) -> Points:
    """None, every single effect and some sets, each where it fits best, by the names of their effects.

    Args:
        start: best nuisances [n] of a hypothesis as far as the linear fit knows.
        posterior: of the linear fit.
        places: where sets settled before.
    """
    known = {h.effects: h for h in posterior.hypotheses if h.unknown is None}
    points: dict[tuple[str, ...], Point] = {}

    def fly(names: Iterable[tuple[str, ...]]) -> None:
        chosen = [known[own] for own in names]
        begun = [places.begin(h.fit, np.clip(start(h), -FARTHEST, FARTHEST)) for h in chosen]
        fits, starts = [fit for fit, _ in begun], [nuisances for _, nuisances in begun]
        points.update(zip(names, flying.descended(fits, starts), strict=True))

    fly([names for names in known if len(names) < 2])
    for _ in range(TURNS):
        promising = _promising(posterior, points, flying.candidates.families)
        if not promising:
            break
        fly(promising)
    best = min(point.cost for point in points.values())
    far = best + max(CLOSE, SHARE * (points[()].cost - best))
    close = [names for names, point in points.items() if point.cost < far]
    if len(close) > 1:
        for names in sorted(close, key=lambda names: points[names].cost)[:MOST]:
            points[names] = flying.settled(known[names].fit, points[names])
    return {names: replace(point, rows=(), slopes=()) for names, point in points.items()}


def _promising(posterior: Posterior, points: Points, pieces: Sequence[Family]) -> list[tuple[str, ...]]:
    """Sets that were not flown and look better than the best that was."""
    found = _inheriting(posterior, points, pieces)
    bound = max(h.log_posterior for h in found if h.unknown is None and h.effects in points)
    better = [h for h in found if h.unknown is None and h.log_posterior > bound]
    return [h.effects for h in sorted(better, key=lambda h: -h.log_posterior)[:SETS]]


def screened(posterior: Posterior, points: Points, pieces: Sequence[Family]) -> Posterior:
    """The posterior with what was flown in the place of the linear fit; what looks better and was not is left out.

    Args:
        pieces: of `corrected`.
    """
    found = _inheriting(posterior, points, pieces)
    bound = max(h.log_posterior for h in found if h.unknown is None and h.effects in points)
    kept = [h for h in found if h.unknown is not None or h.log_posterior <= bound]
    return replace(posterior, hypotheses=normalised(kept, 0.0))


def _inheriting(posterior: Posterior, points: Points, pieces: Sequence[Family]) -> list[Hypothesis]:
    """Hypotheses as they were flown; sets that were not, as much better as those within them turned out."""
    before = list(posterior.hypotheses)
    flown = [i for i, h in enumerate(before) if h.unknown is None and h.effects in points]
    found = list(before)
    for i in flown:
        now = corrected(before[i], points[before[i].effects].without_held(), posterior, pieces)
        found[i] = replace(now, form=_shifted(now.form, now.fit.misfit, before[i].fit.misfit))
    found = inherited(found, before, flown, flown)
    nothing = next(h.fit.misfit for h in found if not h.effects and h.unknown is None)
    return forgive(found, nothing, min(h.left for h in found))


def _shifted(form: Form | None, misfit: float, linear: float) -> Form | None:
    """Another form of an effect that leaves `misfit` where it was flown, and left `linear` by the linear fit.

    What the linear fit missed, its other forms took there: they do not gain it twice.
    """
    if form is None:
        return None
    left = [min(misfit, own) if misfit < linear else own + misfit - linear for own in form.left]
    less = [0.5 * ((linear - own) - (misfit - now)) for own, now in zip(form.left, left, strict=True)]
    gained = tuple(gain - lost for gain, lost in zip(form.gained, less, strict=True))
    return replace(form, gained=gained, left=tuple(left))
