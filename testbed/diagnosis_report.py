"""A diagnosis as files: `diagnosis.json` for machines and `report.html` for people."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from icing_env.record import FloatArray
from sim2real import gap
from sim2real.channels import MEASURED, TOLERANCE
from sim2real.diagnosis import Diagnosis
from sim2real.paths import driven
from sim2real.where import Stretch, stretches
from sim2real.windows import COMPARED, cut, residuals
from sim2real.words import sentences
from testbed.commands.common import plain
from testbed.plot_style import ROLES, scale_of, styled
from testbed.plotting import gap_bars, time_histories
from testbed.report import Report

KIND = {"no_gap": "good", "explained": "caution", "unknown": "bad"}
OVERLAID = ("airspeed", "alpha", "q", "theta", "ax", "az", "beta", "p", "r", "phi", "ay")
FEW = 3  # effects named of those that one cannot be told from


def write_report(found: Diagnosis, result: Mapping[str, Any], folder: Path) -> Path:
    """Write both files into `folder` (made as needed); returns the report's path."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(plain(result), indent=2, allow_nan=False, ensure_ascii=False)
    (folder / "diagnosis.json").write_text(text + "\n", encoding="utf-8")
    return build(found, result).write(folder / "report.html")


def build(found: Diagnosis, result: Mapping[str, Any]) -> Report:
    """The report: verdict, evidence, where, how far the gap closes, what could have been seen."""
    report = Report("Diagnosis of a sim-to-real gap", _of_what(found),
                    {"sources": str(found.provenance["sources"]), "seed": str(found.provenance["seed"])})
    report.section("Verdict")
    report.verdict(sentences(found)[0], KIND[found.verdict])
    for sentence in sentences(found)[1:]:
        report.text(sentence)
    _explanations(report, result)
    _where(report, found, result)
    _closing(report, found, result)
    _limits(report, result)
    return report


def _of_what(found: Diagnosis) -> str:
    """Records, their length and the gusts they were flown in."""
    flights, held_out = found.details.flights, found.details.held_out
    seconds = sum(len(f.time) * f.dt for f in flights)
    gusts = sorted({round(e.sigma_w, 2) for e in found.details.evidences})
    told = f"{gusts[0]:g} m/s" if len(gusts) == 1 else f"{gusts[0]:g} to {gusts[-1]:g} m/s"
    more = f", {len(held_out)} held out" if held_out else ""
    return f"{len(flights)} record{'s' * (len(flights) != 1)} of {seconds:.0f} s in all, gusts of {told}{more}"


def _explanations(report: Report, result: Mapping[str, Any]) -> None:
    report.section("Explanations")
    shown = [h for h in result["hypotheses"] if h["probability"] >= 1e-3][:12] or result["hypotheses"][:1]
    report.figure(_bars({_label(h): h["probability"] for h in reversed(shown)}, "probability"),
                  "Probability of each explanation, given these records.")
    rows: list[list[Any]] = []
    for effect in result["effects"]:
        for name, p in effect["parameters"].items():
            rows.append([effect["name"], f"{effect['probability']:.3f}", f"{name} [{p['unit']}]", p["estimate"],
                         f"{p['low95']:.4g} to {p['high95']:.4g}", _listed(effect["indistinguishable_from"])])
    if rows:
        report.table(["effect", "probability", "parameter", "estimate", "95 %", "cannot be told from"], rows,
                     "Effects that these records leave possible.")
    if result["unknown"]:
        _terms(report, result["unknown"], "What the library lacks")
    for effect in result["effects"]:
        if effect["other_form"]:
            _terms(report, effect["other_form"], f"What {effect['name']} is beside the library's form of it")


def _terms(report: Report, described: Mapping[str, Any], what: str) -> None:
    report.table(["term", "coefficient", "standard error"],
                 [[t["term"], t["coefficient"], t["std_error"]] for t in described["terms"]],
                 f"{what}, as terms of {described['component']} ({described['kind']}).")


def _listed(names: list[str]) -> str | None:
    """A few names, and how many more: an effect too small to be seen is like every other."""
    more = len(names) - FEW
    return ", ".join(names[:FEW]) + (f" and {more} more" if more > 0 else "") or None


def _where(report: Report, found: Diagnosis, result: Mapping[str, Any]) -> None:
    report.section("Where the gap lies")
    training = found.details.training
    report.figure(gap_bars(gap.by_channel(training.before), gap.by_channel(training.after),
                           gap.by_channel(training.alone.mean(axis=0))),
                  "Free simulation of the diagnosed records in 10 s windows, before and after.")
    if result["where"]["components"]:
        report.table(["component", "probability that the gap enters there"],
                     [[c, f"{p:.3f}"] for c, p in result["where"]["components"].items()], "Where the gap enters.")
    report.figure(_heat(training, [len(cut(f).first) for f in found.details.flights]),
                  "Residual by channel and window, in tolerances, before the diagnosis.")
    if flown := stretches(found.details.evidences):
        report.figure(_regime_heat(flown),
                      "One-step predictions by channel and flight regime (quarters of each variable, low to high): "
                      "root mean square error over what noise and gusts make. Dots: beyond chance (false discoveries "
                      "5 %).")
    if result["where"]["regimes"]:
        report.table(["variable", "from", "to", "excess", "channels"],
                     [[scale_of(r["variable"]).label, r["low"], r["high"], r["excess"], ", ".join(r["channels"]) or "-"]
                      for r in result["where"]["regimes"][:10]],
                     "Regimes in which one-step predictions err by more than noise and gusts (mean square less one).")


