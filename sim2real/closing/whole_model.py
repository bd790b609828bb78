"""An aircraft that differs from its model in many numbers at once: all of them fitted to the records themselves.

A few effects cannot say that another aircraft is another: what even the best of them leaves is many times the noise.
Then the model's numbers are fitted as reference flights would fit them (`baseline.references`: every number's prior
widens until the records no longer contradict it). If that takes most of the gap that was left in free flight, the gap
is at every component whose force or moment the fitted numbers change by a tolerance. Numbers that are plainly off are
told: as the effect of the library that changes them alone, else as terms of `discrepancy`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import chi2

from icing_env import effects
from icing_env.effects.discrepancy import TERMS
from icing_env.record import FloatArray
from sim2real.baseline.fit import ALIKE, Fit
from sim2real.baseline.references import directions
from sim2real.closing import gap
from sim2real.closing.black_box import FELT, PUSHED, residual_accelerations
from sim2real.closing.remedy import Remedy, Values
from sim2real.library.bends import COMPONENTS, changes
from sim2real.library.candidates import Bank, Family, Nuisance
from sim2real.library.terms import GENERIC
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.hypotheses import Hypothesis, Posterior
from sim2real.posterior.sets import SetFit
from sim2real.posterior.widened import SIZES
from sim2real.records.channels import TOLERANCE
from sim2real.records.reconstruct import Reconstruction

ANOTHER = 2.0  # times the noise that the best explanation leaves (tempering), beyond which it is not all (assumed)
STRETCHED = 1e-5  # chance of numbers as far from published ones as those that go with it, at which it is not all, too
ALL = 3.0  # times that square, at which it is not all though noise is all that is left, or it did not all fly (assumed)
TAKEN = 0.5  # of the gap in free flight that it leaves, at least, and that all numbers leave of this at most (assumed)
SHARE = 0.6  # probability, at least, that it is they that differ where they do (assumed)
SHOWN, PLAIN = 3.0, 2.0  # standard errors, and times its published spread, from which a number is told (assumed)
SEEN = 0.25  # tolerances by which a component is changed, from which its numbers are told (assumed)
HALF = 0.5  # s in which an angular acceleration makes the rate that is compared with the tolerance
PLACES = {target: component for component, target, _ in GENERIC if component in COMPONENTS.values()}


@dataclass(frozen=True)
class WholeModel:
    """Numbers of the model as the records have them.

    Attributes:
        values: what has to be put into the model, as effects.
        named: effects of the library that are plainly there, with their sizes.
        terms: (number, change, standard error) of the others that stand out, the surest first.
        places: RMS change of every force (tolerances of ax, ay, az) and moment (of the rate it makes in half a second).
        covariance: of all numbers in `values`.
        share: probability that it is many numbers that differ, and not what was found before.
    """

    values: Values
    named: SetFit
    terms: tuple[tuple[str, float, float], ...]
    places: dict[str, float]
    covariance: FloatArray
    share: float

    @property
    def worst(self) -> str:
        """The component that is changed most."""
        return max(self.places, key=lambda place: self.places[place])

    def remedy(self) -> Remedy:
        """The change of the model."""
        return Remedy(self.values, SIZES**2 * self.covariance)

    def answer(self) -> dict[str, Any]:
        """As the interface has an unknown, with all places beside the worst."""
        return {"component": self.worst, "kind": "static", "places": self.places,
                "terms": [{"term": name, "coefficient": size, "std_error": error} for name, size, error in self.terms]}


@dataclass(frozen=True)
class _Number:
    """A number of the model that is fitted: what changes it by `per` for each unit of a parameter of an effect.

    family: of the library's effect that changes it alone; None where only `discrepancy` does.
    """

    move: Nuisance
    effect: str
    parameter: str
    per: float
    family: Family | None


def suspected(posterior: Posterior, precision: FloatArray) -> bool:
    """Whether the best explanation leaves many times the noise, or may take numbers along that are too far off.

    `precision`: of the numbers' prior.
    """
    return posterior.tempering > ANOTHER or _stretched(posterior, precision)


def incomplete(posterior: Posterior, precision: FloatArray, flown: gap.Energy, all_of_it: bool) -> bool:
    """Whether a suspected explanation is not all: numbers too far off, or much left in free flight where noise is left.

    Numbers that only stand in for details of an enormous gap go far, too: what takes most of it is believed.

    Args:
        precision: of the numbers' prior.
        flown: the records in free flight, with that explanation; what only stretches the model leaves a gap there too.
            What is told of the noise is told without its form in terms, which may be all that there was left.
        all_of_it: whether all of the explanation flew; what did not leaves a gap there for that reason alone.
    """
    after = gap.g(flown.after, flown.alone)
    left = after >= gap.null_quantile(flown.alone)
    if posterior.tempering > ANOTHER:
        return left or not all_of_it or posterior.settled is None or _stretched(posterior, precision)
    if after < TAKEN * gap.g(flown.before, flown.alone):
        return False
    return (left and all_of_it and _stretched(posterior, precision)) or _stretched(posterior, precision, ALL)


def _stretched(posterior: Posterior, precision: FloatArray, times: float = 1.0) -> bool:
    """Whether the numbers that go with the best explanation are farther from published ones than any aircraft's."""
    settled = posterior.settled
    return settled is not None and float(settled @ precision @ settled) > times * chi2.isf(STRETCHED, len(settled))


