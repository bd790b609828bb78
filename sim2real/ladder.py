"""The evidence ladder: what is closed of the gap on held-out records by nothing, by rivals, and where there is none.

On the same held-out windows: the model as it is, and with its own numbers refined as if there were no gap; the best
explanation that shares nothing with the diagnosed one; the diagnosed effects alone, and with the model's own numbers as
these settled beside them; a regression that knows no physics, as a ceiling. Then the same search on synthetic records
of the model itself: the best explanation it finds there, believed or not, "closes" what it closes where nothing is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from icing_env.record import FloatArray
from sim2real.actuators.paths import driven
from sim2real.baseline.references import Baseline
from sim2real.closing import black_box, gap
from sim2real.closing.discrepancy import Description, describe_unknown
from sim2real.closing.own_numbers import own_numbers, with_own_numbers
from sim2real.closing.parts import flown_parts
from sim2real.closing.remedy import Remedy, remedy
from sim2real.library.candidates import Bank, not_testable
from sim2real.posterior.form import home
from sim2real.posterior.hypotheses import Hypothesis, Posterior
from sim2real.prediction.gusts import Gusts
from sim2real.prediction.windows import COMPARED, FREE, fly
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.evidence import Evidence, typical
from sim2real.weigh import Progress, fit

PIECE = 20.0  # s of a synthetic record: flown open loop, gusts carry it off
Rung = dict[str, Any]


def ladder(flights: Sequence[Reconstruction], others: Sequence[Reconstruction], candidates: Bank, baseline: Baseline,
           evidences: Sequence[Evidence], posterior: Posterior, explained: Hypothesis | None, paths: gap.Paths,
           trained: gap.Energy, tested: gap.Energy, effects_alone: FloatArray, seed: int,
           progress: Progress = lambda text: None) -> dict[str, Any]:
    """Every rung on the held-out records.

    Args:
        flights, others: diagnosed and held-out records.
        explained: the diagnosed explanation.
        paths: of `gap.energies`, those that it enters.
        trained: residual energies of the diagnosed records.
        tested: residual energies of the held-out records before and after all that it changes.
        effects_alone: what its effects alone leave [windows, channels].
        seed: of synthetic records and intervals.

    Returns:
        `rungs`: [{"name", "effects", "gap", "closure", "closure_low95", "closure_high95"}], gaps in tolerances;
        `noise95`: gap that noise and gusts alone stay below 95 times in 100; `no_gap`: what the search closes on
        records without a gap, there by the whole residual (rms over channels, before and after).
    """
    progress("climbing the evidence ladder: the runner-up")
    rival = runner_up(posterior, explained)
    second = flown_parts(flights, trained, rival, _terms(rival, flights, candidates, evidences, baseline, posterior),
                         candidates.nuisances, paths).change  # fmt: skip
    settled = next((h.settled for h in posterior.hypotheses if not h.effects and h.unknown is None), None)
    numbers = Remedy() if settled is None else own_numbers(settled, candidates.nuisances)
    left = {"nothing": ([], tested.before), "numbers alone": ([], gap.of_all(others, numbers, paths)),
            "runner-up": (_names(rival), gap.of_all(others, second, paths)),
            "effects alone": (_names(explained), effects_alone),
            "diagnosed": (_names(explained), tested.after)}  # fmt: skip
    progress("climbing the evidence ladder: a regression that knows no physics")
    box = black_box.train([driven(f, f.parameters, paths) for f in flights])
    pushed = [gap.squares(f, Remedy(), paths, partial(black_box.Pushed, box, driven(f, f.parameters, paths)))
              for f in others]
    left["black box"] = ([], np.concatenate(pushed))
    rungs = [_rung(name, found, replace(tested, after=after), seed) for name, (found, after) in left.items()]
    progress("climbing the evidence ladder: the same search where there is no gap")
    return {"rungs": rungs, "noise95": gap.null_quantile(tested.alone),
            "no_gap": search_on_nothing(flights, others, candidates, baseline, evidences, seed)}


def runner_up(posterior: Posterior, explained: Hypothesis | None) -> Hypothesis:
    """The most probable explanation that shares nothing with the diagnosed one, and is one.

    Something unknown where a diagnosed effect enters, or beside something unknown, may be that itself in other words.
    """
    taken = set(explained.effects) if explained is not None else set()
    places = home(tuple(sorted(taken)))
    strange = explained is not None and explained.unknown is not None
    return next(h for h in posterior.hypotheses if (h.effects or h.unknown is not None)
                and h is not explained and not taken & set(h.effects)
                and not (h.unknown is not None and (strange or h.unknown.component in places)))


def search_on_nothing(flights: Sequence[Reconstruction], others: Sequence[Reconstruction], candidates: Bank,
                      baseline: Baseline, evidences: Sequence[Evidence], seed: int) -> dict[str, Any]:
    """Diagnose synthetic records of the model itself and fly the best explanation, believed or not."""
    gusts = typical(evidences)
    made, tests = ([piece for i, flight in enumerate(records)
                    for piece in synthetic(flight, gusts, seed + 2000 + start + 50 * i)]
                   for start, records in ((0, flights), (1000, others)))  # fmt: skip
    untestable = not_testable(made, candidates)
    found, posterior, _ = fit(made, candidates, untestable, baseline, lambda text: None)
    best = runner_up(posterior, None)
    terms = _terms(best, made, candidates, found, baseline, posterior)
    change = with_own_numbers(remedy(best, terms), best, terms, candidates.nuisances)
    before, after = (float(np.sqrt(np.nanmean(gap.of_all(tests, what)))) for what in (Remedy(), change))
    return {"effects": _names(best), "probability_no_gap": posterior.none, "before": before, "after": after,
            "closure": 1.0 - after / before}


def synthetic(flight: Reconstruction, gusts: Gusts, seed: int) -> list[Reconstruction]:
    """Records of the model itself under the controls of a record, in pieces, with gusts and the record's noise.

    Commands are left out: the positions are recorded ones, and how they follow is no question here.
    """
    length = min(round(PIECE / flight.dt), len(flight.time) - 1)
    first = np.arange(0, len(flight.time) - length, length)
    first = first if len(first) else np.zeros(1, np.intp)
    start = np.column_stack([flight.channel(name)[first] for name in FREE])
    rows = np.repeat(flight.parameters, len(first))
    y = fly(flight, rows, first, start, length, (gusts, seed))
    out = []
    for i, k in enumerate(first):
        span = slice(k + 1, k + 1 + length)
        measured = np.full((length, len(MEASURED)), np.nan)
        measured[:, : len(COMPARED)] = np.where(np.isfinite(flight.measured[span, : len(COMPARED)]), y[i], np.nan)
        out.append(replace(
            flight, time=flight.time[span] - flight.time[k + 1], measured=measured, commands={},
            controls={n: v[span] for n, v in flight.controls.items()},
            positions={n: v[span] for n, v in flight.positions.items()}, altitude=flight.altitude[span],
            known=None if flight.known is None else flight.known[span]))
    return out


def _terms(hypothesis: Hypothesis, flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence],
           baseline: Baseline, posterior: Posterior) -> Description | None:  # fmt: skip
    """Of something unknown, if there is any."""
    return None if hypothesis.unknown is None else describe_unknown(
        flights, candidates, evidences, baseline, posterior.tempering, hypothesis)


def _names(hypothesis: Hypothesis | None) -> list[str]:
    if hypothesis is None:
        return []
    return [*hypothesis.effects, *(["unknown"] if hypothesis.unknown is not None else [])]


def _rung(name: str, effects: list[str], energy: gap.Energy, seed: int) -> Rung:
    held = gap.held_out(energy, seed)
    return {"name": name, "effects": effects, "gap": held["after"],
            **{k: held[k] for k in ("closure", "closure_low95", "closure_high95")}}  # fmt: skip

