"""Something unknown that no generic term follows: a free course of time at one component, of unknown size.

Its hats (`signatures.courses`) have heights with a Gaussian prior, alike and independent, of one of several sizes: the
evidence is in closed form, and what so many heights take by luck they pay for.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from icing_env.record import FloatArray
from sim2real.actuators.wandering import Wander
from sim2real.library.terms import BEYOND, GENERIC, WIND
from sim2real.posterior.generic import COURSE, UnknownFit
from sim2real.records.side_by_side import each
from sim2real.signatures.courses import Course, Courses, Remainder, in_time

SIZES = (0.003, 0.01, 0.03, 0.1, 0.3)  # standard deviations of the heights, in units of a generic coefficient (assumed)
SHARE = 1.0 / 3.0  # prior share of what is unknown at a component that generic terms do not follow (assumed)
ALIKE = 0.01  # of what generic terms gain, that another way has to gain beyond them to be told instead (assumed)
TOGETHER, MOST = 7, 1.2e8  # components whose responses are computed at once, and bytes that these may take
GUSTY = 0.3  # m/s of gusts, in which a course of the wind counts half (set on clean aircraft)
PLACES = in_time({component for component, _, _ in (*GENERIC, *BEYOND)})


def course_fits(courses: Courses, parts: Sequence[Sequence[FloatArray]], gram: FloatArray, held: Collection[int] = (),
                places: Collection[str] = PLACES, keep: bool = False) -> list[UnknownFit]:
    """Evidence of a free course at each of some components over what is left without.

    Args:
        parts: of every record, what is left and what else may give way [N x channels, rows], in parts side by side.
        gram: inner products of these rows [rows, rows], tempered, priors among them.
        held: rows that give way no more.
        places: components.
        keep: what their hats make of the records, to be asked for again.
    """
    gone = [j for j in range(1, len(gram)) if j not in held]
    inverse = np.linalg.inv(gram[np.ix_(gone, gone)])
    moved = inverse @ gram[gone, 0]
    misfit, found = float(gram[0, 0] - gram[0, gone] @ moved), []
    at = sorted(places)
    made = each(lambda course, own: _counted(course, _products(course, at, own, keep)), courses.along, parts)
    for component in at:
        inner = block_diag(*(products[component][0] for products in made)) / courses.tempering
        onto = np.concatenate([products[component][1] for products in made]) / courses.tempering
        if np.max(np.diag(inner), initial=0.0) > 1e-9:
            across = onto[:, gone]
            found.append(_fit(component, inner - across @ inverse @ across.T, across @ moved - onto[:, 0], misfit))
    return found


def beside(courses: Courses, left: Remainder, places: Collection[str]) -> list[UnknownFit]:
    """The same of what a set leaves where it was flown."""
    return course_fits(courses, left.rows, left.gram[: left.first, : left.first], left.held, in_time(places), keep=True)


def wander_fits(found: Mapping[str, Wander], misfit: float, tempering: float, taken: Collection[str] = ()
                ) -> list[UnknownFit]:  # fmt: skip
    """The same of surfaces' paths, which no flight shows.

    Args:
        found: of `wandering`.
        misfit: whitened square that is left without, tempered.
        taken: components that something known enters at: what is left there is its affair.
    """
    return [_fit(component, wander.inner / tempering, wander.onto / tempering, misfit)
            for component, wander in found.items() if component not in taken]


def _products(course: Course, places: Sequence[str], parts: Sequence[FloatArray], keep: bool
              ) -> dict[str, tuple[FloatArray, FloatArray]]:  # fmt: skip
    """Inner products of a record's hats, at each component, with themselves and with other rows."""
    if keep:
        return {place: (course.inner(place, place), course.onto(place, parts)) for place in places}
    found, other = {}, np.concatenate(parts, axis=1)
    at_once = max(1, min(TOGETHER, int(MOST / course.bytes)))
    for k in range(0, len(places), at_once):
        for component, rows in course.made(places[k : k + at_once]).items():
            found[component] = np.asarray(rows.T @ rows), np.asarray(rows.T @ other)
    return found


def _counted(course: Course, products: dict[str, tuple[FloatArray, FloatArray]]
             ) -> dict[str, tuple[FloatArray, FloatArray]]:  # fmt: skip
    """The same where the wind counts the less, the more gusts there are: these are no more than nearly Dryden's."""
    less = 1.0 + (course.evidence.gain.sigma / GUSTY) ** 2
    wind = {WIND: (products[WIND][0] / less, products[WIND][1] / less)} if WIND in products else {}
    return products | wind


def _fit(component: str, inner: FloatArray, onto: FloatArray, misfit: float) -> UnknownFit:
    """Heights of unknown size integrated out; luck taken out of what they leave."""
    energy, axes = np.linalg.eigh(inner)
    energy, along = np.maximum(energy, 0.0), axes.T @ onto
    logs = []
    for size in SIZES:
        shown = size**2 * energy
        logs.append(0.5 * float(np.sum(size**2 * along**2 / (1.0 + shown)) - np.sum(np.log1p(shown))))
    best = SIZES[int(np.argmax(logs))]
    heights = best**2 * along / (1.0 + best**2 * energy)
    luck = float(np.sum(best**2 * energy / (1.0 + best**2 * energy)))
    return UnknownFit(component, float(np.logaddexp.reduce(logs) - np.log(len(SIZES))),
                      ((COURSE, float(np.sqrt(np.mean(heights**2))), best),),
                      misfit - max(float(along @ heights) - luck, 0.0), {})


def with_courses(fits: Sequence[UnknownFit], courses: Sequence[UnknownFit]) -> list[UnknownFit]:
    """Generic terms of every component, or a free course or a delay there: all counted, the likeliest told.

    Of ways that say it nearly as well, terms are told: what errors of the model's own make of so large a gap is no
    evidence against them, and a course foretells nothing of another flight.
    """
    out = []
    for u in fits:
        free = [course for course in courses if course.component == u.component]
        share = SHARE / max(len(free), 1)
        ways = [replace(u, log_evidence=u.log_evidence + float(np.log(1.0 - SHARE))),
                *(replace(way, log_evidence=way.log_evidence + float(np.log(share))) for way in free)]
        together = float(np.logaddexp.reduce([way.log_evidence for way in ways]))
        best = max(ways, key=lambda way: way.log_evidence)
        told = best if best.log_evidence - ways[0].log_evidence > ALIKE * max(u.log_evidence, 0.0) else ways[0]
        out.append(replace(told, log_evidence=together))
    return out
