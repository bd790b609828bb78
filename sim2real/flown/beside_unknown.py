"""A known effect beside something unknown that is likelier than any single effect: where that is another one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.flown.companions import LEAST_ADDED
from sim2real.library.candidates import Bank
from sim2real.posterior.attribution import of_one
from sim2real.posterior.form import WORTH, Form, at_home
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import Hypothesis, Posterior
from sim2real.posterior.prior import single_prior, unknown_prior
from sim2real.posterior.singles import EffectFit, fit_family


def accompanied(found: Iterable[Hypothesis], linear: Posterior, candidates: Bank) -> list[Hypothesis]:
    """Something unknown by itself with the effect that explains most of what it leaves, if that is much.

    Among single effects one that does a little of what is unknown may be far ahead of that. Evidence is what the
    unknown has, flown, and what the effect adds to all that its component could do.
    """
    alone = next((h for h in found if h.unknown is not None and not h.effects), None)
    if alone is None or alone.unknown is None or not alone.unknown.weights or alone.unknown.log_evidence < WORTH:
        return []
    left = _without(linear.reduced, alone.unknown, candidates)
    best = _most(left, alone.unknown, linear, candidates)
    if best is None or best.log_evidence < LEAST_ADDED:
        return []
    taken = float(left[0, 0]) - best.misfit
    return [replace(alone, fit=of_one(best), unknown=replace(alone.unknown, misfit=alone.unknown.misfit - taken),
                    log_prior=unknown_prior(single_prior(len(linear.fits))),
                    log_evidence=alone.log_evidence + best.log_evidence,
                    form=None if alone.form is None else _less(alone.form, taken))]  # fmt: skip


def _without(reduced: FloatArray, unknown: UnknownFit, candidates: Bank) -> FloatArray:
    """Inner products without what any terms of its component explain."""
    rows = [term.row for term in candidates.terms if term.component == unknown.component]
    across = reduced[rows]
    return np.asarray(reduced - across.T @ np.linalg.solve(reduced[np.ix_(rows, rows)] + np.eye(len(rows)), across))


def _most(left: FloatArray, unknown: UnknownFit, linear: Posterior, candidates: Bank) -> EffectFit | None:
    """The likeliest effect that enters elsewhere."""
    able = [f for f in candidates.families
            if f.effect.name in linear.fits and not at_home(unknown.component, (f.effect.name,))]  # fmt: skip
    fits = [fit_family(left, family) for family in able]
    return max((fit for fit in fits if np.isfinite(fit.log_evidence)), key=lambda fit: fit.log_evidence, default=None)


def _less(form: Form, taken: float) -> Form:
    """What is forgiven of a remainder, so much of which is explained."""
    return replace(form, left=tuple(left - taken for left in form.left),
                   free=tuple(replace(at, beyond=at.beyond - taken) for at in form.free))  # fmt: skip
