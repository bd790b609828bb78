"""From flight records to a diagnosis: where the gap lies, which effect explains it, how far it closes."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from icing_env import effects
from icing_env.errors import InputError, nearest
from icing_env.record import FlightRecord, FloatArray
from sim2real.actuators.servos import of_all_servos
from sim2real.actuators.surfaces import placed
from sim2real.actuators.timing import in_step
from sim2real.answer import credible, describe, detection_limits, judge, problems, provenance, ranked
from sim2real.baseline.loading import of_another_loading, of_published, otherwise_loaded
from sim2real.baseline.quasi_steady import NOTE, simpler, undoes_the_lag, without_lag, worth_trying
from sim2real.baseline.references import Baseline, fit_baseline, uncertain
from sim2real.change import Changed, changed, flown_freely
from sim2real.closing import gap
from sim2real.closing.parts import Flown
from sim2real.closing.remedy import Remedy, remedy, resimulation, values_of
from sim2real.closing.whole_model import components_with
from sim2real.ladder import ladder
from sim2real.library.candidates import SPREAD, Bank, bank, not_testable, of_model
from sim2real.library.pushes import in_common
from sim2real.over_time.history import SAME, History, histories
from sim2real.planning.limits import limits
from sim2real.planning.manoeuvre import next_manoeuvre
from sim2real.posterior.hypotheses import Posterior
from sim2real.prediction.gusts import Gusts
from sim2real.records.instruments import with_recorder
from sim2real.records.late_power import prompt
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.records.side_by_side import algebra_in_one_thread
from sim2real.records.thrust_source import as_measured, differs
from sim2real.records.vane_lead import met_together
from sim2real.rollout import Rollout, flying_as
from sim2real.signatures.evidence import Evidence, typical
from sim2real.weigh import Progress, fit
from sim2real.where import components, regimes

LISTED = 0.01  # effects at least this probable are described one by one


@dataclass(frozen=True)
class Diagnosis:
    """The answer, field by field as the interface fixes it (see docs/diagnosis.md)."""

    verdict: str
    hypotheses: list[dict[str, Any]]
    credible_set_95: list[int]
    where: dict[str, Any]
    effects: list[dict[str, Any]]
    not_testable: list[dict[str, str]]
    detection_limits: dict[str, dict[str, Any]]
    unknown: dict[str, Any] | None
    gap: dict[str, Any]
    next_manoeuvre: dict[str, Any] | None
    resimulate: dict[str, Any]
    data_problems: list[dict[str, Any]]
    provenance: dict[str, Any]
    seconds: float
    details: Details = field(repr=False, metadata={"json": False})


@dataclass(frozen=True)
class Details:
    """What a report draws beyond the answer."""

    flights: tuple[Reconstruction, ...]
    held_out: tuple[Reconstruction, ...]
    evidences: tuple[Evidence, ...]
    posterior: Posterior
    change: Remedy
    training: gap.Energy
    tested: gap.Energy | None


@algebra_in_one_thread
def diagnose(records: Sequence[FlightRecord], held_out: Sequence[FlightRecord] = (),
             reference: Sequence[FlightRecord] = (), without: Iterable[str] = (), seed: int = 0,
             progress: Progress = lambda text: None, climb: bool = False, simulator: Rollout | None = None
             ) -> Diagnosis:  # fmt: skip
    """Diagnose the gap between the model and the aircraft that flew `records`.

    Args:
        records: to diagnose, of one aircraft in one condition.
        held_out: never fitted; the closure is measured on them.
        reference: the same aircraft without the gap; they correct the model first.
        without: effects to leave out of the library.
        seed: of the synthetic records behind the gap without a gap.
        progress: told what is being done.
        climb: measure the evidence ladder on the held-out records too (as long again as the diagnosis).
        simulator: a simulator of the user's in the place of ours (`sim2real.rollout`).

    Raises:
        InputError: no records, an unknown effect in `without`, or a record that cannot be used.
    """
    began = time.perf_counter()
    if reference and differs([*records, *held_out], reference):
        records, held_out, reference = (as_measured(some) for some in (records, held_out, reference))
    at_hand = _at_hand(records, held_out, reference, tuple(without), simulator, progress)
    at_hand, weighed = _weighed(at_hand, records, held_out, not (reference or simulator), progress)
    flights, others, candidates = at_hand.flights, at_hand.others, at_hand.candidates
    evidences, posterior, baseline = weighed
    found = changed(flights, candidates, evidences, baseline, posterior, seed, not (reference or simulator), progress)
    posterior, explained, flown = found.posterior, found.told.explained, found.flown
    sizes = _over_time(replace(at_hand, baseline=baseline), evidences, found, progress)
    progress("flying what these records could have revealed")
    shown = limits(evidences, candidates, baseline, posterior.tempering, posterior.fits)
    gusts = typical(evidences)
    tested, less = _held_out(others, flown, gusts, seed) if others else (None, None)
    closes = {"training": _closed(flown), "held_out": gap.held_out(tested, seed, less)}
    if climb and tested is not None and less is not None:
        closes["ladder"] = ladder(flights, others, candidates, baseline, evidences, posterior, explained,
                                  flown.change.paths, flown.training, tested, less, seed,
                                  progress)  # fmt: skip
    lacking = found.whole or found.told.unknown
    verdict, hypotheses = judge(posterior)
    progress("looking for what to fly next")
    return Diagnosis(
        verdict=verdict,
        hypotheses=hypotheses,
        credible_set_95=credible([h["probability"] for h in hypotheses]),
        where={"channels": gap.by_channel(flown.training.before), "components": _places(found),
               "regimes": regimes(evidences)},
        effects=[describe(name, posterior, explained, found.told.forms, sizes.get(name, SAME))
                 for name, p in ranked(posterior) if p >= LISTED],
        not_testable=[{"effect": name, "why": why} for name, why in sorted(at_hand.untestable.items())],
        detection_limits=detection_limits(posterior.fits, shown),
        unknown=None if lacking is None else lacking.answer(),
        gap=closes,
        next_manoeuvre=_next(flights[0], candidates, posterior, hypotheses, gusts.sigma, baseline.precision),
        resimulate=resimulation(flown.change, flown.training, flights, evidences),
        data_problems=problems((*flights, *others)),
        provenance=provenance(flights, others, evidences, at_hand.without, len(reference), seed)
        | {"tempering": posterior.tempering, "model": baseline.answer() if reference else None,
           "spread": None if baseline.spread is None else baseline.spread * SPREAD},
        seconds=time.perf_counter() - began,
        details=Details(tuple(flights), tuple(others), tuple(evidences), posterior, flown.change, flown.training,
                        tested),
    )


@dataclass(frozen=True)
class _AtHand:
    """What a diagnosis begins with: the records over the model that references corrected, and the library.

    without: effects left out of it; untestable: those that the records cannot show, with the reason.
    """

    flights: list[Reconstruction]
    others: list[Reconstruction]
    candidates: Bank
    baseline: Baseline
    without: tuple[str, ...]
    untestable: dict[str, str]


def _at_hand(records: Sequence[FlightRecord], held_out: Sequence[FlightRecord], reference: Sequence[FlightRecord],
             without: tuple[str, ...], simulator: Rollout | None, progress: Progress) -> _AtHand:  # fmt: skip
    if not records:
        raise InputError("no record to diagnose: give at least one flight record")
    for name in without:
        if name not in effects.LIBRARY:
            raise InputError(f"no effect '{name}' to leave out: {nearest(name, list(effects.LIBRARY))}")
    candidates = bank(without, uncertain() if reference else ())
    baseline = of_published(candidates.nuisances)
    if reference:
        progress("fitting the model to the reference flights")
        baseline = fit_baseline(_reconstructed(reference, None, simulator), candidates, records)
        if otherwise_loaded(reference, records):
            baseline = of_another_loading(baseline, candidates.nuisances)
        candidates = replace(candidates, nuisances=of_model(candidates.nuisances, baseline.parameters),
                             clean=baseline.clean)  # fmt: skip
    flights = _reconstructed(records, baseline, simulator)
    return _AtHand(flights, _reconstructed(held_out, baseline, simulator), candidates, baseline, without,
                   not_testable(flights, candidates))


def _weighed(at_hand: _AtHand, records: Sequence[FlightRecord], held_out: Sequence[FlightRecord], published: bool,
             progress: Progress) -> tuple[_AtHand, tuple[list[Evidence], Posterior, Baseline]]:  # fmt: skip
    """What the records say about a model; `published`: about the published one, which may be read as quasi-steady."""
    first = fit(at_hand.flights, at_hand.candidates, at_hand.untestable, at_hand.baseline, progress)
    plain = published and undoes_the_lag(first[1], at_hand.baseline)
    if not plain and not (published and worth_trying(first[1], at_hand.baseline, at_hand.candidates)):
        return at_hand, first
    progress("weighing again about an aircraft whose downwash does not lag")
    other = _over(without_lag(at_hand.baseline), at_hand, records, held_out)
    again = fit(other.flights, other.candidates, other.untestable, other.baseline, progress)
    return (other, again) if plain or simpler(again[1], first[1], at_hand.baseline.precision) else (at_hand, first)


def _over(baseline: Baseline, before: _AtHand, records: Sequence[FlightRecord], held_out: Sequence[FlightRecord]
          ) -> _AtHand:  # fmt: skip
    """The same over a quasi-steady model, which the records' notes tell."""
    flights, others = ([replace(f, notes=(*f.notes, NOTE)) for f in _reconstructed(some, baseline, None)]
                       for some in (records, held_out))
    return replace(before, flights=flights, others=others, baseline=baseline,
                   untestable=not_testable(flights, before.candidates))


