"""What explanations are forgiven: other forms than the library's, and what these leave; company counts less for it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from icing_env import effects
from sim2real.actuators.paths import PATHS
from sim2real.posterior.devices import apart, within
from sim2real.posterior.form import LEAST, OTHER_FORM, SHARES, forgiven
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import Hypothesis
from sim2real.posterior.likeness import MOSTLY

# Log evidence that another form leaves elsewhere, over the root of what it regains. Company that was none gained 3, 10
# and 13 beside forms of 15,000, 38,000 and 24,000; company that was there 1.5 to 9 beside 16 to 810 (a sealed set).
ELSEWHERE = 1.0 / 7.0
# The same of the library's own form, over the whitened size of what it explains: no model is exact to a hundredth of
# what it predicts. A half wing's ice of 1,900 units left 8 of log evidence for an inertia that was none (development).
INEXACT = 0.01


def forgive(found: Sequence[Hypothesis], nothing: float, least: float, bare: float = 0.0,
            believed: Collection[int] | None = None) -> list[Hypothesis]:
    """Hypotheses with what another form, and a remainder that is forgiven, regain.

    Args:
        nothing: whitened square that no explanation at all leaves.
        least: what noise alone would leave.
        bare: the same beside free courses of time, where these are known.
        believed: indices of the sets whose evidence is believed when it serves smaller ones; all if omitted.
    """
    alone = [replace(h, regained=_regained(h, nothing, least, bare)) for h in found]
    larger = alone if believed is None else [alone[i] for i in believed]
    by_count = dict[int, list[Hypothesis]]()
    for h in larger:
        if h.unknown is None and len(h.effects) > 1:
            by_count.setdefault(len(h.effects), []).append(h)
    told = _in_company([_with_guests(h, by_count.get(len(h.effects) + 1, ()), nothing) for h in alone])
    return _leaking(told, nothing)


def _in_company(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Pairs, that regain by form no more than one member does alone and what the other explains gives reason for.

    Terms are linear about where a set was flown, and a little off each time: of a large form that is more than an idle
    companion costs.
    """
    alone = {h.effects[0]: h for h in found if len(h.effects) == 1 and h.unknown is None}

    def most(h: Hypothesis) -> float:
        out = [np.inf]
        for family, there in zip(h.fit.families, h.form.free if h.form else (), strict=False):
            one = alone.get(family.effect.name)
            if one is None or one.form is None or not np.isfinite([there.beyond, one.form.free[0].beyond]).all():
                continue
            plain, free = one.fit.misfit - h.fit.misfit, one.form.free[0].beyond - there.beyond
            other = max(plain, free)  # what the other explains
            form = SHARES[-1] ** 2 * other if other > LEAST**2 else 0.0
            form += max(_by_other_terms(h) - _by_other_terms(one), 0.0)  # the other's form is no guess
            out.append(one.regained + 0.5 * (max(free - plain, 0.0) + form))
        return min(out)

    return _in_larger([replace(h, regained=min(h.regained, most(h))) if len(h.effects) == 2 and h.unknown is None else h
                       for h in found])  # fmt: skip


def _by_other_terms(h: Hypothesis) -> float:
    """Whitened square that a set leaves less where terms that say it better are in its place."""
    return 0.0 if h.instead is None else max(h.fit.misfit - h.instead.left, 0.0)


