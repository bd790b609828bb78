"""What the report says of the icing encounter: figures, flight displays, a table and the words around them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from icing_env.display import DisplayView, draw
from icing_env.types import MEASUREMENT
from testbed.demo.encounter import MINUTE, Encounter, detected_at, excess_drag, verdicts
from testbed.demo.fleet import ALL, LIMITS, Fleet
from testbed.demo.parts import COUNT, FOOT, KNOT, write_verdicts
from testbed.flight import Flight
from testbed.reports.page import Report
from testbed.reports.plot_style import ROLES, legend_above, line, styled

WORDS = """
The aircraft holds at 120 knots and 9,800 ft, in a racetrack that stays in one icing cloud: for 45 minutes, as
certification assumes of a hold. The autopilot keeps altitude, speed and heading. The air is at -6 °C, the drops are
small and the water content is in the upper half of 14 CFR 25 Appendix C, continuous maximum, so that the ice is mostly
glaze, the more harmful kind.

The same hold is flown twice, in the same gusts and, second by second, in the same water and drops. Once boots,
propeller heat and limits are off and nobody looks over the autopilot's shoulder. Once an observer estimates the drag
and the derivatives from the instruments alone; an ice management declares ice, switches on boots and propeller heat,
and moves the limits on angle of attack, speed and bank; and the autopilot and the envelope protection keep to them.
"""
HISTORY = """The hold without and with protection. As the wings collect ice the onset of separation (dashed) comes down
and the drag goes up; once the throttles are fully open, an autopilot that keeps altitude pays for the drag with speed,
and for the lost speed with angle of attack. The limits (dash-dotted) are what the ice management advises, from its
estimate; it does not see the truth. The drag that the
observer estimates follows the truth (black) as long as the air stays attached; past the onset of separation it counts
the drag of the stall as well."""
LAST = """The last two minutes of the unprotected flight, and the protected aircraft at the same time. The dashed line
is the true onset of separation on the worse wing."""
FLEET = """Every flight of the batch: one dot a seed. Left: how near it came to the stall; below zero it stalled, and a
cross is an aircraft lost. Right: altitude given up. With the limits alone nothing removes the ice: the aircraft
then keeps its speed by descending."""


def write(report: Report, e: Encounter) -> None:
    """Add the section."""
    report.section("Icing: with and without protection", WORDS)
    write_verdicts(report, verdicts(e))
    both = {"unprotected": e.unprotected, "protected": e.protected}
    report.figure(history(both), " ".join(HISTORY.split()))
    if e.unprotected.reason:
        report.figure(last_minutes(both), " ".join(LAST.split()))
    report.figure(fleet_dots(e), " ".join(FLEET.split()))
    headers = ("protection", "flights", "stalled", "lost", "least stall margin (deg)", "lowest airspeed (kt)",
               "most altitude given up (ft)", "largest wing severity")  # fmt: skip
    report.table(headers, [row(name, fleet) for name, fleet in e.fleets.items()],
                 f"The hold with seeds {e.seeds[0]} to {e.seeds[-1]}; the worst of each column's flights. Margin "
                 "and airspeed count until an aircraft is lost.")
    report.text("What the crew saw, at three moments. Everything on the display is measured or estimated on board; "
                "the true state of the ice is not known there.")
    for caption, flight, time in moments(e):
        report.image(frame(e, flight, time), caption)


def row(name: str, fleet: Fleet) -> list[str | int | float]:
    """A line of the table."""
    return [name, len(fleet.margin), int((fleet.margin < 0.0).sum()), fleet.lost,
            float(np.degrees(fleet.margin.min())), float(fleet.airspeed.min()/KNOT),
            float(fleet.descent.max()/FOOT), float(fleet.eta.max())]


def moments(e: Encounter) -> list[tuple[str, Flight, float]]:
    """Three moments worth a look: caption, flight and time, s."""
    found = detected_at(e.protected)
    end = float(e.unprotected.truth["time"][-1])
    before = max(end - 10.0, 0.0) if e.unprotected.reason else end
    first = found + 5.0 if found is not None else 0.5*end
    why = "ice has just been declared and the boots are on" if found is not None else "no ice has been declared"
    lost = "ten seconds before it is lost" if e.unprotected.reason else "the end of the hold"
    return [
        (f"With protection, {first/MINUTE:.1f} min: {why}.", e.protected, first),
        (f"With protection, {before/MINUTE:.1f} min: the limits have moved in and the boots are cycling.", e.protected,
         before),
        (f"Without protection, {before/MINUTE:.1f} min, {lost}. The ice management is off, and its panel at rest: "
         "CLEAR, no severity, no limits. The estimates below it are there, but nobody acts on them.",
         e.unprotected, before),
    ]  # fmt: skip


def frame(e: Encounter, flight: Flight, time: float) -> NDArray[np.uint8]:
    """Primary flight display of a moment of a flight, shape (540, 720, 3)."""
    k = int(np.searchsorted(flight.truth["time"], round(time) - 1.0e-6))  # whole seconds: every channel has a sample
    measurement = np.zeros(1, MEASUREMENT)
    for name in MEASUREMENT.names or ():
        if flight.record.has(name):
            measurement[name] = flight.record[name][k]
    clean, start = e.scenario.clean_parameters()[0], e.scenario.initial
    reference = (float(clean["CX_0"] - clean["CZ_alpha"]), float(clean["Cm_alpha"]))
    view = DisplayView.from_rows(measurement[0], flight.advisory[k], flight.estimate[k], reference,
                                 float(clean["alpha_stall"]), (start.airspeed, start.altitude, None))
    return draw(view, (720, 540))


def _curves(flight: Flight) -> dict[str, NDArray[np.float64]]:
    """What the figures draw of a flight, by name, in the units shown."""
    t, a, c = flight.truth, flight.advisory, flight.record.channels
    true_drag, estimate = excess_drag(flight)
    return {
        "time": t["time"]/MINUTE, "lwc": 1.0e3*t["lwc"], "eta": 0.5*(t["eta_left_wing"] + t["eta_right_wing"]),
        "drag": true_drag/COUNT, "estimate": estimate/COUNT, "alpha": np.degrees(t["true_alpha"]),
        "onset": np.degrees(np.minimum(t["alpha_stall_left"], t["alpha_stall_right"])),
        "alpha_limit": np.degrees(a["alpha_limit"]), "airspeed": t["true_airspeed"]/KNOT,
        "airspeed_limit": a["airspeed_limit"]/KNOT, "throttle": 100.0*c["throttle_left"], "boots": c["boots_wing"],
        "phi": np.degrees(c["phi"]), "altitude": c["altitude"]/FOOT,
    }  # fmt: skip


@styled
def history(flights: dict[str, Flight]) -> Figure:
    """Seven panels against time: cloud, ice, drag, angle of attack, airspeed, throttle, boots."""
    figure = Figure(figsize=(9.2, 11.6), layout="constrained")
    panels = list(figure.subplots(7, 1, sharex=True, height_ratios=(1, 1, 1.4, 1.7, 1.4, 1, 0.5)))
    curves = {name: _curves(flight) for name, flight in flights.items()}
    for name, c in curves.items():
        for axes, key in zip(panels, ("lwc", "eta", "estimate", "alpha", "airspeed", "throttle", "boots"), strict=True):
            line(axes, c["time"], c[key], label=name, **ROLES[name])
    for name, c in curves.items():
        line(panels[2], c["time"], c["drag"], label="truth", **ROLES["truth"])
        line(panels[3], c["time"], c["onset"], label=f"onset of separation, {name}",
             color=ROLES[name]["color"], linestyle=(0, (4, 2)))  # fmt: skip
        if name == "protected":
            line(panels[3], c["time"], c["alpha_limit"], label="advised limit", **ROLES["limit"])
            line(panels[4], c["time"], c["airspeed_limit"], label="advised limit", **ROLES["limit"])
    _label(panels, ("liquid water\n(g/m³)", "wing ice\nseverity η", "excess drag,\nestimated\n(counts)", "α\n(deg)",
                    "airspeed\n(kt)", "throttle\n(%)", "boots"))
    panels[3].set_ylim(0.0, 16.0)
    panels[6].set_yticks([0.0, 1.0], ["off", "on"])
    panels[6].set_ylim(-0.2, 1.2)
    panels[-1].set_xlabel("time (min)")
    figure.align_ylabels()
    legend_above(figure, panels)
    return figure


def _label(panels: Sequence[Axes], labels: Sequence[str]) -> None:
    for axes, label in zip(panels, labels, strict=True):
        axes.set_ylabel(label)
        axes.margins(x=0.0)


@styled
def last_minutes(flights: dict[str, Flight]) -> Figure:
    """Angle of attack, bank, airspeed and altitude in the last two minutes of the unprotected flight."""
    end = float(flights["unprotected"].truth["time"][-1])
    figure = Figure(figsize=(9.2, 4.6), layout="constrained")
    panels = list(figure.subplots(2, 2, sharex=True).flat)
    for name, flight in flights.items():
        c = _curves(flight)
        there = (flight.truth["time"] >= end - 120.0) & (flight.truth["time"] <= end)
        time = flight.truth["time"][there] - (end - 120.0)
        for axes, key in zip(panels, ("alpha", "airspeed", "phi", "altitude"), strict=True):
            line(axes, time, c[key][there], label=name, **ROLES[name])
        line(panels[0], time, c["onset"][there], label=f"onset of separation, {name}", color=ROLES[name]["color"],
             linestyle=(0, (4, 2)))  # fmt: skip
    _label(panels, ("α (deg)", "airspeed (kt)", "φ (deg)", "altitude (ft)"))
    for axes in panels[2:]:
        axes.set_xlabel("time (s)")
    legend_above(figure, panels)
    return figure


@styled
def fleet_dots(e: Encounter) -> Figure:
    """Stall margin and altitude given up of every flight, by way of protecting."""
    figure = Figure(figsize=(9.2, 2.9), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    spread = np.linspace(-0.28, 0.28, len(e.seeds)) if len(e.seeds) > 1 else np.zeros(1)
    for at, (name, fleet) in enumerate(e.fleets.items()):
        color = ROLES[{ALL: "protected", LIMITS: "limit"}.get(name, "unprotected")]["color"]
        lost = np.isfinite(fleet.lost_at)
        for axes, values in ((left, np.degrees(fleet.margin)), (right, fleet.descent/FOOT)):
            axes.plot(values[~lost], at + spread[~lost], "o", color=color, markersize=4.5)
            axes.plot(values[lost], at + spread[lost], "x", color=color, markersize=6.5, markeredgewidth=1.8)
    left.axvline(0.0, color=ROLES["truth"]["color"], linewidth=1.0)
    left.set_yticks(range(len(e.fleets)), list(e.fleets))
    left.set_ylim(len(e.fleets) - 0.5, -0.5)
    left.set_xlabel("least distance to the onset of separation (deg)")
    right.set_xlabel("altitude given up (ft)")
    left.plot([], [], "o", color="#5B6675", label="flew to the end")
    left.plot([], [], "x", color="#5B6675", markeredgewidth=1.8, label="lost")
    legend_above(figure, [left])
    return figure