def _over_time(at_hand: _AtHand, evidences: Sequence[Evidence], found: Changed, progress: Progress
               ) -> dict[str, History]:  # fmt: skip
    """How the sizes of the effects found went along the records."""
    explained = found.told.explained
    if explained is None or not explained.effects or found.whole is not None:
        return {}
    progress("looking at how the sizes went along the records")
    return histories(at_hand.flights, at_hand.candidates, evidences, at_hand.baseline, found.posterior, explained.fit,
                     remedy(explained, found.told.flown), found.told.flown)


def _held_out(others: Sequence[Reconstruction], flown: Flown, gusts: Gusts, seed: int
              ) -> tuple[gap.Energy, FloatArray]:  # fmt: skip
    """Held-out records before and after, and what the effects alone leave of them [windows, channels]."""
    tested = flown_freely(others, [gusts] * len(others), flown.change, seed + 1000)
    alone = flown.change is flown.alone
    return tested, tested.after if alone else gap.of_all(others, flown.alone, flown.change.paths)


def _places(found: Changed) -> dict[str, float]:
    """Where the gap enters, with the probability of it."""
    places = components(found.posterior, {name: effect.enters_at for name, effect in effects.LIBRARY.items()})
    return places if found.whole is None else components_with(places, found.whole)


def _closed(flown: Flown) -> dict[str, float]:
    """The gap of the diagnosed records before, after, and with the effects alone."""
    return {"before": gap.g(flown.training.before, flown.training.alone), "after": flown.left,
            "after_effects_alone": gap.g(flown.effects_alone.after, flown.effects_alone.alone)}


