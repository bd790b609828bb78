"""A known effect in another form than the library's: what is left over is its own, as far as that is to be expected.

Nobody's ice is a scaled derivative, and few actuators are of first order. A library effect that explains most of a gap
leaves a remainder, the larger the larger the gap; judged by the noise alone, that remainder would be blamed on further
effects. Each set is therefore also tried in another form, with a prior tied to the set's own signature (a discrepancy:
Brynjarsdottir & O'Hagan, Inverse Problems 30, 2014, 114007), of two kinds. Generic terms at the components where its
members enter may take up to as much as these explain. What even these leave is weighed by a likelihood that grows with
the logarithm of a large remainder (one of unknown scale in a few directions: integrating the variance out of a
Gaussian's gives a Student's t), up to a share of what the set explains. What is larger is another effect or unknown.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.candidates import Family
from sim2real.generic import UnknownFit
from sim2real.sets import SetFit
from sim2real.terms import Term

OTHER_FORM = 0.5  # prior probability that an effect has not the library's form (assumed)
# rho: what terms at home may take, over what the set explains; equally likely, the last for single effects (assumed)
SHARES = (0.15, 0.4, 0.8)
# Of its signature, that a set may leave over for no reason that anybody could name; and where a component that it does
# not enter would be a reason (assumed).
FORGIVEN, LEAK = 0.3, 0.005
UNKNOWN_FORGIVEN = 1.0  # the same of what generic terms explain where something unknown is (assumed)
DIRECTIONS = 10.0  # in which such a remainder lies for every component at home (assumed)
LUCK = 15.0  # whitened square that a free course at one component takes by luck (deviation of 120 knots' chance)
MOSTLY, SHAPE = 0.6, 0.8  # of what generic terms explain, of their shape: an effect that is more of it is what they are
LEAST = 3.0  # whitened size of a set's signature below which its form does not matter
# Generic terms by which an effect that enters at a component may differ from the library's.
ALIKE = {
    "propulsion": ("propulsion", "x_force", "pitching_moment", "yawing_moment"),
    "mass": ("x_force", "z_force", "pitching_moment", "rolling_moment", "yawing_moment"),
    "wind": ("x_force", "y_force", "z_force", "sensor:airspeed", "sensor:alpha", "sensor:beta",
             "sensor:altitude"),
}
# Where an effect may enter beside, in another form: a half wing that loses its roll loses lift and gains drag.
ALSO = {"asymmetric_ice": ("x_force", "z_force")}


@dataclass(frozen=True)
class Liberty:
    """Where a set may be of another form.

    free: whitened square that a free course of time would take there of what the set leaves, beyond chance; places:
    components that it has; most: whitened square that it may leave there for no reason that anybody could name.
    """

    free: float = np.inf
    places: int = 1
    most: float = np.inf


@dataclass(frozen=True)
class Form:
    """A set in another form, by how much generic terms at home may take (nothing first).

    gained: log evidence that they add, prior included; left: whitened square after them, luck taken out; free: at the
    home of each member, then of all.
    """

    gained: tuple[float, ...]
    left: tuple[float, ...]
    free: tuple[Liberty, ...] = (Liberty(),)

    @property
    def least(self) -> float:
        """Whitened square left where the terms take most."""
        return min(self.left)

    def regained(self, nothing: float, noise: float, bare: float = 0.0) -> float:
        """Log evidence of another form, with what is forgiven.

        Args:
            nothing: whitened square that no explanation leaves.
            noise: that the best one leaves.
            bare: that the best one leaves beside free courses of time at home.
        """
        return float(logsumexp([self.way(k, nothing, noise, bare) for k in range(len(self.gained))]))

    def way(self, k: int, nothing: float, noise: float, bare: float) -> float:
        """The same of one way, by how much the terms may take."""
        left = self.left[k]
        found = [forgiven(left - noise, nothing - left, max(self.left[0] - at.free - bare, 0.0), at.places, at.most)
                 for at in self.free]
        return self.gained[k] + float(logsumexp(found) - np.log(len(found)))

    def bare(self) -> float:
        """Whitened square that is left beside free courses of time, a little for luck."""
        return min(self.left[0] - at.free + LUCK * at.places for at in self.free)


def forgiven(left: float, explained: float, foreign: float = 0.0, places: int = 1, most: float = np.inf) -> float:
    """Log evidence that a remainder regains where its scale is unknown.

    Args:
        left: whitened square above what noise leaves.
        explained: whitened square explained.
        foreign: as much of `left` as could not come from where the set enters.
        places: components at which it may lie.
        most: that may be left there.
    """
    left, explained = max(left, 0.0), max(explained, 0.0)
    elsewhere = min(max(foreign, 0.0), left)
    leaked = min(elsewhere, LEAK**2 * explained)
    excused = leaked + min(left - elsewhere, FORGIVEN**2 * explained - leaked, most)
    directions = DIRECTIONS * places
    return float(0.5 * excused - 0.5 * directions * np.log1p(excused / directions))


def own_terms(names: Iterable[str], terms: Sequence[Term]) -> list[Term]:
    """Generic terms at the components where any of the effects enters."""
    places = home(names)
    return [term for term in terms if term.component in places]


def home(names: Iterable[str]) -> set[str]:
    """Components where any of the effects enters."""
    return set().union(*(_places(name) for name in names))


def at_home(component: str, names: Iterable[str]) -> bool:
    """Whether a component is one where any of the effects enters."""
    return any(component in _places(name) for name in names)


def _places(name: str) -> set[str]:
    return {c for at in effects.LIBRARY[name].enters_at for c in ALIKE.get(at, (at,))} | set(ALSO.get(name, ()))


def energies(fit: SetFit, reduced: FloatArray, explained: float) -> list[float]:
    """Whitened square of each member's own signature, no more than the set explains; of one alone all of that."""
    if len(fit.families) == 1:
        return [explained]
    return [min(_energy(fit, family, reduced), explained) for family in fit.families]


