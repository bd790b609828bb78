"""The few kinds of figure that reports share: time histories, estimates with their truth, gaps, derivatives compared.

Figures are made with matplotlib's objects alone, never with pyplot, so that nothing is kept behind the caller's back.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from icing_env.errors import InputError, nearest
from testbed.reports.plot_style import GREY, ROLES, Channels, legend_above, line, role_style, scale_of, styled


@styled
def time_histories(
    records: Mapping[str, Channels],
    channels: Sequence[str],
    roles: Mapping[str, str] | None = None,
    limits: Mapping[str, str] | None = None,
    spans: Sequence[tuple[float, float, str]] = (),
    columns: int = 1,
) -> Figure:
    """Channels against time, one above the other, in the units that pilots read (deg, kt, ft).

    Args:
        records: channels by name, SI and rad, with `time`, for each labelled flight (`FlightRecord.channels` fits).
        channels: what to plot, one panel each; flights without the channel are left out of its panel.
        roles: role (of `ROLES`) of a label; a label that is itself a role needs no entry.
        limits: by channel, the channel that bounds it (alpha: alpha_limit), drawn where a flight has it.
        spans: start, end (s) and name of what to shade (a cloud, boots on).
        columns: panels side by side.

    Raises:
        InputError: a channel that no flight has, or an unknown role.
    """
    for channel in channels:
        if not any(channel in record for record in records.values()):
            known = sorted({name for record in records.values() for name in record})
            raise InputError(f"no flight has channel '{channel}'; {nearest(channel, known)}")
    rows = math.ceil(len(channels) / columns)
    figure = Figure(figsize=(9.2, 0.7 + 1.45 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
    panels = list(grid.flat)
    for axes, channel in zip(panels, channels, strict=False):
        for index, (label, record) in enumerate(records.items()):
            style = role_style(label, roles, index)
            if channel in record:
                _history(axes, channel, record, label=label, **style)
            limit = (limits or {}).get(channel)
            if limit is not None and limit in record:
                # One flight: the colour of limits. Several: each limit in its flight's colour, so that pairs are seen.
                own = ROLES["limit"] if len(records) == 1 else {**ROLES["limit"], "color": style["color"]}
                of = scale_of(limit).label if len(records) == 1 else f"{label}, {scale_of(limit).label}"
                _history(axes, limit, record, label=of, **own)
        scale = scale_of(channel)
        axes.set_ylabel(f"{scale.label}\n({scale.unit})" if scale.unit else scale.label)
        axes.margins(x=0.0)
        for start, end, name in spans:
            axes.axvspan(start, end, color=GREY, alpha=0.14, linewidth=0.0, label=name)
    for axes in panels[len(channels) :]:
        axes.set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("time (s)")
    figure.align_ylabels()
    legend_above(figure, panels[: len(channels)])
    return figure


def _history(axes: Axes, channel: str, record: Channels, **style: Any) -> None:
    scale = scale_of(channel)
    line(axes, record["time"], record[channel] * scale.factor + scale.offset, **style)


@styled
def estimate_history(
    time: NDArray[np.float64],
    estimates: Channels,
    std_errors: Channels,
    truth: Mapping[str, ArrayLike] | None = None,
    clean: Mapping[str, float] | None = None,
    columns: int = 2,
) -> Figure:
    """Estimated derivatives against time with their 95 % intervals, and the truth where it is known.

    Args:
        time: s, shape (N,).
        estimates: by derivative, shape (N,).
        std_errors: standard errors by derivative, shape (N,); a derivative without one gets no interval.
        truth: by derivative, a number or shape (N,).
        clean: value of the clean aircraft by derivative, drawn as a reference.
        columns: panels side by side.
    """
    rows = math.ceil(len(estimates) / columns)
    figure = Figure(figsize=(9.2, 0.8 + 1.9 * rows), layout="constrained")
    panels = list(figure.subplots(rows, columns, sharex=True, squeeze=False).flat)
    for axes, (name, values) in zip(panels, estimates.items(), strict=False):
        if name in std_errors:
            half = 1.96 * std_errors[name]
            axes.fill_between(time, values - half, values + half, color=ROLES["estimate"]["color"], alpha=0.18,
                              linewidth=0.0, label="95 % interval")  # fmt: skip
        line(axes, time, values, label="estimate", **ROLES["estimate"])
        if truth is not None and name in truth:
            line(axes, time, np.broadcast_to(np.asarray(truth[name], float), time.shape), label="truth",
                  **ROLES["truth"])  # fmt: skip
        if clean is not None and name in clean:
            axes.axhline(clean[name], label="clean aircraft", **ROLES["clean"])
        _frame(axes, values, truth, clean, name)
    for axes in panels[len(estimates) :]:
        axes.set_visible(False)
    for axes in panels[max(0, len(estimates) - columns) : len(estimates)]:
        axes.set_xlabel("time (s)")
        axes.tick_params(labelbottom=True)
    legend_above(figure, panels[: len(estimates)])
    return figure


def _frame(
    axes: Axes,
    values: NDArray[np.float64],
    truth: Mapping[str, ArrayLike] | None,
    clean: Mapping[str, float] | None,
    name: str,
) -> None:
    """Title and y-limits: an estimator's first seconds, when it knows nothing yet, must not flatten all the rest."""
    shown = [np.nanpercentile(values, (2.0, 98.0))] if np.isfinite(values).any() else []
    shown += [np.ravel(np.asarray(source[name], float)) for source in (truth, clean) if source and name in source]
    if shown:
        low, high = float(np.nanmin(np.concatenate(shown))), float(np.nanmax(np.concatenate(shown)))
        pad = 0.35 * (high - low) or 0.1 * abs(high) or 1.0
        axes.set_ylim(low - pad, high + pad)
    axes.set_title(name, loc="left")
    axes.margins(x=0.0)


