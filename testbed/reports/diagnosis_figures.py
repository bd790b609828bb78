"""Figures of a diagnosis: explanations, where the gap lies, how a size went, the evidence ladder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sim2real.closing import gap
from sim2real.prediction.windows import COMPARED
from sim2real.records.channels import MEASURED
from sim2real.where import Stretch
from testbed.reports.plot_style import ROLES, scale_of, styled

LINE = 44  # characters of a name beside its bar


@styled
def bars(values: Mapping[str, float], label: str) -> Figure:
    """Probabilities by name, long names on several lines."""
    names = [fill(name, LINE) for name in values]
    lines = sum(1 + name.count("\n") for name in names)
    figure = Figure(figsize=(9.2, 0.9 + 0.32 * max(len(names), 0.6 * lines)), layout="constrained")
    axes = figure.subplots()
    axes.barh(names, list(values.values()), 0.6, color=ROLES["estimate"]["color"])
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel(label)
    axes.grid(False, axis="y")
    return figure


@styled
def ladder_gaps(ladder: Mapping[str, Any]) -> Figure:
    """The gap each rung leaves, with the interval that its closure has."""
    rungs = list(reversed(ladder["rungs"]))
    figure = Figure(figsize=(9.2, 1.1 + 0.42 * len(rungs)), layout="constrained")
    axes = figure.subplots()
    before = next(r["gap"] for r in rungs if r["name"] == "nothing")
    for y, rung in enumerate(rungs):
        role = "protected" if rung["name"] == "diagnosed" else "iced" if rung["name"] == "nothing" else "estimate"
        axes.barh(y, rung["gap"], 0.6, color=ROLES[role]["color"])
        end = rung["gap"]
        if rung["closure"] is not None and rung["closure_low95"] is not None and rung["name"] != "nothing":
            low, end = (max(before * (1.0 - rung[f"closure_{side}95"]), 0.0) for side in ("high", "low"))
            axes.plot([low, end], [y, y], color=ROLES["truth"]["color"], marker="|", markersize=9)
            axes.annotate(f"{100.0 * rung['closure']:.0f} % closed", (max(end, rung["gap"]), y), (6, 0),
                          textcoords="offset points", va="center")  # fmt: skip
    axes.axvline(ladder["noise95"], **ROLES["limit"])
    names = {"nothing": "nothing: the model", "numbers alone": "numbers alone: no effect",
             "black box": "black box: no physics"}  # fmt: skip
    axes.set_yticks(range(len(rungs)), [names.get(r["name"], f"{r['name']}: {', '.join(r['effects'])}") for r in rungs])
    axes.set_xlim(0.0, 1.18 * max(r["gap"] for r in rungs))
    axes.set_xlabel("gap on the held-out records (tolerances)")
    axes.grid(False, axis="y")
    return figure


@styled
def heat(energy: gap.Energy, windows: Sequence[int]) -> Figure:
    """Channels by windows; `windows` of each record, one after another."""
    shown = [j for j in range(len(COMPARED)) if np.isfinite(energy.before[:, j]).any()]
    values = np.sqrt(energy.before[:, shown].T)
    figure = Figure(figsize=(9.2, 1.0 + 0.3 * len(shown)), layout="constrained")
    axes = figure.subplots()
    image = axes.imshow(values, aspect="auto", cmap="viridis", vmin=0.0)
    axes.set_yticks(range(len(shown)), [scale_of(COMPARED[j]).label for j in shown])
    edges = np.cumsum([0, *windows]) - 0.5
    for edge in edges[1:-1]:
        axes.axvline(edge, color="white", linewidth=2.0)
    axes.set_xticks(0.5 * (edges[1:] + edges[:-1]), [f"record {k}" for k in range(1, len(edges))])
    axes.set_xlabel("windows of 10 s, one record after another")
    axes.grid(False)
    figure.colorbar(image, ax=axes, label="tolerances")
    return figure


def regime_heat(found: list[Stretch]) -> Figure:
    """Channels by quarters of each variable; a dot where the error is beyond chance."""
    shown = [c for c in range(len(MEASURED)) if any(np.isfinite(s.excess[c]) for s in found)]
    values = np.sqrt(np.maximum(np.array([s.excess[shown] for s in found]).T + 1.0, 0.0))
    figure = Figure(figsize=(9.2, 1.2 + 0.3 * len(shown)), layout="constrained")
    axes = figure.subplots()
    image = axes.imshow(values, aspect="auto", cmap="viridis", vmin=0.8, vmax=max(2.0, float(np.nanmax(values))))
    at, row = np.nonzero(np.array([s.shown[shown] for s in found]))
    axes.plot(at, row, "o", color="white", markeredgecolor="black", markersize=4)
    names = list(dict.fromkeys(s.variable for s in found))
    first = [next(i for i, s in enumerate(found) if s.variable == name) for name in names]
    last = [*first[1:], len(found)]
    axes.set_xticks([0.5 * (a + b - 1) for a, b in zip(first, last, strict=True)],
                    [scale_of(name).label for name in names], rotation=30, ha="right")  # fmt: skip
    for edge in first[1:]:
        axes.axvline(edge - 0.5, color="white", linewidth=2.0)
    axes.set_yticks(range(len(shown)), [scale_of(MEASURED[c]).label for c in shown])
    axes.grid(False)
    figure.colorbar(image, ax=axes, label="error over noise and gusts")
    return figure


@styled
def size_histories(effect: Mapping[str, Any]) -> Figure:
    """The size of one effect (of a diagnosis' answer) by stretch, a panel for each record."""
    records = sorted({s["record"] for s in effect["sizes"]})
    figure = Figure(figsize=(9.2, 2.6), layout="constrained")
    panels = list(figure.subplots(1, len(records), sharey=True, squeeze=False).flat)
    name, common = max(effect["parameters"].items(), key=lambda item: item[1]["high95"] - item[1]["low95"])
    for axes, record in zip(panels, records, strict=True):
        for s in (s for s in effect["sizes"] if s["record"] == record):
            span = [s["start"], s["end"]]
            axes.fill_between(span, s["low95"], s["high95"], color=ROLES["estimate"]["color"], alpha=0.18,
                              linewidth=0.0)  # fmt: skip
            axes.plot(span, [s["estimate"]] * 2, **ROLES["estimate"])
        axes.axhline(common["estimate"], **{**ROLES["clean"], "linestyle": "--"})
        axes.set_title(f"record {record + 1}", loc="left")
        axes.set_xlabel("time (s)")
        axes.margins(x=0.0)
    panels[0].set_ylabel(f"{name} [{common['unit']}]")
    return figure