def _energy(fit: SetFit, family: Family, reduced: FloatArray) -> float:
    rows = [row for row in family.rows if row in (fit.weights or {})]
    w = np.array([(fit.weights or {})[row] for row in rows])
    return float(w @ reduced[np.ix_(rows, rows)] @ w)


def room(fit: SetFit, reduced: FloatArray, terms: Sequence[Term], nothing: float) -> FloatArray:
    """Whitened square that each term may take where rho is one [terms].

    Every member shares the square of its own signature (no more than the set explains) among the terms where it enters.

    Args:
        nothing: whitened square that no explanation leaves.
    """
    explained = max(nothing - fit.misfit, 0.0)
    out = np.zeros(len(terms))
    for family in fit.families:
        energy = min(_energy(fit, family, reduced), explained)
        own = np.array([term.component in _places(family.effect.name) for term in terms])
        if energy > LEAST**2 and own.any():
            out += own * energy / np.count_nonzero(own)
    return out


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


def shares(members: int) -> tuple[float, ...]:
    """rho that a set may have: several effects with large remainders at home could be anything."""
    return SHARES if members == 1 else SHARES[:-1]


def gain(inner: FloatArray, onto: FloatArray, square: FloatArray, misfit: float,
         rho: Sequence[float] = SHARES, places: int = 1) -> Form:
    """What generic terms at home add to a set, averaged over the prior of another form.

    Args:
        inner: inner products of the terms [m, m], nuisances and sizes integrated out.
        onto: of the terms with what the set leaves over [m].
        square: of `room` [m].
        misfit: whitened square that the set leaves over.
        rho: of `shares`.
        places: components that are home.
    """
    used = np.flatnonzero((np.diag(inner) > 1e-9) & (square > 0.0))
    if not len(used):
        return Form((0.0,), (misfit,), (Liberty(places=places),))
    logs, taken = [0.0], [0.0]
    for share in rho:
        most = share**2 * square[used]
        size = np.sqrt(most / np.diag(inner)[used])
        scaled = inner[np.ix_(used, used)] * size[:, None] * size
        along = onto[used] * size
        at = np.linalg.solve(np.eye(len(used)) + scaled, along)
        log = 0.5 * float(along @ at) - 0.5 * float(np.linalg.slogdet(np.eye(len(used)) + scaled)[1])
        # a Gaussian prior alone would not forbid a larger remainder
        logs.append(min(log, 0.5 * float(most.sum())))
        share_of = np.linalg.solve(np.eye(len(used)) + scaled, scaled)  # of noise, that so many terms take
        luck = float(2.0 * np.trace(share_of) - np.sum(share_of * share_of.T))
        taken.append(min(max(float(2.0 * at @ along - at @ scaled @ at) - luck, 0.0), float(most.sum())))
    return Form(tuple(log - float(np.log(len(logs))) for log in logs), tuple(misfit - t for t in taken),
                (Liberty(places=places),))