@styled
def gap_bars(
    before: Mapping[str, float], after: Mapping[str, float] | None = None, noise: Mapping[str, float] | None = None
) -> Figure:
    """Gap of each channel in units of its tolerance, before and after a correction, the largest on top.

    Args:
        before: RMS residual over tolerance, by channel.
        after: the same after the correction.
        noise: the part that noise and gust alone explain, marked on the bars.
    """
    names = sorted(before, key=lambda name: before[name])
    figure = Figure(figsize=(9.2, 1.0 + 0.36 * len(names)), layout="constrained")
    axes = figure.subplots()
    y = np.arange(len(names), dtype=float)
    thick = 0.36 if after else 0.6
    axes.barh(y + (0.19 if after else 0.0), [before[n] for n in names], thick, color=ROLES["iced"]["color"],
              label="before")  # fmt: skip
    if after:
        axes.barh(y - 0.19, [after.get(n, math.nan) for n in names], thick, color=ROLES["protected"]["color"],
                  label="after")  # fmt: skip
    if noise:
        axes.plot([noise.get(n, math.nan) for n in names], y, "|", color=ROLES["truth"]["color"], markersize=15,
                  markeredgewidth=1.8, label="noise and gust alone")  # fmt: skip
    axes.axvline(1.0, label="tolerance", **ROLES["limit"])
    axes.set_yticks(y, [scale_of(name).label for name in names])
    axes.set_xlabel("residual (tolerances)")
    axes.grid(False, axis="y")
    axes.set_xlim(left=0.0)
    legend_above(figure, [axes])
    return figure


@styled
def derivative_dots(
    series: Mapping[str, Mapping[str, tuple[float, float]]],
    reference: Mapping[str, float],
    roles: Mapping[str, str] | None = None,
    reference_label: str = "reference",
) -> Figure:
    """Derivatives of several sources as shares of a reference, each with its 95 % interval.

    Args:
        series: by source, by derivative: estimate and standard error.
        reference: value by derivative, not zero; its keys say which derivatives are shown and in which order.
        roles: role of a source, as in `time_histories`.
        reference_label: what the reference is.

    Raises:
        InputError: a reference of zero.
    """
    names = list(reference)
    for name in names:
        if reference[name] == 0.0:
            raise InputError(f"reference of '{name}' is 0: shares of it mean nothing; leave it out")
    figure = Figure(figsize=(9.2, 1.0 + 0.34 * len(names)), layout="constrained")
    axes = figure.subplots()
    axes.axvline(1.0, label=reference_label, **ROLES["truth"])
    offsets = np.linspace(0.22, -0.22, len(series)) if len(series) > 1 else [0.0]
    for index, (label, found) in enumerate(series.items()):
        there = [(row, name) for row, name in enumerate(names) if name in found]
        share = [found[name][0] / reference[name] for _, name in there]
        half = [1.96 * abs(found[name][1] / reference[name]) for _, name in there]
        axes.errorbar(share, [row - offsets[index] for row, _ in there], xerr=half, fmt="o", markersize=4.5,
                      capsize=2.5, color=role_style(label, roles, index)["color"], label=label)  # fmt: skip
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xlabel(f"share of {reference_label}")
    legend_above(figure, [axes])
    return figure
