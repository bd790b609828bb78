"""Where a gap lies: by component and by flight regime."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, false_discovery_control

from icing_env.record import FloatArray
from sim2real.posterior.hypotheses import Posterior
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.evidence import Evidence

REGIME_VARIABLES = ("alpha", "airspeed", "beta", "q", "p", "elevator", "aileron", "rudder", "power", "ice", "time")
BINS = 4
FEWEST = 100  # samples that make a stretch
# Above noise, of the whitened square: what clean flights of aircraft within the model's uncertainty may leave in a
# stretch, in one channel and in all together (assumed; the most seen in five development flights: 0.87 and 0.16).
LEVEL, LEVEL_OVERALL = 1.0, 0.25
FALSE = 0.05  # of what is listed, that is expected to be there by chance


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


@dataclass(frozen=True)
class Stretch:
    """Flight with a variable between `low` and `high` (quartiles of the records; SI units, time in s).

    excess: mean whitened square of each channel of MEASURED, less one; nan where it was not measured.
    shown: which of these are believed; overall, shown_overall: the same of all channels together.
    """

    variable: str
    low: float
    high: float
    excess: FloatArray
    shown: NDArray[np.bool_]
    overall: float
    shown_overall: bool


def stretches(evidences: Sequence[Evidence]) -> list[Stretch]:
    """How much the innovations of each channel exceed noise and gusts in every quarter of each variable.

    A sum of squares counts if white noise of so much more energy as LEVEL would hardly reach it (chi-squared), and of
    all that are listed no more than FALSE are expected to be so by chance (Benjamini & Yekutieli, Annals of Statistics
    29, 2001: whatever their dependence). Channels are whitened in the order of MEASURED, each given those before it.
    """
    white = np.concatenate([e.whitened for e in evidences])
    found: list[tuple[str, float, float]] = []
    squares, counts = list[FloatArray](), list[FloatArray]()
    for name in REGIME_VARIABLES:
        values = np.concatenate([_variable(e.flight, name)[1 : len(e.whitened) + 1] for e in evidences])
        edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            inside = white[(values >= low) & (values <= high)]
            by_channel = np.stack([np.sum(inside**2, axis=0), np.count_nonzero(inside, axis=0)])
            if np.max(by_channel[1]) >= FEWEST:
                found.append((name, float(low), float(high)))
                square, count = np.column_stack([by_channel, by_channel.sum(axis=1)])
                squares.append(square)
                counts.append(count)
    if not found:
        return []
    square, count = np.array(squares), np.array(counts)
    level = 1.0 + np.array([LEVEL] * len(MEASURED) + [LEVEL_OVERALL])
    p = np.where(count > 0, chi2.sf(square / level, np.maximum(count, 1.0)), 1.0)
    shown = false_discovery_control(p.ravel(), method="by").reshape(p.shape) <= FALSE
    excess = np.where(count > 0, square / np.maximum(count, 1.0) - 1.0, np.nan)
    return [Stretch(name, low, high, excess[i, :-1], shown[i, :-1], float(excess[i, -1]), bool(shown[i, -1]))
            for i, (name, low, high) in enumerate(found)]


def regimes(evidences: Sequence[Evidence]) -> list[dict[str, Any]]:
    """Stretches of flight in which one-step predictions err by more than noise and gusts do, the worst first.

    `excess`: mean whitened square less one; `channels`: the same of the channels that show it, if any does by itself.
    """
    told = [{"variable": s.variable, "low": s.low, "high": s.high, "excess": s.overall,
             "channels": {MEASURED[c]: float(s.excess[c]) for c in np.flatnonzero(s.shown)}}
            for s in stretches(evidences) if s.shown_overall or s.shown.any()]  # fmt: skip
    return sorted(told, key=lambda r: -float(r["excess"]))


def _variable(flight: Reconstruction, name: str) -> FloatArray:
    """Of every sample [N]: a channel, a surface, both engines' power, the water met, or the time since the start."""
    if name == "time":
        return flight.time - flight.time[0]
    if name == "ice":
        return _water_met(flight)
    if name == "power":
        return flight.controls["power_left"] + flight.controls["power_right"]
    return flight.controls[name] if name in flight.controls else flight.channel(name)


def _water_met(flight: Reconstruction) -> FloatArray:
    """Liquid water on the aircraft's way so far [N], kg/m2: what ice it may have; zeros where none was recorded."""
    lwc = flight.record.channels.get("lwc", np.zeros(0))
    known = np.isfinite(lwc)
    if not known.any():
        return np.zeros(len(flight.time))
    since = flight.record.time[known] - flight.record.time[0]
    rate = np.interp(flight.time, since, lwc[known]) * flight.channel("airspeed")
    return np.concatenate([[0.0], np.cumsum(rate[:-1] * flight.dt)])
