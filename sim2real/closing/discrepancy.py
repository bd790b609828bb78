"""What the library lacks, as an aircraft that can be flown: the effect `discrepancy`, its terms chosen and fitted.

The generic terms of the component that a diagnosis points to are flown by the plant itself, in coefficients, so that
dynamic pressure, inertia and instruments act on them as on any effect; nuisances give way. Terms are chosen forward and
backward (modified stepwise regression, Klein & Morelli, Aircraft System Identification, AIAA 2006, section 5.4) by
predicted squared error. In whitened units the noise is 1, and one term costs SHOWN^2: it earns its place where it alone
would count as shown. Derivatives of the model are uncertain beside the terms as they are anywhere, at the component
too: what another aircraft's own numbers make of a record would else be told as whichever terms are like it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.actuators.second_order import DAMPING
from sim2real.baseline.references import Baseline
from sim2real.closing.flyable import Choice, choices, condition, flyable
from sim2real.flown.settling import nearer
from sim2real.library.candidates import NUISANCE_STEP, Bank, Nuisance, shifted
from sim2real.library.terms import PURE_DELAY
from sim2real.library.units import unit_of
from sim2real.posterior.attribution import nuisance_mean, reduce, with_prior
from sim2real.posterior.form import WORTH
from sim2real.posterior.generic import COURSE, UnknownFit
from sim2real.posterior.hypotheses import Hypothesis, Posterior, Settled
from sim2real.posterior.sets import SetFit
from sim2real.posterior.singles import DETECTABLE
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.evidence import Evidence, compare

LIKELY = 0.1  # probability of something unknown from which it is described; doubt of a known effect leaves 0.04 to 0.08
SHOWN = DETECTABLE  # standard errors that a term has to stand out
ROUNDS, SETTLED = 12, 0.5  # of fitting at most, each flying the aircraft described so far; whitened square worth one
# Units of a term by which its slope is taken at first; then as many as stand out so far: the curvature of a larger step
# looks like what nuisances cannot do, that of a smaller one like rounding.
AT_FIRST, STANDS_OUT, LEAST = 0.1, 20.0, 1e-3
MORE = 3  # terms beside those of the round before: what a large gap is not linear in would be told as more of them
RIDGE = 0.1  # prior precision of a term in its own unit (assumed: a standard deviation of three)
LATE = ("_dot", "acceleration", PURE_DELAY, DAMPING, "slow_phi", "slow_theta", "slow_ax", "slow_ay")  # with a memory


@dataclass(frozen=True)
class Description:
    """An unknown in terms, most of which can be flown (no values where they cannot).

    Attributes:
        component: where it enters.
        terms: (name, size, standard error) of those that earned their place, the surest first.
        values: of the effect `discrepancy`.
        covariance: of the sizes of `terms`.
        settled: the model's own numbers beside them; None if not flown.
    """

    component: str
    terms: tuple[tuple[str, float, float], ...]
    values: dict[str, float]
    covariance: FloatArray
    settled: Settled | None = None

    @property
    def kind(self) -> str:
        """static, dynamic (a delay) or time_varying (a free course, too), by the surest term that is not constant."""
        leading = next((name for name, _, _ in self.terms if name != "1"), "1")
        return "time_varying" if leading in ("time", COURSE) else "dynamic" if leading.endswith(LATE) else "static"

    def answer(self) -> dict[str, Any]:
        """As the interface has it."""
        return {"component": self.component, "kind": self.kind,
                "terms": [{"term": name, "coefficient": size, "std_error": error} for name, size, error in self.terms]}


def described(posterior: Posterior) -> Hypothesis | None:
    """The most probable explanation that holds something unknown, where that is not improbable."""
    if posterior.unknown < LIKELY:
        return None
    return next((h for h in posterior.hypotheses if h.unknown is not None), None)


def in_other_form(explained: Hypothesis) -> Hypothesis | None:
    """Known effects with generic terms at home as what is to be described, where these say much that they do not."""
    own = None if explained.form is None or explained.unknown is not None else explained.form.own
    return None if own is None or own.log_evidence < WORTH else replace(explained, unknown=own)


def describe_unknown(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence],
                     baseline: Baseline, tempering: float, hypothesis: Hypothesis) -> Description:
    """Choose and fit the terms of a hypothesis' unknown, its known effects at their sizes.

    Args:
        flights: the diagnosed records about the baseline.
        evidences: theirs, for gains, whitening, and where the model has been moved to.
        tempering: of the evidence.
        hypothesis: one that holds something unknown.
    """
    assert hypothesis.unknown is not None
    component = hypothesis.unknown.component
    if hypothesis.unknown.surest not in flyable(component, flights):
        return _told(component, hypothesis.unknown.terms, flights[0].reach)
    terms, at = choices(component, flights), condition(component, flights)
    only, precision = replace(candidates, families=(), terms=(), size=1 + len(candidates.nuisances)), baseline.precision
    moved = moved_by(flights[0], evidences[0].flight.parameters, only.nuisances)
    centre = nearer(moved if hypothesis.settled is None else hypothesis.settled.nuisances, only)
    first, n = 1 + len(only.nuisances), len(terms)
    x, best, there = _begun(hypothesis.unknown, terms, flights[0].reach), np.inf, np.zeros((0, 0))
    move, tried, among = _Move(np.zeros(n), centre, x != 0.0, there, False), np.full(n, AT_FIRST), np.full(n, True)
    for _ in range(ROUNDS):
        rows = [_rows(flight, only, hypothesis.fit, terms, at, x + move.step, move.turn, tried) for flight in flights]
        gram = with_prior(_products(flights, evidences, rows, tried) / tempering, only, precision, move.turn)
        tried = np.clip(STANDS_OUT / np.sqrt(np.maximum(np.diag(gram)[first:], 1e-12)), LEAST, 1.0)
        left = float(reduce(gram, only, np.zeros_like(precision))[0, 0])
        cost = left + SHOWN**2 * np.count_nonzero(x + move.step)
        if best < cost < best + SETTLED and np.any(move.step) and not move.others:
            break
        if cost > best and np.any(move.step):  # too far: half the way; or other terms say it no better
            among = x != 0.0 if move.others else among
            move = _moved(there, only, x, centre, among, n) if move.others else move.halved(centre)
            continue
        gained = best - cost
        x, best, centre, there = x + move.step, cost, move.turn, gram
        move = _moved(gram, only, x, centre, among, int(np.count_nonzero(move.chosen)) + MORE)
        if gained < SETTLED and np.array_equal(move.chosen, x != 0.0):
            break
    settled = Settled(move.turn, _covariance(gram, first, move.chosen))
    return replace(_written(component, terms, at, x + move.step, move.chosen, move.covariance), settled=settled)


@dataclass(frozen=True)
class _Move:
    """A step of the terms [terms] and where nuisances go with it [n]; the terms chosen, and their covariance.

    others: whether any of them was not there before.
    """

    step: FloatArray
    turn: FloatArray
    chosen: NDArray[np.bool_]
    covariance: FloatArray
    others: bool

    def halved(self, centre: FloatArray) -> _Move:
        """Half of it, nuisances from `centre`."""
        return replace(self, step=0.5 * self.step, turn=0.5 * (self.turn + centre))


def _moved(gram: FloatArray, only: Bank, x: FloatArray, centre: FloatArray, among: NDArray[np.bool_], most: int
           ) -> _Move:  # fmt: skip
    """What inner products say of where to go from terms `x` and nuisances `centre` [n].

    Args:
        among, most: of `choose`.
    """
    first, n = 1 + len(only.nuisances), len(centre)
    target, chosen, covariance = choose(reduce(gram, only, np.zeros((n, n))), first, x, most, among)
    weights = {first + j: float(v) for j, v in enumerate(target - x)}
    turn = nearer(centre + nuisance_mean(gram, only, weights), only)
    return _Move(target - x, turn, chosen, covariance, bool(np.any(chosen & (x == 0.0))))


def _covariance(gram: FloatArray, first: int, chosen: NDArray[np.bool_]) -> FloatArray:
    """Covariance of nuisances [n, n], their prior being in the inner products, the terms chosen free beside them."""
    kept = [*range(1, first), *(first + np.flatnonzero(chosen))]
    unit = np.r_[np.full(first - 1, NUISANCE_STEP), np.ones(len(kept) - first + 1)]
    inner = gram[np.ix_(kept, kept)] / np.outer(unit, unit)
    return np.asarray(np.linalg.inv(inner + np.diag((unit == 1.0) * RIDGE))[: first - 1, : first - 1], np.float64)


def _products(flights: Sequence[Reconstruction], evidences: Sequence[Evidence], rows: Sequence[NDArray],
              tried: FloatArray) -> FloatArray:  # fmt: skip
    """Whitened inner products of all records, of `_rows`, per unit of each term."""
    gram = sum(compare(f, own, e.gain, e.factor).gram for f, e, own in zip(flights, evidences, rows, strict=True))
    unit = np.r_[np.ones(len(rows[0]) - len(tried)), tried]
    return np.asarray(gram / np.outer(unit, unit))


def _begun(unknown: UnknownFit, terms: Sequence[Choice], reach: Mapping[str, float]) -> FloatArray:
    """Sizes that the terms begin from: as the search has those that stand out."""
    shown = {name: size * unit_of(name, unknown.component, reach) for name, size, error in unknown.terms
             if abs(size) > SHOWN * error and name != "position*position*position"}  # which it has another unit for
    return np.array([shown.get(term.term, 0.0) / term.size for term in terms])


def _told(component: str, terms: Sequence[tuple[str, float, float]], reach: Mapping[str, float]) -> Description:
    """Terms that the effect cannot fly, as the evidence has them: those that stand out, the surest first.

    A delay of a path is flown as a lag as long: the one memory that a path of the simulator has, to first order alike.
    """
    order = sorted(terms, key=lambda term: -abs(term[1]) / term[2])
    kept = [term for term in order if abs(term[1]) > SHOWN * term[2]] or order[:1]
    units = [unit_of(name, component, reach) for name, _, _ in kept]
    told = tuple((name, size * unit, error * unit) for (name, size, error), unit in zip(kept, units, strict=True))
    late = {f"{component.removesuffix('_path')}_lag": size for name, size, _ in told if name == PURE_DELAY}
    return Description(component, told, late, np.diag([error**2 for _, _, error in told]))


def moved_by(flight: Reconstruction, moved: NDArray, directions: Sequence[Nuisance]) -> FloatArray:
    """Standard deviations [n] by which the model of a record has been moved in each nuisance direction."""
    out = np.zeros(len(directions))
    for j, nuisance in enumerate(directions):
        if nuisance.only and nuisance.only != flight.power_from:
            continue
        name = nuisance.parameter.split("+")[0]
        before, after = float(flight.parameters[name][0]), float(moved[name][0])
        if nuisance.absolute:
            out[j] = (after - before) / nuisance.factor
        elif before != 0.0:
            out[j] = (after / before - 1.0) / nuisance.factor
    return out


def _rows(flight: Reconstruction, only: Bank, known: SetFit, terms: Sequence[Choice], at: dict[str, float],
          x: FloatArray, centre: FloatArray, tried: FloatArray) -> NDArray:
    """PARAMETERS: the model with the set and the terms `x` in it, a step of each nuisance, `tried` of each term."""
    first = 1 + len(only.nuisances)
    base = shifted(flight.parameters, only.nuisances, centre, flight.power_from)
    rows = np.repeat(base, first + len(terms))
    for j, nuisance in enumerate(only.nuisances, start=1):
        nuisance.apply(rows, j, flight.power_from)
    sizes = np.tile(x, (len(rows), 1))
    sizes[first:] += np.diag(tried)
    values: dict[str, dict[str, float | NDArray]] = {name: {**own} for name, own in known.values.items()}
    values["discrepancy"] = {**{t.number: sizes[:, j] * t.size for j, t in enumerate(terms)}, **at}
    return effects.with_effects(rows, values)


def choose(reduced: FloatArray, first: int, x: FloatArray, most: int, among: NDArray[np.bool_] | None = None
           ) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:  # fmt: skip
    """Stepwise choice among terms, `most` of them, from inner products whose row 0 is the residual with `x` of them.

    `among`: which there are to choose from; all if omitted.

    Returns:
        Sizes of all terms (zero where not chosen), which were chosen, and the covariance of those.
    """
    n = len(x)
    terms = np.arange(first, first + n)
    T = reduced[np.ix_(terms, terms)] + RIDGE * np.eye(n)
    t = reduced[np.ix_(terms, terms)] @ x - reduced[terms, 0]
    model: list[int] = []

    def gain(subset: list[int]) -> float:
        """Fall of the whitened square, less what the terms cost."""
        if not subset:
            return 0.0
        block = T[np.ix_(subset, subset)]
        return float(t[subset] @ np.linalg.solve(block, t[subset])) - SHOWN**2 * len(subset)

    for _ in range(2 * n):
        tried = [sorted({*model} ^ {j}) for j in range(n) if among is None or among[j]]  # one more, or one less
        best = max((subset for subset in tried if len(subset) <= most), key=gain)
        if gain(best) <= gain(model) and model:
            break
        model = best if best else model
    sizes, chosen = np.zeros(n), np.zeros(n, bool)
    covariance: FloatArray = np.asarray(np.linalg.inv(T[np.ix_(model, model)]), np.float64)
    sizes[model], chosen[model] = covariance @ t[model], True
    return sizes, chosen, covariance


def _written(component: str, terms: Sequence[Choice], at: dict[str, float], x: FloatArray,
             chosen: NDArray[np.bool_], covariance: FloatArray) -> Description:
    """The chosen terms in their own units, the surest first."""
    kept = [t for t, c in zip(terms, chosen, strict=True) if c]
    unit = np.array([t.size for t in kept])
    size, error = x[chosen] * unit, np.sqrt(np.diag(covariance)) * np.abs(unit)
    order = np.argsort(-np.abs(size) / error)
    told = tuple((kept[i].term, float(size[i]), float(error[i])) for i in order)
    values = {kept[i].number: float(size[i]) for i in order}
    return Description(component, told, values | _needed(values, at),
                       (covariance * np.outer(unit, unit))[np.ix_(order, order)])


def _needed(values: dict[str, float], at: dict[str, float]) -> dict[str, float]:
    """Of the condition, what the numbers count from."""
    def uses(name: str) -> bool:
        quantity = name.removeprefix("at_")
        words = {"time": ("time", "drift")}.get(quantity, (quantity,))
        return any(word in number.removesuffix("2").split("_") for number in values for word in words)

    return {name: value for name, value in at.items() if uses(name)}
