"""A known effect in another form than the library's: what is left over where the effect enters is its own.

Nobody's ice is a scaled derivative, and few actuators are of first order. A library effect that explains most of a gap
leaves a remainder, the larger the larger the gap; judged by the noise alone, that remainder would be blamed on further
effects. Each set is therefore also tried with generic terms at the components where its members enter, their expected
square together a share rho^2 of the set's own signature (a discrepancy with a prior tied to the model: Brynjarsdottir
& O'Hagan, Inverse Problems 30, 2014, 114007). What enters elsewhere, or is larger, is another effect or unknown.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np
from scipy.special import logsumexp

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.generic import UnknownFit
from sim2real.sets import SetFit
from sim2real.terms import Term

OTHER_FORM = 0.5  # prior probability that an effect has not the library's form (assumed)
SHARES = (0.1, 0.3, 0.7)  # rho, equally likely then; the last for single effects only (assumed)
# Share of its signature by which no simulation of a large effect is right, wherever that shows (assumed).
LEAK = 0.04
LEAST = 3.0  # whitened size of a set's signature below which its form does not matter
# Generic terms by which an effect that enters at a component may differ from the library's.
ALIKE = {
    "propulsion": ("propulsion", "x_force", "pitching_moment", "yawing_moment"),
    "mass": ("x_force", "z_force", "pitching_moment", "rolling_moment", "yawing_moment"),
    "wind": ("x_force", "y_force", "z_force", "sensor:airspeed", "sensor:alpha", "sensor:beta",
             "sensor:altitude"),
}


def own_terms(names: Iterable[str], terms: Sequence[Term]) -> list[Term]:
    """Generic terms at the components where any of the effects enters."""
    places = set().union(*(_places(name) for name in names))
    return [term for term in terms if term.component in places]


def terms_of(fit: SetFit, reduced: FloatArray, terms: Sequence[Term]) -> list[Term]:
    """Generic terms that a set's form is tried with: those of its members, all where it is large enough to leak."""
    return list(terms) if LEAK * _explained(fit, reduced) ** 0.5 > 1.0 else own_terms(fit.effects, terms)


def _explained(fit: SetFit, reduced: FloatArray) -> float:
    return max(float(reduced[0, 0]) - fit.misfit, 0.0)


def _places(name: str) -> set[str]:
    return {c for at in effects.LIBRARY[name].enters_at for c in ALIKE.get(at, (at,))}


def room(fit: SetFit, reduced: FloatArray, terms: Sequence[Term]) -> tuple[FloatArray, FloatArray]:
    """Whitened square that each term may take where rho is one [terms], and what it may take whatever the form.

    Every member shares the square of its own signature (no more than the set explains) among the terms where it enters.
    """
    explained = _explained(fit, reduced)
    out = np.zeros(len(terms))
    for family in fit.families:
        rows = [row for row in family.rows if row in (fit.weights or {})]
        w = np.array([(fit.weights or {})[row] for row in rows])
        energy = min(float(w @ reduced[np.ix_(rows, rows)] @ w), explained)
        own = np.array([term.component in _places(family.effect.name) for term in terms])
        if energy > LEAST**2 and own.any():
            out += own * energy / np.count_nonzero(own)
    return out, np.full(len(terms), LEAK**2 * explained / max(len(terms), 1))


def without(gram: FloatArray, first: int) -> tuple[FloatArray, FloatArray]:
    """Inner products of terms (from row `first` on) with one another and with row 0, the sizes between integrated out.

    A size may move by its own uncertainty, which is the unit of its row.
    """
    own, terms = np.arange(1, first), np.arange(first, len(gram))
    inner, onto = gram[np.ix_(terms, terms)], gram[terms, 0]
    if len(own):
        moved = np.linalg.solve(gram[np.ix_(own, own)] + 1e-2 * np.eye(len(own)), gram[own])
        inner, onto = inner - gram[np.ix_(terms, own)] @ moved[:, terms], onto - gram[np.ix_(terms, own)] @ moved[:, 0]
    return inner, onto


def shares(fit: SetFit) -> tuple[float, ...]:
    """rho that a set may have: several effects with large remainders at home could be anything."""
    return SHARES if len(fit.families) == 1 else SHARES[:-1]


def gain(inner: FloatArray, onto: FloatArray, square: tuple[FloatArray, FloatArray],
         rho: Sequence[float] = SHARES) -> float:
    """Log evidence that another form adds to a set, averaged over its prior.

    Args:
        inner: inner products of the terms [m, m], nuisances and sizes integrated out.
        onto: of the terms with what the set leaves over [m].
        square: of `room`, two of [m].
        rho: of `shares`.
    """
    used = np.flatnonzero((np.diag(inner) > 1e-9) & (square[0] + square[1] > 0.0))
    if not len(used):
        return 0.0
    logs = []
    for share, leak in product((0.0, *rho), (0.0, 1.0)):
        room_each = share**2 * square[0][used] + leak * square[1][used]
        prior = 0.5 * (OTHER_FORM / len(rho) if share else 1.0 - OTHER_FORM)
        size = np.sqrt(room_each / np.diag(inner)[used])
        whole = np.eye(len(used)) + inner[np.ix_(used, used)] * size[:, None] * size
        along = onto[used] * size
        log = 0.5 * float(along @ np.linalg.solve(whole, along)) - 0.5 * float(np.linalg.slogdet(whole)[1])
        most = 0.5 * float(room_each.sum())  # a Gaussian prior alone would not forbid a larger remainder
        logs.append(min(log, most) + np.log(prior))
    return float(logsumexp(logs))


def is_own(fit: SetFit, reduced: FloatArray, unknown: UnknownFit) -> bool:
    """Whether what generic terms take beside a set is another form of its effects, by place and by size."""
    taken = fit.misfit - unknown.misfit
    at_home = any(unknown.component in _places(name) for name in fit.effects)
    return at_home and taken <= max(shares(fit)) ** 2 * _explained(fit, reduced)


def split(fit: SetFit, reduced: FloatArray, fits: Sequence[UnknownFit]) -> tuple[float, list[UnknownFit]]:
    """What a set gains where the best of generic fits beside it is its own form, and the fits that are not."""
    own = [u for u in fits if is_own(fit, reduced, u)]
    gained = max((u.log_evidence for u in own), default=-np.inf) + np.log(OTHER_FORM / len(SHARES))
    return float(gained), [u for u in fits if u not in own]
