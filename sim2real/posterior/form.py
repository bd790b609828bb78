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
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.library.bends import bends, natural
from sim2real.library.terms import Term
from sim2real.posterior.devices import together
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.sets import SetFit

OTHER_FORM = 0.5  # prior probability that an effect has not the library's form (assumed)
# rho: what terms at home may take, over what the set explains; equally likely, the last for single effects (assumed)
SHARES = (0.15, 0.4, 0.8)
# Of its signature, that a set may leave over for no reason that anybody could name; and where a component that it does
# not enter would be a reason: in the library's form, in another, and that as a share of how far that is from the
# library's at home (assumed).
FORGIVEN, INEXACT, LEAK, OF_FORM = 0.3, 0.003, 0.015, 0.3
UNKNOWN_FORGIVEN = 1.0  # the same of what generic terms explain where something unknown is (assumed)
DIRECTIONS = 20.0  # in which such a remainder lies for every component at home (assumed)
LUCK = 15.0  # whitened square that a free course at one component takes by luck (deviation of 120 knots' chance)
WORTH = 20.0  # log evidence that terms have to add, to be flown
LEAST = 3.0  # whitened size of a set's signature below which its form does not matter
# Generic terms by which an effect that enters at a component may differ from the library's; thrust lifts, too, through
# the slipstream.
ALIKE = {
    "propulsion": ("propulsion", "x_force", "z_force", "pitching_moment", "yawing_moment"),
    "mass": ("x_force", "z_force", "pitching_moment", "rolling_moment", "yawing_moment"),
    "wind": ("wind", "x_force", "y_force", "z_force", "sensor:airspeed", "sensor:alpha", "sensor:beta",
             "sensor:altitude"),
}
# Where an effect may enter beside, in another form: a half wing that loses its roll loses lift and gains drag, and of
# two that stall one goes first.
ALSO = {"asymmetric_ice": ("x_force", "z_force"), "early_stall": ("x_force", "rolling_moment", "yawing_moment")}


@dataclass(frozen=True)
class Liberty:
    """Where a set may be of another form.

    free: whitened square that a free course of time would take there of what the set leaves, beyond chance; places:
    components that it has; most: whitened square that it may leave there for no reason that anybody could name; beyond:
    what the course of time leaves.
    """

    free: float = np.inf
    places: int = 1
    most: float = np.inf
    beyond: float = -np.inf


@dataclass(frozen=True)
class Form:
    """A set in another form, by how much generic terms at home may take (nothing first).

    gained: log evidence that they add, prior included; left: whitened square after them, luck taken out; free: at the
    home of each member, then of all; weights: of the terms where they were flown, by row of the bank; bent: `free` of
    the ways in which terms were flown, if they were: all but none, and `own`, the generic terms beside the set that are
    the last way, if there are any; few: whether the likeliest way has powers of the set's own regressors alone.
    """

    gained: tuple[float, ...]
    left: tuple[float, ...]
    free: tuple[Liberty, ...] = (Liberty(),)
    weights: dict[int, float] = field(default_factory=dict)
    bent: tuple[Liberty, ...] = ()
    own: UnknownFit | None = None
    few: bool = False

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
        return float(np.logaddexp.reduce([self.way(k, nothing, noise, bare) for k in range(len(self.gained))]))

    def way(self, k: int, nothing: float, noise: float, bare: float) -> float:
        """The same of one way, by how much the terms may take."""
        flown = self.bent and 0 < k < len(self.gained) - (self.own is not None)
        left, free, taken = self.left[k], self.bent if flown else self.free, 2.0 * max(self.gained[k], 0.0)
        found = [forgiven(left - noise, nothing - left, max(at.beyond - bare, 0.0), at.places, at.most, taken + at.free)
                 for at in free]
        return self.gained[k] + float(np.logaddexp.reduce(found) - np.log(len(found)))

    def bare(self) -> float:
        """Whitened square that is left beside free courses of time, a little for luck."""
        return min([self.left[0], *(at.beyond + LUCK * at.places for at in (*self.free, *self.bent)
                                    if np.isfinite(at.beyond))])  # fmt: skip


def forgiven(left: float, explained: float, foreign: float = 0.0, places: int = 1, most: float = np.inf,
             form: float = np.inf) -> float:  # fmt: skip
    """Log evidence that a remainder regains where its scale is unknown.

    Args:
        left: whitened square above what noise leaves.
        explained: whitened square explained.
        foreign: as much of `left` as could not come from where the set enters.
        places: components at which it may lie.
        most: that may be left there.
        form: whitened square by which the set is of another form there.
    """
    left, explained = max(left, 0.0), max(explained, 0.0)
    elsewhere = min(max(foreign, 0.0), left)
    leaked = min(elsewhere, max(INEXACT**2 * explained, min(LEAK**2 * explained, OF_FORM**2 * form)))
    excused = leaked + min(left - elsewhere, FORGIVEN**2 * explained - leaked, most)
    directions = DIRECTIONS * places
    return float(0.5 * excused - 0.5 * directions * np.log1p(excused / directions))


