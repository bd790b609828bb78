"""Figures 1 to 7, 15 to 18, 21 and 22: clouds, severity, derivatives and drag event by event, and trim."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from icing_env import aircraft
from icing_env import scenario as scenarios
from testbed.flight import fly
from testbed.reports.plot_style import GREY, ROLES, legend_above, line, styled
from testbed.reproduce.flight import DEGREE, PRINTED, SEEDS, Flights, fly_all, stepwise
from testbed.reproduce.pictures import Picture
from testbed.reproduce.windows import Window, fly_sets

SPEEDS = (54.0, 58.0, 62.0, 66.0, 70.0, 74.0, 80.0)  # m/s of the clean trim curve
CLOCK = "time after 13:38 (min)"
PAPER = {"marker": "D", "linestyle": "none", "color": "#1A1A1A", "markersize": 5.0, "markerfacecolor": "none"}
History = dict[str, NDArray[np.float64]]


@lru_cache(maxsize=1)
def history(seed: int) -> History:
    """Cloud, severity and excess drag of flight 010302f1 once a second."""
    flown = fly(scenarios.load("flight_010302f1"), seed=1000*seed, rate=1.0)
    return {**flown.truth, "estimated": flown.estimate["excess_drag"].astype(np.float64)}


def founding(seed: int) -> list[Picture]:
    """Figures 1 to 4, and 5 to 7."""
    told, flights = history(seed), fly_all("flight_010302f1", seed, SEEDS)
    return [
        Picture(cloud(told), "Figures 1 to 4: liquid water, static temperature and drop size of flight 010302f1 as "
                "rebuilt from the paper's text, and the severity of the wing as flown here; dotted, with boots that "
                "leave nothing, as the paper assumes.", "Cloud and severity over 98 minutes"),
        Picture(events(told, flights), f"Figures 5 to 7: CL_alpha and Cm_alpha at each doublet set, {SEEDS} flights, "
                "and the excess drag. Diamonds, what the paper prints. Vertical lines, boots.",
                "Derivatives and drag at twelve doublet sets with the paper's values")]


def _minutes(of: History) -> NDArray[np.float64]:
    return of["time"]/60.0


@styled
def cloud(told: History) -> Figure:
    """Four panels over time."""
    figure = Figure(figsize=(9.2, 5.6), layout="constrained")
    panels = list(figure.subplots(4, 1, sharex=True).flat)
    wing = 0.5*(told["eta_left_wing"] + told["eta_right_wing"])
    labels = ("liquid water\n(g/m³)", "static temp.\n(°C)", "drop size\n(µm)", "eta of the\nwing (1)")
    shown = (1e3*told["lwc"], told["temperature"] - 273.15, 1e6*told["mvd"], wing)
    for axes, values, label in zip(panels, shown, labels, strict=True):
        line(axes, _minutes(told), values, color=ROLES["estimate"]["color"], label="as flown")
        axes.set_ylabel(label)
        axes.margins(x=0.0)
    line(panels[3], _minutes(told), since_boots(told["time"], wing), color=GREY, linestyle=":",
         label="since the last de-icing")
    panels[3].set_xlabel(CLOCK)
    figure.align_ylabels()
    legend_above(figure, panels)
    return figure


def since_boots(time: NDArray[np.float64], wing: NDArray[np.float64]) -> NDArray[np.float64]:
    """The wing's severity less what it was right after the last activation of its boots, shape (N,)."""
    out = wing.copy()
    for event in scenarios.load("flight_010302f1").events:
        if "wing" in (event.boots or ()):
            after = time >= event.time
            settled = wing[min(int(np.searchsorted(time, event.time + 10.0)), len(wing) - 1)]
            out[after] = np.maximum(wing[after] - settled, 0.0)
    return out


@styled
def events(told: History, flights: Flights) -> Figure:
    """CL_alpha, Cm_alpha and excess drag over time."""
    scenario = scenarios.load("flight_010302f1")
    times = {e.name: e.time/60.0 for e in scenario.events if e.doublets}
    figure = Figure(figsize=(9.2, 6.2), layout="constrained")
    lift, pitch, drag = figure.subplots(3, 1, sharex=True)
    for axes, name in ((lift, "CL_alpha"), (pitch, "Cm_alpha")):
        for k, flight in enumerate(flights):
            axes.plot(list(times.values()), [DEGREE*stepwise(flight[n], name) for n in times], "o-", linewidth=0.6,
                      markersize=4.0, color=ROLES["iced"]["color"], label="stepwise regression" if k == 0 else None)
        axes.set_ylabel(f"{name}\n(1/deg)")
    line(drag, _minutes(told), told["estimated"], **ROLES["estimate"], label="observer in flight")
    drag.set_ylabel("excess drag\n(1)")
    for axes, quantity in ((lift, "CL_alpha"), (drag, "delta_CD0")):
        there = [p for p in PRINTED if p.quantity == quantity]
        axes.plot([times[p.event] for p in there], [p.value for p in there], label="printed", **PAPER)
    pitch.plot([times["third_encounter_1"], times["third_encounter_3"]], [-0.0205, -0.0207], label="printed", **PAPER)
    for axes in (lift, pitch, drag):
        axes.margins(x=0.02)
        for event in scenario.events:
            if event.boots:
                axes.axvline(event.time/60.0, color=GREY, linewidth=0.8, linestyle=":", label="boots")
    drag.set_xlabel(CLOCK)
    figure.align_ylabels()
    legend_above(figure, [lift, pitch, drag])
    return figure