def _closing(report: Report, found: Diagnosis, result: Mapping[str, Any]) -> None:
    report.section("How far the gap closes")
    flights = found.details.held_out or found.details.flights
    what = "held-out" if found.details.held_out else "diagnosed"
    if found.details.tested is not None:
        report.figure(gap_bars(gap.by_channel(found.details.tested.before), gap.by_channel(found.details.tested.after),
                               gap.by_channel(found.details.tested.alone.mean(axis=0))), "The held-out records.")
    if "ladder" in result["gap"]:
        _ladder(report, result["gap"]["ladder"])
    flight = flights[0]
    windows = cut(flight)
    series = {"record": {"time": flight.time, **{c: flight.channel(c) for c in COMPARED if flight.has(c)}}}
    index = (windows.first[:, None] + 1 + np.arange(windows.length)).ravel()
    change = found.details.change
    for label, parameters in (("before", flight.parameters), ("after", change(flight.parameters))):
        left = residuals(driven(flight, parameters, change.paths), parameters, windows)[0] * _tolerances()
        flown = flight.measured[index, : len(COMPARED)] - left.reshape(-1, len(COMPARED))
        series[label] = {"time": flight.time[index],
                         **{c: flown[:, j] for j, c in enumerate(COMPARED) if flight.has(c) and c in OVERLAID}}
    channels = [c for c in OVERLAID if flight.has(c)]
    report.figure(time_histories(series, channels, {"record": "truth", "before": "iced", "after": "protected"}),
                  f"The first {what} record and its free simulation, restarted every 10 s.")


def _ladder(report: Report, ladder: Mapping[str, Any]) -> None:
    report.figure(_rungs(ladder), "The evidence ladder: the gap left on the held-out records by the model as it is, "
                  "by the best explanation that shares nothing with the diagnosed one, by the diagnosed one, and by a "
                  "regression that knows no physics. Whiskers: 95 % intervals over windows. Dashed: what noise and "
                  "gusts alone stay below 95 times in 100.")
    none = ladder["no_gap"]
    report.text(f"On synthetic records without a gap the same search picks {', '.join(none['effects'])} as its best "
                f"explanation (probability of no gap {none['probability_no_gap']:.2f}) and closes "
                f"{100.0 * none['closure']:.1f} % of the residual there, noise and gusts included.")


def _limits(report: Report, result: Mapping[str, Any]) -> None:
    report.section("What these records could have shown",
                   "The smallest size of each effect that would have stood 3.5 noise units away from no gap.")
    limits = [[n, d["parameter"], d["smallest"], d["unit"]] for n, d in result["detection_limits"].items()]
    report.table(["effect", "parameter", "smallest", "unit"], limits, "Detection limits.")
    if result["not_testable"]:
        report.table(["effect", "why"], [[n["effect"], n["why"]] for n in result["not_testable"]], "Not testable.")


def _label(hypothesis: Mapping[str, Any]) -> str:
    if hypothesis["effects"]:
        return " + ".join([*hypothesis["effects"], *["something unknown"] * hypothesis["unknown"]])
    return "nothing in the library" if hypothesis["unknown"] else "no gap"


def _tolerances() -> FloatArray:
    return np.array([TOLERANCE[c] for c in COMPARED])


@styled
def _bars(values: Mapping[str, float], label: str) -> Figure:
    figure = Figure(figsize=(9.2, 0.9 + 0.32 * len(values)), layout="constrained")
    axes = figure.subplots()
    axes.barh(list(values), list(values.values()), 0.6, color=ROLES["estimate"]["color"])
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel(label)
    axes.grid(False, axis="y")
    return figure


@styled
def _rungs(ladder: Mapping[str, Any]) -> Figure:
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
    names = {"nothing": "nothing: the model", "black box": "black box: no physics"}
    axes.set_yticks(range(len(rungs)), [names.get(r["name"], f"{r['name']}: {', '.join(r['effects'])}") for r in rungs])
    axes.set_xlim(0.0, 1.18 * max(r["gap"] for r in rungs))
    axes.set_xlabel("gap on the held-out records (tolerances)")
    axes.grid(False, axis="y")
    return figure


@styled
def _heat(energy: gap.Energy, windows: Sequence[int]) -> Figure:
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


def _regime_heat(found: list[Stretch]) -> Figure:
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
