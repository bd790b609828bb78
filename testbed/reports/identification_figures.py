"""Figures of an identification: flights flown again, what is left over, methods side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from testbed.reports.flown_again import FlownAgain
from testbed.reports.plot_style import GREY, ROLES, legend_above, line, scale_of, styled

LAGS = 2.0  # s of lag shown
COLOURS = [ROLES[name]["color"] for name in ("estimate", "iced", "protected", "unprotected", "limit", "clean")]
MARKS = "osD^vP*Xdh<>"  # a method's colour and mark together are its own


@styled
def fit_histories(flown: FlownAgain, controls: Mapping[str, NDArray[np.float64]]) -> Figure:
    """Controls, then measured and simulated channels over time."""
    names = list(flown.measured)
    figure = Figure(figsize=(9.2, 0.7 + 1.3*(len(names) + len(controls))), layout="constrained")
    panels = list(figure.subplots(len(names) + len(controls), 1, sharex=True, squeeze=False).flat)
    time = flown.time - flown.time[0]
    for axes, (name, values) in zip(panels, controls.items(), strict=False):
        scale = scale_of(name)
        line(axes, time, values*scale.factor, color=GREY, label="control")
        axes.set_ylabel(f"{scale.label}\n({scale.unit})")
        axes.margins(x=0.0)
    for axes, name in zip(panels[len(controls):], names, strict=True):
        scale = scale_of(name)
        line(axes, time, flown.simulated[name]*scale.factor, **ROLES["estimate"], label="simulated")
        line(axes, time, flown.measured[name]*scale.factor, **ROLES["truth"], label="measured")
        axes.set_ylabel(f"{scale.label}\n({scale.unit})")
        axes.set_title(f"R² {flown.r2[name]:.3f}", loc="right", fontsize=9.0)
        axes.margins(x=0.0)
    panels[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    legend_above(figure, panels)
    return figure


def autocorrelation(residual: NDArray[np.float64], lags: int) -> NDArray[np.float64]:
    """Autocorrelation at lags 0..lags of a residual about its mean; samples that are absent count as the mean."""
    known = np.isfinite(residual)
    centred = np.where(known, residual - np.mean(residual[known]), 0.0)
    whole = np.correlate(centred, centred, mode="full")[len(centred) - 1:]
    return np.asarray(whole[:lags + 1]/max(whole[0], 1e-300), dtype=np.float64)


@styled
def residual_correlations(flown: FlownAgain) -> Figure:
    """Autocorrelation of each channel's residual, with the bounds that white noise keeps to in 95 %."""
    names, dt = list(flown.measured), float(np.median(np.diff(flown.time)))
    lags = min(round(LAGS/dt), len(flown.time) - 1)
    figure = Figure(figsize=(9.2, 2.5), layout="constrained")
    panels = list(figure.subplots(1, len(names), sharey=True, squeeze=False).flat)
    bound = 1.96/np.sqrt(len(flown.time))
    for axes, name in zip(panels, names, strict=True):
        axes.axhspan(-bound, bound, color=GREY, alpha=0.25, linewidth=0.0, label="white noise, 95 %")
        axes.plot(np.arange(lags + 1)*dt, autocorrelation(flown.residual[name], lags), **ROLES["estimate"],
                  label="residual")
        axes.set_title(scale_of(name).label, loc="left")
        axes.set_xlabel("lag (s)")
        axes.margins(x=0.0)
    panels[0].set_ylabel("autocorrelation (1)")
    legend_above(figure, panels)
    return figure


@styled
def methods_compared(series: Mapping[str, Mapping[str, tuple[float, float]]], names: Sequence[str],
                     reference: str | Mapping[str, float]) -> Figure:
    """Each derivative in a panel of its own: the methods' estimates with 95 % intervals.

    Args:
        series: by method, by derivative: estimate and standard error.
        names: derivatives shown, one panel each.
        reference: the method drawn as a line, or values by derivative.
    """
    columns = min(3, len(names))
    rows = -(-len(names)//columns)
    figure = Figure(figsize=(9.2, 0.9 + rows*(0.5 + 0.17*len(series))), layout="constrained")
    panels = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes, name in zip(panels, names, strict=False):
        value = series.get(reference, {}).get(name, (None,))[0] if isinstance(reference, str) else reference.get(name)
        if value is not None:
            axes.axvline(value, label=reference if isinstance(reference, str) else "textbook", **ROLES["truth"])
        for k, (method, found) in enumerate(series.items()):
            if name in found:
                estimate, error = found[name]
                axes.errorbar([estimate], [k], xerr=[1.96*error], fmt=MARKS[k % len(MARKS)], markersize=4.5,
                              capsize=2.5, color=COLOURS[k % len(COLOURS)], label=method)
        axes.set_ylim(len(series) - 0.4, -0.6)
        axes.set_yticks([])
        axes.grid(False, axis="y")
        axes.set_title(f"{name} (1/rad)", loc="left")
        axes.ticklabel_format(axis="x", useOffset=False)
        axes.locator_params(axis="x", nbins=5)
    for axes in panels[len(names):]:
        axes.set_visible(False)
    handles = {label: handle for axes in panels
               for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(list(handles.values()), list(handles), loc="outside upper left", ncols=5)
    return figure