def _in_larger(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Larger sets, that regain no more than one without a member does, and what that member gives reason for."""
    pairs = {h.effects: h for h in found if len(h.effects) == 2 and h.unknown is None}

    def most(h: Hypothesis) -> float:
        within = [pairs[two] for two in combinations(h.effects, 2) if two in pairs]
        more = [(two, max(two.fit.misfit - h.fit.misfit, 0.0)) for two in within]
        return max((two.regained + 0.5 * SHARES[-1] ** 2 * other * (other > LEAST**2) for two, other in more),
                   default=np.inf)  # fmt: skip

    return [replace(h, regained=min(h.regained, most(h))) if len(h.effects) > 2 and h.unknown is None else h
            for h in found]  # fmt: skip


def _leaking(found: Sequence[Hypothesis], nothing: float) -> list[Hypothesis]:
    """Company of effects, less what these leave elsewhere: in another form most, in the library's little.

    No form is wholly a free course at the effect's own place; what it leaves at others goes with it, and is no second
    gap. Paths leave nothing in flights, and flights nothing in paths. Of what is farther behind than its form could
    leave, the form is no reason for company. What is unknown is no better described by its terms than by a form.
    """
    strange = [(h.log_posterior, h.unknown) for h in found if h.unknown is not None and not h.effects]
    smaller = {h.effects: h for h in found if h.effects and h.unknown is None}

    def leaks(h: Hypothesis) -> float:
        out, largest = 0.0, len(h.effects) - (h.unknown is None)
        for some in (some for n in range(1, largest + 1) for some in combinations(h.effects, n)):
            if some in smaller and _reaches(some, [name for name in h.effects if name not in some], h.unknown):
                most = elsewhere(smaller[some].regained, nothing - smaller[some].fit.misfit)
                lead = h.log_posterior - smaller[some].log_posterior
                out = max(out, float(np.clip(2.0 * most - lead, 0.0, most)))
        for ahead, alone in strange if h.unknown is not None and h.effects else ():
            if _leaves(alone, h.effects):
                most = elsewhere(alone.log_evidence, 0.0)
                out = max(out, float(np.clip(2.0 * most - (h.log_posterior - ahead), 0.0, most)))
        return out

    return [replace(h, regained=h.regained - leaks(h)) for h in found]


def _leaves(alone: UnknownFit, company: Sequence[str]) -> bool:
    """Whether what something unknown leaves could be told as effects."""
    return alone.component not in PATHS[:-1] and any(not apart(effects.LIBRARY[name]) for name in company)


def _reaches(some: Sequence[str], company: Sequence[str], unknown: UnknownFit | None) -> bool:
    """Whether what some effects leave could be told as others, or as something unknown."""
    flown = [not apart(effects.LIBRARY[name]) for name in company]
    flown += [] if unknown is None else [unknown.component not in PATHS[:-1]]
    return any(flown) and not all(apart(effects.LIBRARY[name]) for name in some)


def elsewhere(regained: float, explained: float) -> float:
    """Log evidence that a set may leave at other places: it goes with the amplitude of its form, and of itself.

    Args:
        regained: log evidence regained by another form than the library's.
        explained: whitened square that the set explains.
    """
    return float(max(ELSEWHERE * np.sqrt(max(regained, 0.0)), INEXACT * np.sqrt(max(explained, 0.0))))


def _with_guests(h: Hypothesis, larger: Sequence[Hypothesis], nothing: float) -> Hypothesis:
    """A set with what larger ones gain by a member that enters nowhere but where one of its own does.

    An actuator of second order looks like lag with some gearing: a little of another effect, at the same place as one
    that explains most, is another form of that.

    Args:
        larger: sets of one member more.
    """
    if not h.effects or h.unknown is not None:
        return h
    own = set(h.effects)
    gained = [g.log_evidence + g.regained - h.log_evidence for g in larger
              if own < set(g.effects)
              and all(within(name, h.effects) for name in set(g.effects) - own)
              and nothing - h.fit.misfit > MOSTLY * (nothing - g.fit.misfit)]
    if not gained:
        return h
    return replace(h, regained=float(np.logaddexp(h.regained, max(gained) + np.log(OTHER_FORM / len(SHARES)))))


def _regained(h: Hypothesis, nothing: float, least: float, bare: float) -> float:
    if h.form is None:
        return 0.0 if h.unknown is None else forgiven(h.left - least, nothing - h.left)
    if h.unknown is not None:
        return h.form.regained(nothing, least, bare)
    other = h.form.regained(nothing, least, bare)
    if h.instead is not None:
        left = h.instead.left
        alone = h.instead.log_evidence - h.log_evidence + forgiven(left - least, nothing - left)
        other = float(np.logaddexp(other, alone - np.log(len(SHARES))))
    return float(np.logaddexp(np.log(1.0 - OTHER_FORM), np.log(OTHER_FORM) + other))
