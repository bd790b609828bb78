"""Figure 19: excess drag goes with the severity eta, the derivatives do not.

The paper's eta is that of its figure 4: of the main wing, from the cloud met, and set back to zero at every activation
of the boots. It plots the drag of many flights, in the turbulence that goes with icing; its flights were mostly
doublets during accretion, then de-icing (Table 1). Flown here: encounters of half an hour in clouds drawn from the
printed ranges, a doublet set every seven minutes, all boots at the end and one set more; and flight 010302f1.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from icing_env import scenario as scenarios
from icing_env.errors import InputError
from icing_env.scenario import Scenario
from testbed.reports.plot_style import ROLES, legend_above, styled
from testbed.reproduce.analyses import ANALYSES, PAPER
from testbed.reproduce.cases import DEGREE, NAMES
from testbed.reproduce.flight import PRINTED, SEEDS, Flights, fly_all
from testbed.reproduce.pictures import Picture
from testbed.reproduce.row import Row, Rule, row
from testbed.reproduce.windows import Window, fly_sets

ITEM = "fig19"
PAPER_VALUE = 0.8
ENCOUNTERS = 8
MODERATE = 3.1  # m/s, sigma_w: MIL-F-8785C figure 7 at 7500 ft, exceedance 1e-3
CONTENT, DROPS = (1e-4, 4e-4), (10e-6, 20e-6)  # kg/m3, m: ranges printed of flight 010302f1
FREEZING = 268.15  # K, printed
ENTRY, SETS, OUT, BOOTS, LAST = 75.0, (495.0, 915.0, 1335.0, 1755.0), 1800.0, 1830.0, 1850.0  # s
RESET = ("after_deicing", "wing_deiced", "tail_deiced", "vtail_struts_deiced", "final_deicing")
Point = tuple[float, float, Window]  # eta, excess drag, doublet set


def rows(seed: int) -> list[Row]:
    """Correlations of drag and of the derivatives with eta: over the encounters, then flight 010302f1's own."""
    growing, all_sets = encounters(seed)
    note = (f"{len(growing)} doublet sets of {ENCOUNTERS} encounters, clouds from the printed ranges, "
            f"sigma_w {MODERATE:g} m/s; observer in flight against the wing's severity")
    found = [row(ITEM, "correlation of excess drag with eta, during accretion", PAPER_VALUE, _drag(growing), "1",
                 Rule(at_least=True), note),
             row(ITEM, "correlation of excess drag with eta, sets after de-icing included", PAPER_VALUE,
                 _drag(all_sets), "1", Rule(at_least=True), f"{note}; eta set back by the boots, as the paper has it",
                 miss="the boots set eta back and leave the drag of unprotected parts")]
    for name in NAMES:
        for how, text in ((PAPER, "the paper's own analysis"), ("matched", "filters that match, alpha as measured")):
            found.append(_derivative(name, growing, how, text, f"encounters, sigma_w {MODERATE:g} m/s"))
    return [*found, *_founding(seed)]


def _drag(points: list[Point]) -> float:
    return correlation([p[0] for p in points], [p[1] for p in points])


def correlation(x: list[float], y: list[float]) -> float:
    """Correlation of two equally long lists."""
    return float(np.corrcoef(x, y)[0, 1])


def analysed(window: Window, name: str, how: str) -> float | None:
    """A derivative by one analysis; None where its correction leaves nothing that could be an angle of attack."""
    try:
        return ANALYSES[how](window)[name].estimate
    except InputError:
        return None


def _derivative(name: str, points: list[Point], how: str, text: str, sets: str) -> Row:
    """One derivative by one analysis; the statement is the paper's analysis', the other is shown beside it."""
    told = [(eta, value) for eta, _, window in points if (value := analysed(window, name, how)) is not None]
    size = abs(correlation(*map(list, zip(*told, strict=True))))
    agrees = size < PAPER_VALUE
    lost = len(points) - len(told)
    why = f"{len(told)} doublet sets, {sets}" + (f"; {lost} refused: no angle of attack once corrected" if lost else "")
    return Row(ITEM, f"size of the correlation of {name} with eta, {sets} ({text})", "simulated",
               "not well correlated", size, "1", None, agrees, f"below {PAPER_VALUE}", why if agrees else
               f"{why}; ice moves it by more than gusts do here")


def encounters(seed: int) -> tuple[list[Point], list[Point]]:
    """Points during accretion, the clean set included, and the same with those after de-icing."""
    growing, every = [], []
    for flight in _fly(seed):
        clean = flight["baseline"].excess_drag
        for name, window in flight.items():
            eta = 0.0 if name == "deiced" else wing(window)
            every.append((eta, window.excess_drag - clean, window))
            if name != "deiced":
                growing.append(every[-1])
    return growing, every


def wing(window: Window) -> float:
    """True severity of the wing, mean of both sides."""
    return 0.5*(window.truth["eta_left_wing"] + window.truth["eta_right_wing"])