def takes_most(before: gap.Energy, fitted: gap.Energy) -> bool:
    """Whether the fitted numbers leave much less in free flight than what was found before."""
    return gap.g(fitted.after, fitted.alone) < TAKEN * gap.g(before.after, before.alone)


def fit_whole_model(flights: Sequence[Reconstruction], candidates: Bank, posterior: Posterior) -> WholeModel:
    """The model's numbers as the records have them.

    Args:
        flights: the diagnosed records over the published model.
        posterior: of the explanations tried before.
    """
    numbers = _numbers(flights[0], candidates, posterior)
    # what the model lacks here passes for gusts of another kind
    fit = Fit(flights, [n.move for n in numbers], np.zeros(len(flights)))
    fit.run()
    x, count = fit.x[: len(numbers)], len(numbers)
    unit = np.array([n.move.factor / n.per for n in numbers])
    covariance = np.asarray(np.linalg.inv(fit.precision)[:count, :count] * np.outer(unit, unit), np.float64)
    size, error = x * unit, np.sqrt(np.diag(covariance))
    values = Values()
    for number, change in zip(numbers, size, strict=True):
        values.setdefault(number.effect, effects.get(number.effect).neutral())[number.parameter] = float(change)
    values["discrepancy"] = values.pop("discrepancy")  # last: terms are as large as told, by no effect's factor
    places = changed_places(flights, values)
    surest = [i for i in np.argsort(-np.abs(size) / error) if abs(size[i]) > SHOWN * error[i]
              and abs(x[i]) > PLAIN and places.get(_place(numbers[i].move), 1.0) > SEEN]  # fmt: skip
    plain = [i for i in surest if numbers[i].family is not None]
    other = [i for i in surest if numbers[i].family is None]
    named = _set([numbers[i] for i in plain], size[plain], covariance[np.ix_(plain, plain)])
    terms = tuple((numbers[i].move.name, float(size[i] * numbers[i].per), float(error[i] * abs(numbers[i].per)))
                  for i in other)  # fmt: skip
    return WholeModel(values, named, terms, places, covariance, max(SHARE, 1.0 - ANOTHER / posterior.tempering))