def _reconstructed(records: Sequence[FlightRecord], baseline: Baseline | None, simulator: Rollout | None
                   ) -> list[Reconstruction]:  # fmt: skip
    """Records over the model that references corrected, or over a simulator of the user's so corrected."""
    records = with_recorder(records)
    flights = [reconstruct(record) for record in records] if baseline is None else [
        replace(reconstruct(record, baseline.near(record)), inadequacy=baseline.inadequacy) for record in records]
    flights = in_common(placed(prompt(met_together(in_step(of_all_servos(flights))))))
    if simulator is None:
        return flights
    yours = [flying_as(reconstruct(record), simulator) for record in records]
    return [replace(f, known=y.known, inadequacy=f.inadequacy.with_walk(y.inadequacy.walk))
            for f, y in zip(flights, yours, strict=True)]


def _next(flight: Reconstruction, candidates: Bank, posterior: Posterior, hypotheses: list[dict[str, Any]],
          sigma: float, precision: FloatArray) -> dict[str, Any] | None:
    inside = [hypotheses[i] for i in credible([h["probability"] for h in hypotheses])]
    names = list(dict.fromkeys(name for h in inside for name in h["effects"]))
    if len(names) == 1:
        held = {n for h in hypotheses for n in h["effects"]}  # of a class, those that were flown
        names += [n for n in posterior.classes[names[0]] if n in held and n not in names]
    rivals = {n: values_of(posterior.leading(n))[n] for n in names}
    likely = posterior.effects
    return next_manoeuvre(flight, candidates, rivals, {n: max(likely[n], 1e-3) for n in names}, sigma, precision)