def given(left: FloatArray, rows: Sequence[int], square: FloatArray, share: float) -> FloatArray:
    """Inner products `left` after generic terms at `rows` have taken what `share` of the prior's allows them.

    Args:
        left: of what is left (row 0) and of generic terms.
        square: of `room` [rows].
    """
    used = [(row, share**2 * s / left[row, row]) for row, s in zip(rows, square, strict=True)
            if left[row, row] > 1e-9 and s > 0.0]  # fmt: skip
    at, variance = [row for row, _ in used], np.array([v for _, v in used])
    return np.asarray(left - left[:, at] @ np.linalg.solve(left[np.ix_(at, at)] + np.diag(1.0 / variance), left[at]))


def alike(fit: SetFit, unknown: UnknownFit, raw: FloatArray) -> float:
    """Squared cosine between what generic terms make of the records and an effect of a set that enters there.

    Nuisances stay where they are: a moment that saturates with sideslip is first of all a moment of sideslip, even if
    the linear part of it is within the model's own uncertainty.

    Args:
        raw: inner products of all rows of the bank.
    """
    found = [0.0]
    for family in fit.families:
        if at_home(unknown.component, (family.effect.name,)):
            one = {row: w for row, w in (fit.weights or {}).items() if row in family.rows}
            found.append(_cosine(one, unknown.weights, raw))
    return max(found)


def _cosine(one: dict[int, float], other: dict[int, float], raw: FloatArray) -> float:
    rows = [*one, *other]
    a, b = np.zeros(len(rows)), np.array([*([0.0] * len(one)), *other.values()])
    a[: len(one)] = list(one.values())
    inner = raw[np.ix_(rows, rows)]
    return float((a @ inner @ b) ** 2 / max((a @ inner @ a) * (b @ inner @ b), 1e-30))


def is_own(fit: SetFit, unknown: UnknownFit, nothing: float, raw: FloatArray) -> bool:
    """Whether what generic terms take beside a set is another form of its effects, by place and by size or shape."""
    taken = fit.misfit - unknown.misfit
    most = max(shares(len(fit.families))) ** 2 * max(nothing - fit.misfit, 0.0)
    return at_home(unknown.component, fit.effects) and (taken <= most or alike(fit, unknown, raw) > SHAPE)


def split(fit: SetFit, fits: Sequence[UnknownFit], nothing: float,
          raw: FloatArray) -> tuple[UnknownFit | None, list[UnknownFit]]:
    """The best of the generic fits beside a set that is its own form, and the fits that are not."""
    own = [u for u in fits if is_own(fit, u, nothing, raw)]
    return max(own, key=lambda u: u.log_evidence, default=None), [u for u in fits if u not in own]


def with_terms(form: Form | None, own: UnknownFit | None) -> Form | None:
    """The form with generic terms beside the set as one more way, as likely as each share."""
    if own is None or form is None:
        return form
    gained = own.log_evidence - float(np.log(len(SHARES)))
    return replace(form, gained=(*form.gained, gained), left=(*form.left, own.left))