def own_terms(names: Iterable[str], terms: Sequence[Term]) -> list[Term]:
    """Generic terms at the components where any of the effects enters, of a kind that its form may have."""
    places = [(_places(name), effects.LIBRARY[name]) for name in names]
    return [term for term in terms
            if any(term.component in own and natural(effect, term.component, term.name) for own, effect in places)]


def own_powers(fit: SetFit, terms: Sequence[Term]) -> NDArray[np.bool_]:
    """Which generic terms are powers of the regressors of derivatives that a set changes [terms]."""
    return np.array([any((term.component, term.name) in bends(family.effect) for family in fit.families)
                     for term in terms], bool)  # fmt: skip


def home(names: Iterable[str]) -> set[str]:
    """Components where any of the effects enters."""
    return set().union(*(_places(name) for name in names))


def at_home(component: str, names: Iterable[str]) -> bool:
    """Whether a component is one where any of the effects enters."""
    return any(component in _places(name) for name in names)


def _places(name: str) -> set[str]:
    return {c for at in effects.LIBRARY[name].enters_at for c in ALIKE.get(at, (at,))} | set(ALSO.get(name, ()))


def squares(fit: SetFit, inner: FloatArray) -> list[float]:
    """Whitened square of each member's own signature, in inner products of the rows of the bank."""
    found = []
    for family in fit.families:
        rows = [row for row in family.rows if row in (fit.weights or {})]
        w = np.array([(fit.weights or {})[row] for row in rows])
        found.append(float(w @ inner[np.ix_(rows, rows)] @ w))
    return found


def energies(own: Sequence[float], explained: float, missed: Sequence[float] = ()) -> list[float]:
    """Whitened square that each member of a set explains, together no more than the set; of one alone all of that.

    What the set would miss without it, where that is known, else the square of its own signature. Two effects that
    cancel each other explain the less, however large each of them is.

    Args:
        own: `squares`.
        missed: that square by member; infinite where it is not known.
    """
    if len(own) == 1:
        return [explained]
    each = [least if np.isfinite(least) else square
            for square, least in zip(own, missed or [np.inf] * len(own), strict=True)]
    return [square * min(explained / max(sum(each), 1e-12), 1.0) for square in each]


def room(fit: SetFit, own: Sequence[float], bending: Sequence[float], terms: Sequence[Term], kept: FloatArray,
         nothing: float, missed: Sequence[float] = ()) -> FloatArray:
    """Whitened square that each term may take where rho is one [terms].

    Every member shares the square of its own signature (`energies`) among the terms where it enters.
    A power of the regressor of a derivative that it changes may be as large as the whole change of that derivative,
    however much of this lies within the model's own uncertainty, if not all of it does.

    Args:
        own: `squares` of the members, nuisances integrated out.
        bending: of `may_bend`.
        kept: share of each term's own square that nuisances leave [terms].
        nothing: whitened square that no explanation leaves.
        missed: of `energies`.
    """
    most = energies(own, max(nothing - fit.misfit, 0.0), missed)
    out = np.zeros(len(terms))
    for family, square, energy, whole in zip(fit.families, own, most, bending, strict=True):
        energy = min(square, energy)
        home = np.array([term.component in _places(family.effect.name)
                         and natural(family.effect, term.component, term.name) for term in terms])
        if energy > LEAST**2 and home.any():
            out += home * energy / np.count_nonzero(home)
        bent = np.array([(term.component, term.name) in bends(family.effect) for term in terms])
        out = np.maximum(out, bent * kept * whole / max(int(np.count_nonzero(bent)), 1))
    return out


def may_bend(own: Sequence[float], whole: Sequence[float]) -> list[float]:
    """Whitened square that powers of its regressors may take, of each member: none within the model's uncertainty.

    Args:
        own, whole: `squares`, nuisances integrated out and where they are.
    """
    return [square if beyond > LEAST**2 else 0.0 for beyond, square in zip(own, whole, strict=True)]


def shares(names: Sequence[str]) -> tuple[float, ...]:
    """rho that a set may have: several effects with large remainders at home could be anything.

    One on a path and one in flight are two single ones: neither's home is the other's.
    """
    return SHARES if together(names) == 1 else SHARES[:-1]


def with_terms(form: Form | None, own: UnknownFit | None) -> Form | None:
    """The form with generic terms beside the set as one more way, as likely as each share."""
    if own is None or form is None:
        return form
    gained = own.log_evidence - float(np.log(len(SHARES)))
    return replace(form, gained=(*form.gained, gained), left=(*form.left, own.left), own=own)
