"""Whether generic terms are an effect of the library in another form: by place, and by size, shape or calibration."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from icing_env import effects
from icing_env.effects import Effect
from icing_env.record import FloatArray
from sim2real.library.bends import (
    COMPONENTS,
    bends,
    changes,
    grows,
    natural,
    of_own,
    powerless,
    purely_own,
    scales,
    shifts,
)
from sim2real.posterior.form import LEAST, SHARES, WORTH, Form, at_home
from sim2real.posterior.generic import COURSE, UnknownFit
from sim2real.posterior.sets import SetFit

FOREIGN = 0.5  # of the shape of generic terms: an effect to which less of it belongs is not what they are (assumed)
OF_PATH = {"_gearing": ("1", "position", "position*position*position"), "_lag": ("acceleration", "inertia"),
           "_offset": ("1", "airspeed", "alpha", "p", "beta")}  # generic terms that are the like of each of its numbers
MOSTLY, SHAPE = 0.6, 0.8  # of what generic terms explain, of their shape: an effect that is more of it is what they are
POWERED = 0.98  # of what terms that go with power explain: an effect on the airframe that is less is not what they are
FORMED = 0.9  # of what they explain, its own form allowed: an effect that is so much of it may be foreign to their kind
SOME = 0.2  # of what they explain: an effect that is less of it is not what they are for their shape (assumed)
PURE = 0.4  # of what they explain, as much where they are functions of its own regressors and of nothing else (assumed)


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


def like(fit: SetFit, unknown: UnknownFit, raw: FloatArray, share: float) -> bool:
    """Whether generic terms are an effect's form for their shape, though it explains the less of what they do.

    Powers of its own regressors are, however little: the line among them may lie within the model's own uncertainty.
    Of others, what the model's numbers take anyway makes shapes alike (a lift that lags is first of all lift); most
    must be of the effect's own regressors, and it must explain some. Where all are, nearly half of it is enough,
    whatever their shape: a drag that bends with the angle of attack is not a line of its square.

    Args:
        share: that the effect explains of what the terms do.
    """
    if share > PURE and all(any(purely_own(f.effect, unknown.component, term) for f in fit.families)
                            for term, _, _ in unknown.terms):  # fmt: skip
        return True
    if alike(fit, unknown, raw) <= SHAPE:
        return False
    own = {term for term, _, _ in unknown.terms if any(of_own(f.effect, unknown.component, term) for f in fit.families)}
    return _bent(fit, unknown) or (share > SOME and _share(own, unknown, raw) > SHAPE)


def bent_gear(fit: SetFit, unknown: UnknownFit) -> bool:
    """Whether generic terms are a gear that bends, of a surface whose gearing a set changes, however little that says.

    Its cube may undo its line over the commands that were flown, and nothing else on a path is a line and its cube.
    """
    return unknown.component.endswith("_path") and _bent(fit, unknown)


def calibration(name: str, unknown: UnknownFit, raw: FloatArray) -> bool:
    """Whether generic terms are mostly a function of the one reading that an effect scales, or an offset of it.

    Or what an effect mostly does that is a constant in the library. Whatever the effect itself explains of them: a part
    of an offset is within what a calibration leaves anyway.
    """
    channel = scales(effects.LIBRARY[name]) or shifts(effects.LIBRARY[name])
    growing = {term for component, term in grows(effects.LIBRARY[name]) if component == unknown.component}
    if growing:
        return _share(growing, unknown, raw) > SHAPE
    own = {term for term, _, _ in unknown.terms if natural(effects.LIBRARY[name], unknown.component, term)}
    return bool(channel) and unknown.component == f"sensor:{channel}" and _share(own, unknown, raw) > SHAPE


def foreign(name: str, unknown: UnknownFit, raw: FloatArray) -> bool:
    """Whether generic terms of an actuator's path are mostly of a kind that an effect on it is not.

    What small commands lose is no gearing and no lag, even where either explains more than half of it.
    """
    own = {term for number in changes(effects.LIBRARY[name]) for end, terms in OF_PATH.items() if number.endswith(end)
           for term in terms}  # fmt: skip
    return bool(own) and unknown.component.endswith("_path") and _share(own, unknown, raw) < FOREIGN


def powered(name: str, unknown: UnknownFit) -> bool:
    """Whether the surest generic term of a force or moment goes with power, and an effect changes the airframe alone.

    A propeller's torque is no form of ice on half a wing, though that explains two thirds of it.
    """
    airframe = unknown.component in COMPONENTS.values() and powerless(effects.LIBRARY[name])
    return airframe and "CT" in unknown.surest.split("*")


def _share(own: Collection[str], unknown: UnknownFit, raw: FloatArray) -> float:
    """Squared cosine between generic terms and some of them, by name."""
    weights = zip((term for term, _, _ in unknown.terms), unknown.weights.items(), strict=False)
    part = {row: w for term, (row, w) in weights if term in own}
    return _cosine(part, unknown.weights, raw) if part else 0.0


def _cosine(one: dict[int, float], other: dict[int, float], raw: FloatArray) -> float:
    rows = [*one, *other]
    a, b = np.zeros(len(rows)), np.array([*([0.0] * len(one)), *other.values()])
    a[: len(one)] = list(one.values())
    inner = raw[np.ix_(rows, rows)]
    return float((a @ inner @ b) ** 2 / max((a @ inner @ a) * (b @ inner @ b), 1e-30))


def is_own(fit: SetFit, unknown: UnknownFit, nothing: float, raw: FloatArray, explained: Sequence[float]) -> bool:
    """Whether what generic terms take beside a set is another form of its effects, by place and by size or shape.

    By size it is the form of one member, as large as that might have by itself: company neither widens nor narrows it.
    What these records do not show by itself has no other form that they show.

    Args:
        explained: of `form.energies`.
    """
    able = [most for family, most in zip(fit.families, explained, strict=True) if _may_be(family.effect, unknown)]
    if bent_gear(fit, unknown):
        return True
    if nothing - fit.misfit <= LEAST**2 or not able:
        return False
    taken = fit.misfit - unknown.misfit
    return taken <= SHARES[-1] ** 2 * max(able) or alike(fit, unknown, raw) > SHAPE or _bent(fit, unknown)


def _may_be(effect: Effect, unknown: UnknownFit) -> bool:
    """Whether generic terms are at an effect's home, and of a kind that its form may have."""
    return at_home(unknown.component, (effect.name,)) and all(
        name == COURSE or natural(effect, unknown.component, name) for name, _, _ in unknown.terms)


def _bent(fit: SetFit, unknown: UnknownFit) -> bool:
    """Whether generic terms are powers of the regressors of derivatives that a set changes, and nothing else."""
    return all(any((unknown.component, name) in bends(family.effect) for family in fit.families)
               for name, _, _ in unknown.terms)  # fmt: skip


def split(fit: SetFit, form: Form | None, fits: Sequence[UnknownFit], nothing: float, raw: FloatArray,
          explained: Sequence[float]) -> tuple[UnknownFit | None, list[UnknownFit]]:
    """The best of the generic fits beside a set that is its own form, and the fits that are not.

    What terms at home do beside a set, and its form does as well, is that form, told in fewer terms.

    Args:
        nothing, raw, explained: of `is_own`.
    """
    # a share is one of several, of which the terms will be one too
    as_well = -np.inf if form is None else float(np.logaddexp.reduce(form.gained) + np.log(len(SHARES)))
    own = [u for u in fits if is_own(fit, u, nothing, raw, explained)
           or (at_home(u.component, fit.effects) and WORTH < u.log_evidence <= as_well)]  # fmt: skip
    return max(own, key=lambda u: u.log_evidence, default=None), [u for u in fits if u not in own]
