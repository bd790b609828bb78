"""What flying a set where it lies changes: its own evidence and sizes, and those of the larger sets that hold it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.flown.steps import Point, bounded_step, ranges, rooms
from sim2real.library.candidates import Family, piece_at
from sim2real.library.sizes import in_powers
from sim2real.posterior.form import SHARES, Form
from sim2real.posterior.hypotheses import Hypothesis, Posterior
from sim2real.posterior.sets import Modes, SetFit, integrate

LOST = 100.0  # times the log likelihood that nothing at all loses, and some, beyond which a set does not fly


def inherited(found: Sequence[Hypothesis], before: Sequence[Hypothesis], bases: Iterable[int],
              points: Iterable[int]) -> list[Hypothesis]:
    """Sets that were not flown, corrected by as much as the largest set within them was that was.

    What polynomials in its size miss of an effect they miss in every set that holds it; else the sets that nobody has
    flown yet would always look best. Of sets as large, by the one that lost most.
    """
    flown, out = [j for j in bases if found[j].effects], list(found)
    for i, h in enumerate(before):
        within = [j for j in flown if set(before[j].effects) <= set(h.effects)]
        if i in points or not within:
            continue
        nearest = min(within, key=lambda j: (-len(before[j].effects), found[j].log_evidence - before[j].log_evidence))
        now, then = found[nearest], before[nearest]
        more = now.fit.misfit - then.fit.misfit
        form, unknown = h.form, h.unknown
        if form is not None:
            form = _moved(form, now, then)
        if unknown is not None:
            unknown = replace(unknown, misfit=unknown.misfit + more)
        out[i] = replace(h, fit=replace(h.fit, misfit=h.fit.misfit + more), form=form, unknown=unknown,
                         log_evidence=h.log_evidence + now.log_evidence - then.log_evidence)
    return out


def _moved(form: Form, now: Hypothesis, then: Hypothesis) -> Form:
    """A form corrected by as much as that of a set within was, in the ways that all sets have."""
    more, one, other = now.fit.misfit - then.fit.misfit, now.form, then.form
    gained, left = list(form.gained), [left + more for left in form.left]
    if one is None or other is None:
        return replace(form, left=tuple(left))
    for k in range(min(len(SHARES), *(len(f.gained) for f in (form, one, other)))):
        gained[k] += one.gained[k] - other.gained[k]
        left[k] = form.left[k] + one.left[k] - other.left[k]
    more = form.left[0] - other.left[0]
    free, bent = ([replace(at, beyond=at.beyond + more) for at in places] for places in (one.free, one.bent))
    return Form(tuple(gained), tuple(left), tuple(free), bent=tuple(bent), own=form.own)


def corrected(hypothesis: Hypothesis, point: Point, posterior: Posterior, pieces: Sequence[Family]) -> Hypothesis:
    """Evidence and sizes of a set from where it settled: its likelihood is taken as Gaussian there.

    Where it does not fly at all, its slopes say nothing, and it is as bad as it was flown.

    Args:
        pieces: of all parameters' ranges; a set may have settled in others than the linear fit put it.
    """
    none = 0.5 * float(posterior.reduced[0, 0])
    if lost(point, posterior):
        return replace(hypothesis, log_evidence=none - point.cost, form=None, instead=None,
                       fit=replace(hypothesis.fit, misfit=2.0 * point.cost))  # fmt: skip
    k = len(point.sizes)
    across, others = point.information[:k, k:], point.information[k:, k:]
    onto: FloatArray = np.asarray(np.linalg.solve(others, np.column_stack([point.slope[k:], across.T])), np.float64)
    cost = point.cost - 0.5 * float(point.slope[k:] @ onto[:, 0])
    if k == 0:
        return replace(hypothesis, log_evidence=none - cost, fit=replace(hypothesis.fit, misfit=2.0 * cost))
    slope, information = point.slope[:k] - across @ onto[:, 0], point.information[:k, :k] - across @ onto[:, 1:]
    own = zip(hypothesis.fit.families, point.sizes, strict=True)
    placed = replace(hypothesis.fit, families=tuple(piece_at(family, float(size), pieces) for family, size in own))
    fit = _integrated(placed, point, cost, slope, information)
    log = fit.log_evidence + none
    return replace(hypothesis, log_evidence=log, fit=replace(fit, log_evidence=log))


def lost(point: Point, posterior: Posterior) -> bool:
    """Whether a set departs from flight where it settled: nothing at all is far nearer to the records."""
    return point.cost > LOST * (0.5 * float(posterior.reduced[0, 0]) + 1e4)


def _integrated(fit: SetFit, point: Point, cost: float, slope: FloatArray, information: FloatArray) -> SetFit:
    """Prior times a Gaussian likelihood of the sizes, over their whole ranges; log_evidence is the log of its integral.

    Args:
        point: where the set was flown.
        cost, slope, information: half the whitened square there, nuisances at their best, and its derivatives by sizes
            in ranges of their parameters. The best may lie at an end of a range, where the slope is none.
    """
    families, k = fit.families, len(point.sizes)
    size = 1 + max(max(f.rows) for f in families)
    whole = tuple(replace(f, low=f.parameter.low, high=f.parameter.high) for f in families)
    base, span = in_powers(np.zeros((size, size)), whole), ranges(fit)
    low, high = (room[:k] for room in rooms(fit, point, span))
    step = bounded_step(information, slope, low, high)
    x, best = ((sizes - base.neutral) / base.reach for sizes in (point.sizes, point.sizes + step * span))
    g, H = slope * base.reach / span, information * np.outer(base.reach / span, base.reach / span)
    gram = np.zeros((1 + k, 1 + k))
    gram[0, 0], gram[0, 1:], gram[1:, 1:] = 2.0 * (cost - g @ x) + x @ H @ x, g - H @ x, H
    gram[1:, 0] = gram[0, 1:]
    modes = Modes(np.arange(k)[None], best[None], np.array([cost]), H[None], np.zeros(1))
    found = integrate(replace(base, gram=gram, degree=1), modes, 0)
    return replace(found, families=families, log_evidence=found.log_evidence - 0.5 * float(gram[0, 0]))
