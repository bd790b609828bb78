"""Where a gap lies: by component and by flight regime."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sim2real.evidence import Evidence
from sim2real.hypotheses import Posterior

REGIME_VARIABLES = ("alpha", "airspeed", "beta", "q", "p")
BINS = 4
SHOWN = 4.0  # standard deviations of the mean whitened energy of a bin above one


def components(posterior: Posterior, enters_at: Mapping[str, Sequence[str]]) -> dict[str, float]:
    """Probability that the gap enters at each component, those above one in a thousand.

    Args:
        enters_at: components of every effect.
    """
    out: dict[str, float] = {}
    for hypothesis in posterior.hypotheses:
        touched = {c for name in hypothesis.effects for c in enters_at[name]}
        for component in touched:
            out[component] = out.get(component, 0.0) + hypothesis.probability
        if hypothesis.unknown is not None and hypothesis.unknown.component not in touched:
            at = hypothesis.unknown.component
            out[at] = out.get(at, 0.0) + hypothesis.probability
    return {k: min(v, 1.0) for k, v in sorted(out.items(), key=lambda item: -item[1]) if v > 1e-3}


def regimes(evidences: Sequence[Evidence]) -> list[dict[str, Any]]:
    """Stretches of alpha, speed, sideslip and rates in which the innovations are larger than noise and gusts are.

    `excess`: mean whitened square less one; only those beyond SHOWN standard deviations (2/n each) are listed.
    """
    out = []
    white = np.concatenate([e.whitened for e in evidences])
    for name in REGIME_VARIABLES:
        values = np.concatenate([e.flight.channel(name)[1 : len(e.whitened) + 1] for e in evidences])
        edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            inside = white[(values >= low) & (values <= high)]
            inside = inside[inside != 0.0]
            if len(inside) < 100:
                continue
            excess = float(np.mean(inside**2) - 1.0)
            if excess > SHOWN * np.sqrt(2.0 / len(inside)):
                out.append({"variable": name, "low": float(low), "high": float(high), "excess": excess})
    return sorted(out, key=lambda r: -r["excess"])