def _numbers(flight: Reconstruction, candidates: Bank, posterior: Posterior) -> list[_Number]:
    """Every number of the aircraft, not of its instruments, by an effect of the library where one changes it alone."""
    alone = {changes(f.effect): (f, per) for f in candidates.families if f.effect.name in posterior.fits
             and (per := _per_unit(flight, f)) is not None}  # fmt: skip
    out = []
    for move in directions(candidates):
        if move.only or move.name in ALIKE:
            continue
        coefficient, _, term = move.parameter.partition("_")
        if (found := alone.get(frozenset(move.parameter.split("+")))) is not None:
            family, per = found
            out.append(_Number(move, family.effect.name, family.parameter.name, per, family))
        elif (term := term.replace("alpha2", "alpha_alpha")) in TERMS.get(coefficient, ()):
            out.append(_Number(move, "discrepancy", f"{coefficient}_{term}", 1.0, None))
    return out


def _per_unit(flight: Reconstruction, family: Family) -> float | None:
    """By how much an effect changes its numbers for each unit of its size; None if not all alike and at any size."""
    row = flight.parameters
    per = {round(float(rows[name][0] - row[name][0]) / size, 9)
           for size in (0.5 * family.nodes[0], family.nodes[0]) for name in changes(family.effect)
           for rows in [effects.with_effects(row, {family.effect.name: {family.parameter.name: size}})]}  # fmt: skip
    return per.pop() if len(per) == 1 else None


def _set(numbers: Sequence[_Number], size: FloatArray, covariance: FloatArray) -> SetFit:
    """Effects with their sizes, as if they had been fitted together."""
    error = 1.96 * np.sqrt(np.diag(covariance))
    return SetFit(tuple(n.family for n in numbers if n.family is not None), 0.0, tuple(size.tolist()),
                  tuple((size - error).tolist()), tuple((size + error).tolist()), covariance)


def _place(move: Nuisance) -> str:
    return COMPONENTS.get(move.parameter.partition("_")[0], "")


def changed_places(flights: Sequence[Reconstruction], values: Values) -> dict[str, float]:
    """How much the model is changed at each force and moment, both asked for the measured states.

    Returns:
        RMS change by component: tolerances of ax, ay, az, and of the rate that a moment makes in half a second.
    """
    squares, count = np.zeros(len(PUSHED)), 0
    for flight in flights:
        changed = replace(flight, parameters=effects.with_effects(flight.parameters, values))
        apart = residual_accelerations(flight)[1] - residual_accelerations(changed)[1]
        squares, count = squares + np.sum(apart**2, axis=0), count + len(apart)
    unit = [TOLERANCE[FELT[axis]] if axis in FELT else TOLERANCE[axis] / HALF for axis in PUSHED]
    return {PLACES[axis]: float(rms) for axis, rms in zip(PUSHED, np.sqrt(squares / count) / unit, strict=True)}


def with_whole_model(posterior: Posterior, whole: WholeModel) -> Posterior:
    """The posterior, most of it for the effects that are plainly there, and what the library lacks if there is any."""
    beside = UnknownFit(whole.worst, 0.0, whole.terms, 0.0, {}) if whole.terms or not whole.named.effects else None
    rest = [replace(h, probability=(1.0 - whole.share) * h.probability) for h in posterior.hypotheses]
    found = [replace(rest[0], fit=whole.named, unknown=beside, form=None, instead=None, probability=whole.share), *rest]
    told = dict(posterior.classes) | dict.fromkeys(whole.named.effects, ())  # each has its own interval
    return replace(posterior, hypotheses=tuple(sorted(_merged(found), key=lambda h: -h.probability)), classes=told)


def _merged(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The first of each kind, with the probability of all of it."""
    kinds: dict[tuple[frozenset[str], bool], Hypothesis] = {}
    for h in found:
        kind = frozenset(h.effects), h.unknown is not None
        kinds[kind] = replace(kinds[kind], probability=kinds[kind].probability + h.probability) if kind in kinds else h
    return list(kinds.values())


def components_with(found: Mapping[str, float], whole: WholeModel) -> dict[str, float]:
    """Probabilities of components, with those that the whole model changes by a tolerance (the worst in any case)."""
    both = dict(found)
    for place, rms in whole.places.items():
        if rms >= 1.0 or place == whole.worst:
            both[place] = max(both.get(place, 0.0), whole.share)
    return dict(sorted(both.items(), key=lambda item: -item[1]))
