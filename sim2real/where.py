"""Where a gap lies: by component and by flight regime."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import false_discovery_control, ttest_1samp

from icing_env.record import FloatArray
from sim2real.evidence import Evidence
from sim2real.hypotheses import Posterior

REGIME_VARIABLES = ("alpha", "airspeed", "beta", "q", "p")
BINS = 4
FEWEST = 5  # seconds of flight that make a stretch
LEVEL = 0.1  # of the whitened square, to which noise is known (assumed: 5 % of its standard deviation)
FALSE = 0.05  # of the stretches listed, that are expected to be there by chance


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

    `excess`: mean whitened square less one. Seconds of flight are the samples (within one, innovations are of one
    mind): a stretch counts if their mean energy is above LEVEL by a t-test, and of all stretches tried no more than
    FALSE are listed in error (Benjamini & Yekutieli, Annals of Statistics 29, 2001: whatever their dependence).
    """
    tried, p = [], []
    for name in REGIME_VARIABLES:
        values, energy = (np.concatenate(parts) for parts in zip(*(_seconds(e, name) for e in evidences), strict=True))
        edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            inside = energy[(values >= low) & (values <= high)]
            if len(inside) >= FEWEST:
                tried.append({"variable": name, "low": float(low), "high": float(high),
                              "excess": float(np.mean(inside) - 1.0)})
                p.append(float(np.nan_to_num(ttest_1samp(inside, 1.0 + LEVEL, alternative="greater").pvalue, nan=1.0)))
    if not p:
        return []
    believed = false_discovery_control(p, method="by") <= FALSE
    return sorted((r for r, kept in zip(tried, believed, strict=True) if kept), key=lambda r: -r["excess"])


def _seconds(evidence: Evidence, name: str) -> tuple[FloatArray, FloatArray]:
    """Mean of a channel, and mean whitened square, in every second of a record once the filter has settled."""
    each = max(round(1.0 / evidence.flight.dt), 1)
    values, white = evidence.flight.channel(name)[1:][: len(evidence.whitened)], evidence.whitened
    used = np.any(white != 0.0, axis=1)
    values, white = values[used], white[used]
    count = len(white) // each
    square = np.where(white != 0.0, white**2, np.nan)[: count * each].reshape(count, -1)
    return values[: count * each].reshape(count, each).mean(axis=1), np.nanmean(square, axis=1)