def over_sets(flights: Flights, names: Sequence[str], labels: Sequence[str], caption: str) -> Picture:
    """CL_alpha and excess drag at each of some sets, mean and every flight."""
    return Picture(_over_sets(flights, tuple(names), tuple(labels)), caption,
                   "Lift slope and excess drag over doublet sets")


@styled
def _over_sets(flights: Flights, names: tuple[str, ...], labels: tuple[str, ...]) -> Figure:
    figure = Figure(figsize=(9.2, 3.6), layout="constrained")
    lift, drag = figure.subplots(1, 2)
    x = np.arange(len(names))
    _points(lift, x, [[DEGREE*stepwise(f[n], "CL_alpha") for n in names] for f in flights])
    _points(drag, x, [[f[n].excess_drag - f["baseline"].excess_drag for n in names] for f in flights])
    lift.set_ylabel("CL_alpha (1/deg)")
    drag.set_ylabel("excess drag coefficient (1)")
    for axes in (lift, drag):
        axes.set_xticks(x, labels, rotation=20.0 if max(map(len, labels)) > 3 else 0.0)
        if max(map(len, labels)) <= 3:
            axes.set_xlabel("boot cycle")
    legend_above(figure, [lift, drag])
    return figure


def _points(axes: Axes, x: NDArray[np.intp], found: list[list[float]]) -> None:
    axes.plot(x, np.mean(found, axis=0), "-", color=ROLES["estimate"]["color"], label="mean")
    for k, values in enumerate(found):
        axes.plot(x, values, "o", markersize=4.0, color=ROLES["iced"]["color"], label="each flight" if k == 0 else None)


def trims(seed: int) -> list[Picture]:
    """Figures 21 and 22."""
    flights = fly_all("flight_010302f1", seed, SEEDS)
    return [Picture(_trims(clean_trims(seed), [w for f in flights for w in f.values()]),
                    "Figures 21 and 22: elevator to trim against drag coefficient and against angle of attack. Line, "
                    "the clean aircraft at seven speeds; dots, before the doublet sets of flight 010302f1. Positive "
                    "elevator is trailing edge down.", "Iced trim points to the right of the clean curve")]


@lru_cache(maxsize=1)
def clean_trims(seed: int) -> tuple[Window, ...]:
    """A trimmed stretch of the clean aircraft at every speed, in still air."""
    found = []
    for k, speed in enumerate(SPEEDS):
        scenario = scenarios.load("clear_air", duration=55.0, initial={"airspeed": speed}, ice_protection="off",
                                  parameters={"turbulence_sigma_w": 0.0},
                                  events=({"time": 10.0, "name": "doublets", "doublets": True},))
        found.append(fly_sets(scenario, 1000*seed + k, hinf=False)[0]["doublets"])
    return tuple(found)


@styled
def _trims(clean: Sequence[Window], iced: Sequence[Window]) -> Figure:
    figure = Figure(figsize=(9.2, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for sets, mark, role, label in ((clean, "o-", "clean", "clean"), (iced, "o", "iced", "flight 010302f1")):
        elevator = [w.trim["elevator"]/DEGREE for w in sets]
        left.plot([drag_of(w) for w in sets], elevator, mark, markersize=4.5, color=ROLES[role]["color"], label=label)
        right.plot([w.trim["alpha"]/DEGREE for w in sets], elevator, mark, markersize=4.5, color=ROLES[role]["color"])
    left.set_xlabel("drag coefficient (1)")
    left.set_ylabel("elevator (deg)")
    right.set_xlabel("angle of attack (deg)")
    legend_above(figure, [left])
    return figure


def drag_of(window: Window) -> float:
    """Drag coefficient of the steady stretch before a doublet set, from accelerometers and thrust."""
    trim, mass = window.trim, window.truth["mass"]
    force = 0.5*window.truth["density"]*trim["airspeed"]**2*float(aircraft.load()["wing_area"][0])
    axial = (mass*trim["ax"] - trim["thrust_left"] - trim["thrust_right"])/force
    return float(-axial*np.cos(trim["alpha"]) - mass*trim["az"]/force*np.sin(trim["alpha"]))
