"""Figures of a comparison: a metric of every controller in every case, and how the learned ones learned."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from controllers.policies.files import find, read
from testbed.comparison.overview import Rows, heading
from testbed.flight import controller
from testbed.reports.plot_style import GREY, ROLES, legend_above, styled

COLUMNS = 4
SIGNED = ("worst_alpha_margin",)  # metrics that can be negative: intervals of the others are shown from 0 on
SHOWN = {True: ("protected", "o"), False: ("unprotected", "D")}  # role and marker


@styled
def by_case(rows: Rows, name: str) -> Figure:
    """Mean and 95 % interval of a metric: a panel per case, a line per controller, protected and not.

    Kinds of controller are parted by grey lines; a controller without a value in a case leaves its line empty.
    """
    cases = list(dict.fromkeys((row["scenario"], row["turbulence"]) for row in rows))
    kinds = dict.fromkeys((row["controller"], row["kind"]) for row in rows)
    order = sorted(kinds, key=lambda pair: ("classical", "adaptive", "learned", "oracle").index(pair[1]))
    place = {controller: k for k, (controller, _) in enumerate(order)}
    columns = min(COLUMNS, len(cases))
    lines = math.ceil(len(cases)/columns)
    figure = Figure(figsize=(11.0, 0.8 + lines*(0.6 + 0.19*len(order))), layout="constrained")
    panels = list(figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).flat)
    for axes, case in zip(panels, cases, strict=False):
        for row in rows:
            metric = row["metrics"][name]
            if (row["scenario"], row["turbulence"]) != case or metric["mean"] is None:
                continue
            role, marker = SHOWN[row["protection"]]
            y = place[row["controller"]] + (-0.17 if row["protection"] else 0.17)
            low = metric["low95"] if name in SIGNED else max(metric["low95"], 0.0)
            spread = np.array([[metric["mean"] - low], [metric["high95"] - metric["mean"]]])
            axes.errorbar([metric["mean"]], [y], xerr=np.maximum(spread, 0.0), fmt=marker, markersize=3.5,
                          color=ROLES[role]["color"], linewidth=1.0, label=role)
        for k in range(1, len(order)):
            if order[k][1] != order[k - 1][1]:
                axes.axhline(k - 0.5, color=GREY, linewidth=0.8)
        axes.set_title(f"{case[0].replace('_', ' ')}, {case[1]}", fontsize=8.5)
        axes.set_yticks(range(len(order)), [controller for controller, _ in order], fontsize=7.5)
        axes.set_ylim(len(order) - 0.5, -0.5)
    for axes in panels[len(cases):]:
        axes.set_visible(False)
    for axes in panels[max(len(cases) - columns, 0):len(cases)]:
        axes.tick_params(labelbottom=True)  # the lowest of its column
    figure.supxlabel(heading(rows, name), fontsize=9.5)
    legend_above(figure, panels[:len(cases)])
    return figure


@styled
def learning_curves(controllers: Sequence[str]) -> Figure:
    """Mean reward on the fixed evaluation cases against decisions learned from, a line per training seed.

    Args:
        controllers: learned ones, by their names in `testbed.flight.CONTROLLERS`.
    """
    columns = min(COLUMNS, len(controllers))
    lines = math.ceil(len(controllers)/columns)
    figure = Figure(figsize=(11.0, 0.4 + 2.2*lines), layout="constrained")
    panels = list(figure.subplots(lines, columns, squeeze=False).flat)
    for axes, name in zip(panels, controllers, strict=False):
        for member in controller(name).members:
            curve = read(find(member))[2]["curve"]
            axes.plot([point["steps"]/1e3 for point in curve], [point["reward"] for point in curve], linewidth=1.0,
                      label=f"seed {member[-1]}")
        axes.set_title(name, fontsize=8.5)
        axes.set(xlabel="decisions (thousands)", ylabel="mean reward")
    for axes in panels[len(controllers):]:
        axes.set_visible(False)
    legend_above(figure, panels[:len(controllers)])
    return figure
