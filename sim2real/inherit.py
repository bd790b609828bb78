"""What a set that was not flown inherits from the largest set within it that was."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from sim2real.form import Form
from sim2real.hypotheses import Hypothesis


def inherited(found: Sequence[Hypothesis], before: Sequence[Hypothesis], bases: Iterable[int],
               points: Iterable[int]) -> list[Hypothesis]:
    """Sets that were not flown, corrected by as much as the largest set within them was that was.

    What polynomials in its size miss of an effect they miss in every set that holds it; else the sets that nobody has
    flown yet would always look best.
    """
    flown, out = [j for j in bases if found[j].effects], list(found)
    for i, h in enumerate(before):
        within = [j for j in flown if set(before[j].effects) <= set(h.effects)]
        if i in points or not within:
            continue
        nearest = max(within, key=lambda j: len(before[j].effects))
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
    """A form corrected by as much as that of a set within was."""
    more, one, other = now.fit.misfit - then.fit.misfit, now.form, then.form
    if one is None or other is None or not len(form.gained) == len(one.gained) == len(other.gained):
        return Form(form.gained, tuple(left + more for left in form.left),
                    form.free if one is None else one.free)
    ways = range(len(form.gained))
    return Form(tuple(form.gained[k] + one.gained[k] - other.gained[k] for k in ways),
                tuple(form.left[k] + one.left[k] - other.left[k] for k in ways), one.free)
