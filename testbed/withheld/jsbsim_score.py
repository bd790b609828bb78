"""Score answers on flights of JSBSim: probability of the true effect, how far the gap closes, where it was looked for.

Json and NumPy alone.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

NAMED, SEEN = 0.75, 0.5  # bar on the true effect's probability; of a component from which it counts as named
Case = dict[str, Any]


def flat(answer: dict[str, Any], key: dict[str, Any]) -> Case:
    """What the figures need of one answer and its key.

    An answer {"error": ...}, or one whose probabilities are no numbers, has failed: probability 0 and no closure.
    """
    if any(h["probability"] is None for h in answer.get("hypotheses", [])):
        answer = {"error": "probabilities are not numbers", "seconds": answer.get("seconds")}
    hypotheses = answer.get("hypotheses", [])
    truth = set(key["effects"])
    places = answer.get("where", {}).get("components", {})
    held = answer.get("gap", {}).get("held_out", {})
    first = max(hypotheses, key=lambda h: h["probability"], default=None)
    return {
        "case": key["case"], "tier": key["tier"], "sigma": key["sigma_w"], "effect": next(iter(key["effects"]), "none"),
        "size": next(iter(next(iter(key["parameters"].values()), {0: 0.0}).values())), "failed": "error" in answer,
        "why": answer.get("error"), "verdict": answer.get("verdict"), "first": _text(first),
        "included": sum(h["probability"] for h in hypotheses if truth and truth <= set(h["effects"])),
        "exact": sum(h["probability"] for h in hypotheses if set(h["effects"]) == truth and not h["unknown"]),
        "estimate": _estimate(answer, key), "closure": held.get("closure"), "before": held.get("before"),
        "seen": sorted(c for c, p in places.items() if p >= SEEN), "where": key["where"],
        "seconds": answer.get("seconds"),
    }  # fmt: skip


def _text(hypothesis: dict[str, Any] | None) -> str:
    if hypothesis is None:
        return "-"
    return " + ".join([*hypothesis["effects"], *(["unknown"] if hypothesis["unknown"] else [])]) or "no gap"


def _estimate(answer: dict[str, Any], key: dict[str, Any]) -> float | None:
    """Size that the answer gives the true effect."""
    for name, values in key["parameters"].items():
        entry = next((e for e in answer.get("effects", []) if e["name"] == name), None)
        if entry is not None:
            return float(entry["parameters"][next(iter(values))]["estimate"])
    return None


def _mean(values: Sequence[Any]) -> float | None:
    return float(np.mean([float(v) for v in values])) if values else None


def _median(values: Sequence[float | None]) -> float | None:
    known = [v for v in values if v is not None and math.isfinite(v)]
    return float(np.median(known)) if known else None


def figures(cases: Sequence[Case]) -> dict[str, Any]:
    """Figures of the cases with references; each case as a row, the worst first."""
    changed = [c for c in cases if c["effect"] != "none"]
    nulls = [c for c in cases if c["effect"] == "none"]
    right = sum(len(set(c["seen"]) & set(c["where"])) for c in changed)
    total = sum(len(c["seen"]) + len(c["where"]) for c in changed)

    def by_gust(of: Callable[[list[Case]], float | None]) -> dict[str, float | None]:
        return {f"{s:g}": of([c for c in changed if c["sigma"] == s]) for s in (0.0, 0.5, 1.5)}

    return {
        "cases": len(cases), "failed": sum(c["failed"] for c in cases), "changed": len(changed), "nulls": len(nulls),
        "probability_median": _median([c["included"] for c in changed]),
        "named": _mean([c["included"] >= NAMED for c in changed]),
        "named_by_gust": by_gust(lambda some: _mean([c["included"] >= NAMED for c in some])),
        "exact": _mean([c["exact"] >= NAMED for c in changed]),
        "closure_median": _median([c["closure"] for c in changed]),
        "closure_by_gust": by_gust(lambda some: _median([c["closure"] for c in some])),
        "size_error_median": _median([None if c["estimate"] is None else abs(c["estimate"] / c["size"] - 1.0)
                                      for c in changed]),
        "null_false_alarm": _mean([c["verdict"] != "no_gap" for c in nulls]),
        "where_f1": 2.0 * right / total if total else None,
        "seconds_per_case": _mean([c["seconds"] for c in cases if c["seconds"] is not None]),
        "rows": sorted(cases, key=lambda c: (c["included"] if c["effect"] != "none" else 1.0, c["closure"] or 0.0)),
    }  # fmt: skip


def score(answers: Path, keys: Path, differing: Sequence[str]) -> dict[str, Any]:
    """Figures with references, and of answers without any: components named against those that truly differ.

    Args:
        differing: components in which the two simulators' tables differ by more than a tolerance.
    """
    cases = [flat(json.loads(path.read_text()), json.loads((keys / path.name).read_text()))
             for path in sorted(answers.glob("*.json"))]
    alone = [{**c, "where": sorted(differing)} for c in cases if c["tier"] == "jsbsim_alone"]
    as_it_is = figures([c for c in cases if c["tier"] == "jsbsim_as_it_is"])
    return {**figures([c for c in cases if c["tier"] == "jsbsim"]), "as_it_is": as_it_is, "without_references": {
        "cases": len(alone), "failed": sum(c["failed"] for c in alone), "differing": sorted(differing),
        "recall": _mean([len(set(c["seen"]) & set(differing)) / max(len(differing), 1) for c in alone]),
        "precision": _mean([len(set(c["seen"]) & set(differing)) / len(c["seen"]) for c in alone if c["seen"]]),
        "rows": alone}}  # fmt: skip
