"""What a diagnosis says, field by field as the interface has it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from icing_env import effects
from icing_env.jit import source_hash
from icing_env.record import DataProblem, FlightRecord
from sim2real.closing.discrepancy import Description
from sim2real.library.candidates import SPREAD
from sim2real.over_time.history import SAME, History
from sim2real.posterior.form import at_home
from sim2real.posterior.hypotheses import Hypothesis, Posterior
from sim2real.posterior.prior import P_NONE, P_UNKNOWN
from sim2real.posterior.singles import EffectFit
from sim2real.posterior.widened import interval
from sim2real.records.reconstruct import Reconstruction
from sim2real.rollout import difference
from sim2real.signatures.evidence import Evidence


def ranked(posterior: Posterior) -> list[tuple[str, float]]:
    """Effects, the most probable first."""
    return sorted(posterior.effects.items(), key=lambda item: -item[1])


def judge(posterior: Posterior) -> tuple[str, list[dict[str, Any]]]:
    """Verdict, and every hypothesis with its probability, the most probable first."""
    found: list[dict[str, Any]] = [{"effects": list(h.effects), "unknown": h.unknown is not None,
                                    "probability": h.probability} for h in posterior.hypotheses]
    verdict = "no_gap" if posterior.none >= 0.5 else "unknown" if posterior.unknown >= 0.5 else "explained"
    return verdict, found


def credible(probabilities: Sequence[float], level: float = 0.95) -> list[int]:
    """Indices of the fewest hypotheses that hold `level` of the probability (they come sorted)."""
    count = int(np.searchsorted(np.cumsum(probabilities), level - 1e-12)) + 1
    return list(range(min(count, len(probabilities))))


def describe(name: str, posterior: Posterior, explained: Hypothesis | None = None,
             forms: Sequence[Description] = (), course: History = SAME) -> dict[str, Any]:
    """One effect's entry: its size as in the most probable set that holds it.

    Args:
        explained, forms: the explanation that the verdict rests on, and terms by which it is not the library's.
        course: how its size went along the records.
    """
    fit = posterior.leading(name)
    at = fit.effects.index(name)
    effect, parameter = fit.families[at].effect, fit.families[at].parameter
    shown = {p.name: {"estimate": p.neutral, "low95": p.neutral, "high95": p.neutral, "unit": p.unit}
             for p in effect.parameters}
    low, high = interval(fit.estimate[at], fit.low95[at], fit.high95[at], parameter.low, parameter.high)
    own = [form for form in forms if explained and name in explained.effects and at_home(form.component, (name,))]
    shown[parameter.name] = {"estimate": fit.estimate[at], "low95": low, "high95": high, "unit": parameter.unit}
    return {"name": name, "probability": posterior.effects[name], "enters_at": list(effect.enters_at),
            "parameters": shown, "indistinguishable_from": list(posterior.classes[name]), **course.answer(),
            "other_form": own[0].answer() if own else None}


def detection_limits(fits: Mapping[str, EffectFit], shown: Mapping[str, float | None]) -> dict[str, dict[str, Any]]:
    """Smallest size of every tested effect that would have stood out (whitened distance 3.5 from none)."""
    return {name: {"parameter": fit.family.parameter.name, "smallest": shown[name], "unit": fit.family.parameter.unit}
            for name, fit in fits.items()}


def _slow(problem: DataProblem, record: FlightRecord) -> bool:
    """Whether samples are "missing" only because the channel runs at a lower, regular rate: no problem at all."""
    if not problem.kind.endswith("samples missing, interpolated") or problem.channel not in record.channels:
        return False
    steps = np.diff(record.time[np.isfinite(record[problem.channel])])
    return len(steps) > 0 and float(np.ptp(steps)) < 0.5 * record.dt


def problems(flights: Iterable[Reconstruction]) -> list[dict[str, Any]]:
    """What is wrong with the records' data."""
    return [{"channel": p.channel, "kind": p.kind, "from": p.start, "to": p.end, "repaired": p.repaired}
            for f in flights for p in f.record.problems if not _slow(p, f.record)]


def provenance(flights: Sequence[Reconstruction], others: Sequence[Reconstruction], evidences: Sequence[Evidence],
               without: tuple[str, ...], references: int, seed: int) -> dict[str, Any]:
    """What the answer was made from."""
    return {
        "records": [{"sha256": content_hash(f.record), "samples": len(f.time), "rate_hz": 1.0 / f.dt,
                     "sigma_w": e.gusts.sigma, "rotational_gusts": e.gusts.kind.rotation,
                     "tail_meets_gusts_later": e.gusts.kind.tail_delay, "notes": list(f.notes)}
                    for f, e in zip(flights, evidences, strict=True)],
        "held_out": [{"sha256": content_hash(f.record), "samples": len(f.time), "notes": list(f.notes)}
                     for f in others],
        "simulator": [difference(f) for f in flights] if flights[0].known is not None else None,
        "references": references, "without": list(without), "library": len(effects.LIBRARY),
        "sources": source_hash("sim2real"), "seed": seed,
        "assumptions": {"prior_no_gap": P_NONE, "prior_unknown": P_UNKNOWN, "baseline_spread": SPREAD},
    }


def content_hash(record: FlightRecord) -> str:
    """Hash of the channels, whatever the file was called."""
    digest = hashlib.sha256()
    for name in sorted(record.channels):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(record.channels[name]).tobytes())
    return digest.hexdigest()
