"""What a rival thinks of some records, as an answer of the form that `icing diagnose --json` has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import expit, softmax

from icing_env import effects
from icing_env.effects import Parameter
from sim2real.answer import credible

FAINTEST = 1e-6  # probability that nothing named falls below: what a rival rules out it may be wrong about (assumed)
DESCRIBED = 0.01  # effects at least this probable are described, as in `icing diagnose`


@dataclass(frozen=True)
class Size:
    """An effect's size and its 95 % interval, in the unit of its parameter."""

    parameter: Parameter
    estimate: float
    low95: float
    high95: float


@dataclass(frozen=True)
class Opinion:
    """What a rival makes of the records of one aircraft.

    Attributes:
        alarm: how far they stand from the model, above zero, in the rival's own unit.
        evidence: how much speaks for each effect alone, by name, up to a constant, in the rival's own unit.
        sizes: of the same effects.
    """

    alarm: float
    evidence: Mapping[str, float]
    sizes: Mapping[str, Size]


@dataclass(frozen=True)
class Scale:
    """What turns a rival's units into probabilities; set on development cases (`testbed.rivals.scales`).

    Attributes:
        level: alarm at which a gap is as probable as none.
        width: of the logistic curve about it, in the alarm's logarithm.
        sharpness: by which evidence is multiplied to be a logarithm of probability.
        doubt: share of a gap's probability that all effects have alike, since evidence may mislead.
    """

    level: float
    width: float
    sharpness: float
    doubt: float


def probabilities(told: Opinion, scale: Scale) -> dict[str, float]:
    """Probability of no gap ("") and of every effect alone; their sum is one."""
    gap = float(expit((math.log(told.alarm) - math.log(scale.level)) / scale.width))
    names = list(told.evidence)
    share = softmax(scale.sharpness * np.array([told.evidence[name] for name in names]))
    share = (1.0 - scale.doubt) * share + scale.doubt / len(names)
    found = np.maximum(np.array([1.0 - gap, *(gap * share)]), FAINTEST)
    return dict(zip(["", *names], (found / found.sum()).tolist(), strict=True))


def answer(told: Opinion, scale: Scale, seconds: float) -> dict[str, Any]:
    """The opinion as JSON: hypotheses of at most one effect, no word on the unknown, no closure.

    Args:
        seconds: that it took.
    """
    p = probabilities(told, scale)
    names = sorted(p, key=lambda name: -p[name])
    components: dict[str, float] = {}
    for name in filter(None, names):
        for component in effects.LIBRARY[name].enters_at:
            components[component] = min(components.get(component, 0.0) + p[name], 1.0)
    return {
        "verdict": "no_gap" if p[""] >= 0.5 else "explained",
        "hypotheses": [{"effects": [name] if name else [], "unknown": False, "probability": p[name]}
                       for name in names],
        "credible_set_95": credible([p[name] for name in names]),
        "where": {"components": components},
        "effects": [_described(name, p[name], told.sizes[name]) for name in names if name and p[name] >= DESCRIBED],
        "gap": {"held_out": {"closure": None}},
        "seconds": seconds,
    }


def _described(name: str, probability: float, size: Size) -> dict[str, Any]:
    effect = effects.LIBRARY[name]
    shown = {q.name: {"estimate": q.neutral, "low95": q.neutral, "high95": q.neutral, "unit": q.unit}
             for q in effect.parameters}  # fmt: skip
    shown[size.parameter.name] = {"estimate": size.estimate, "low95": size.low95, "high95": size.high95,
                                  "unit": size.parameter.unit}  # fmt: skip
    return {"name": name, "probability": probability, "enters_at": list(effect.enters_at), "parameters": shown,
            "indistinguishable_from": []}
