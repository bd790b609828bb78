"""Figures 23 to 26: the H-infinity observer on one clear-air record from seven starts; and on a recorded flight."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from estimators.hinf import record as hinf_record
from estimators.observer.record import History
from estimators.regression import equation_error
from icing_env.record import FlightRecord, read
from testbed.reports.plot_style import GREY, ROLES, legend_above, line, styled
from testbed.reproduce.cases import NAMES, UNITS, fly_case
from testbed.reproduce.pictures import Picture
from testbed.reproduce.row import Row
from testbed.textbook import folder

ITEM = "fig23_26"
STARTS = (0.4, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6)  # of the published model; the paper has seven and does not print them
SMALL = 0.1  # of the starts' spread: what "a small fraction" is taken to be (assumed)
CASE = "clear, high V"
RECORDED = "totter_demo_data.mat"
Runs = list[History]


def rows(seed: int) -> list[Row]:
    """For each derivative: the spread of the final values over the spread of the starts."""
    found = []
    for record, kind, what in records(seed):
        runs = run_all(record)
        found += [_row(name, runs, kind, what) for name in NAMES]
    return found


def records(seed: int) -> list[tuple[FlightRecord, str, str]]:
    """The clear-air record that all seven starts see, and a recorded flight if present; with sort and description."""
    found = [(fly_case(CASE, seed)[0].record, "simulated", "a clear-air doublet set at 140 kt")]
    path = folder()/RECORDED
    if path.is_file():
        found.append((read(path), "recorded", "NASA record 13 Feb 2002 #18, eight seconds"))
    return found


def run_all(record: FlightRecord) -> Runs:
    """The observer's course over a record from every start."""
    return [hinf_record.history(record, start=start) for start in STARTS]


def course(run: History, name: str) -> NDArray[np.float64]:
    """Estimate of one derivative over time, in the paper's unit, shape (N,)."""
    return UNITS[name][1]*run.parameter(name)[0]


def _row(name: str, runs: Runs, kind: str, what: str) -> Row:
    ends = np.array([course(run, name)[-1] for run in runs])
    first = np.array([course(run, name)[0] for run in runs])
    share = float(np.ptp(ends)/np.ptp(first))
    agrees = share <= SMALL
    why = f"{what}; starts {first.min():.4g} to {first.max():.4g}, ends {ends.min():.4g} to {ends.max():.4g}"
    return Row(ITEM, f"{name}, {kind}: spread of the ends over the spread of the starts", kind, "a small fraction",
               share, "1", None, agrees, f"{SMALL:g} or less", why if agrees else
               f"{why}; the record excites it too little to outweigh the start")


def pictures(seed: int) -> list[Picture]:
    """Four panels for each record: the seven courses and stepwise regression's value."""
    found = []
    for record, kind, what in records(seed):
        steps = equation_error.identify(record)
        figure = draw(run_all(record), {name: UNITS[name][1]*steps[name].estimate for name in NAMES})
        found.append(Picture(figure, f"Figures 23 to 26, {kind}: the H-infinity observer on {what} from seven starts, "
                             f"{STARTS[0]:g} to {STARTS[-1]:g} of the published model; grey, stepwise regression's "
                             "value from the same record. Nothing moves until the elevator does.",
                             "Seven courses of four derivatives that run together after the doublet"))
    return found


@styled
def draw(runs: Runs, regression: dict[str, float]) -> Figure:
    """Courses of the four derivatives (paper's units) with a constant for each."""
    figure = Figure(figsize=(9.2, 5.2), layout="constrained")
    panels = list(figure.subplots(2, 2, sharex=True).flat)
    for axes, name in zip(panels, NAMES, strict=True):
        axes.axhline(regression[name], color=GREY, linewidth=3.0, label="stepwise regression")
        for k, run in enumerate(runs):
            line(axes, run.time - run.time[0], course(run, name), color=ROLES["estimate"]["color"], linewidth=1.1,
                 label="H-infinity" if k == 0 else None)
        axes.set_title(f"{name} ({UNITS[name][0]})", loc="left")
        axes.margins(x=0.0)
    for axes in panels[2:]:
        axes.set_xlabel("time (s)")
    legend_above(figure, panels)
    return figure