@lru_cache(maxsize=2)
def _fly(seed: int) -> Flights:
    rng = np.random.default_rng([seed, 19])
    return [fly_sets(encounter(float(rng.uniform(*CONTENT)), float(rng.uniform(*DROPS))), 1000*seed + k)[0]
            for k in range(ENCOUNTERS)]


def encounter(content: float, drops: float) -> Scenario:
    """Half an hour in one cloud: liquid water (kg/m3), drop size (m)."""
    clear = {"lwc": 0.0, "mvd": 0.0, "temperature": FREEZING}
    events: list[dict[str, Any]] = [{"time": 0.0, "prop_heat": True},
                                    {"time": 20.0, "name": "baseline", "doublets": True}]
    events += [{"time": time, "name": f"minute_{time - ENTRY:.0f}", "doublets": True} for time in SETS]
    events += [{"time": BOOTS, "boots": ("wing", "tail", "vtail_struts")},
               {"time": LAST, "name": "deiced", "doublets": True}]
    return scenarios.load(
        "clear_air", duration=LAST + 50.0, doublet_scale=0.78, ice_protection="schedule", task={"kind": "hold"},
        initial={"airspeed": 68.0, "altitude": 2200.0}, parameters={"turbulence_sigma_w": MODERATE},
        cloud=({"time": 0.0, **clear}, {"time": ENTRY, "lwc": content, "mvd": drops, "temperature": FREEZING},
               {"time": OUT, **clear}), events=tuple(events))


def _founding(seed: int) -> list[Row]:
    """Flight 010302f1 alone: with ice that stays, with the paper's eta, and the paper's own printed drag."""
    flights = fly_all("flight_010302f1", seed, SEEDS)
    ideal = fly_all("flight_010302f1_perfect_deicing", seed, 1)[0]
    true = [(wing(w), w.excess_drag - f["baseline"].excess_drag) for f in flights for w in f.values()]
    paper = [(0.0 if name in RESET else wing(ideal[name]), w.excess_drag - f["baseline"].excess_drag)
             for f in flights for name, w in f.items()]
    printed = [(0.0, 0.0)] + [(0.0 if p.event in RESET else wing(ideal[p.event]), p.value) for p in PRINTED
                              if p.quantity == "delta_CD0"]
    light = [(wing(w), 0.0, w) for f in flights for w in f.values()]
    derivatives = [_derivative(name, light, PAPER, "the paper's own analysis", "flight 010302f1, sigma_w 0.5 m/s")
                   for name in NAMES]
    own = correlation(*map(list, zip(*printed, strict=True)))
    text = (f"the paper's own printed drag of this flight, with its own eta, correlates by {own:.2f} only: after "
            "de-icing eta is 0 and 0.02 of drag are left; its figure 19 must rest on other flights")
    what = "correlation of excess drag with eta, flight 010302f1 alone"
    note = f"{len(true)} doublet sets, light turbulence"
    return [*derivatives,
            row(ITEM, f"{what}, wing's true severity", PAPER_VALUE, correlation(*map(list, zip(*true, strict=True))),
                "1", Rule(at_least=True), note, miss=text),
            row(ITEM, f"{what}, eta set back at each de-icing", PAPER_VALUE,
                correlation(*map(list, zip(*paper, strict=True))), "1", Rule(at_least=True), note, miss=text)]


def pictures(seed: int) -> list[Picture]:
    """Figure 19's analogue, and CL_alpha beside it."""
    return [Picture(draw(*encounters(seed)), "Figure 19: excess drag, and CL_alpha by the paper's own analysis, "
                    "against the severity eta of the wing, in moderate turbulence. After de-icing eta is zero by "
                    "definition, while the drag of unprotected parts stays.",
                    "Drag rises with severity along a line; the lift slope scatters")]


@styled
def draw(growing: list[Point], every: list[Point]) -> Figure:
    """Drag and CL_alpha over eta."""
    figure = Figure(figsize=(9.2, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot([p[0] for p in growing], [p[1] for p in growing], "o", color=ROLES["iced"]["color"], markersize=4.5,
              label="during accretion")
    after = [p for p in every if p[2].name == "deiced"]
    left.plot([p[0] for p in after], [p[1] for p in after], "s", color=ROLES["protected"]["color"], markersize=4.5,
              label="after de-icing")
    for how, mark, role, label in ((PAPER, "x", "unprotected", "CL_alpha, the paper's analysis"),
                                   ("matched", "+", "estimate", "CL_alpha, alpha as measured")):
        lift = [(p[0], value*DEGREE) for p in growing if (value := analysed(p[2], "CL_alpha", how)) is not None]
        right.plot(*zip(*lift, strict=True), mark, color=ROLES[role]["color"], markersize=5.0, label=label)
    left.set_ylabel("excess drag coefficient (1)")
    right.set_ylabel("CL_alpha (1/deg)")
    for axes in (left, right):
        axes.set_xlabel("eta of the wing (1)")
    legend_above(figure, [left, right])
    return figure
