"""A diagnosis as files: `diagnosis.json` for machines and `report.html` for people."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from icing_env.effects.derivatives import OFFSETS
from icing_env.record import FloatArray
from sim2real.actuators.paths import driven
from sim2real.actuators.second_order import DAMPING
from sim2real.closing import gap
from sim2real.diagnosis import Diagnosis
from sim2real.prediction.gusts import KINDS
from sim2real.prediction.windows import COMPARED, cut, residuals
from sim2real.records.channels import TOLERANCE
from sim2real.where import stretches
from sim2real.words import listed, of_the_model, sentences, term_named
from testbed.commands.common import plain
from testbed.reports.diagnosis_figures import bars, heat, ladder_gaps, regime_heat, size_histories
from testbed.reports.given import taken_as_given
from testbed.reports.page import Cell, Report
from testbed.reports.plot_style import scale_of
from testbed.reports.plotting import gap_bars, time_histories
from testbed.reports.surface_answers import answer, by_surface, suspected

GUSTS = dict(zip(KINDS, ("", " (rotational, after MIL-F-8785C)", " (met by all of the aircraft at once)",
                         " (met by the tail later, rolling and yawing ones too)"), strict=True))  # fmt: skip
KIND = {"no_gap": "good", "explained": "caution", "unknown": "bad"}
OVERLAID = ("airspeed", "alpha", "q", "theta", "ax", "az", "beta", "p", "r", "phi", "ay")


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
    if told := of_the_model(found):
        report.text(told)
    _explanations(report, result)
    _where(report, found, result)
    _closing(report, found, result)
    _limits(report, result)
    _given(report, result)
    return report


def _of_what(found: Diagnosis) -> str:
    """Records, their length and the gusts they were flown in."""
    flights, held_out = found.details.flights, found.details.held_out
    seconds = sum(len(f.time) * f.dt for f in flights)
    gusts = sorted({round(e.gusts.sigma, 2) for e in found.details.evidences})
    told = f"{gusts[0]:g} m/s" if len(gusts) == 1 else f"{gusts[0]:g} to {gusts[-1]:g} m/s"
    kind = GUSTS[found.details.evidences[0].gusts.kind]
    more = f", {len(held_out)} held out" if held_out else ""
    return f"{len(flights)} record{'s' * (len(flights) != 1)} of {seconds:.0f} s in all, gusts of {told}{kind}{more}"


def _explanations(report: Report, result: Mapping[str, Any]) -> None:
    report.section("Explanations")
    shown = [h for h in result["hypotheses"] if h["probability"] >= 1e-3][:12] or result["hypotheses"][:1]
    report.figure(bars({_label(h): h["probability"] for h in reversed(shown)}, "probability"),
                  "Probability of each explanation, given these records.")
    rows: list[list[Any]] = []
    for effect in result["effects"]:
        for name, p in effect["parameters"].items():
            rows.append([effect["name"], f"{effect['probability']:.3f}", f"{name} [{p['unit']}]", p["estimate"],
                         f"{p['low95']:.4g} to {p['high95']:.4g}", listed(effect["indistinguishable_from"]) or None])
    if rows:
        report.table(["effect", "probability", "parameter", "estimate", "95 %", "cannot be told from"], rows,
                     "Effects that these records leave possible.")
    for effect in result["effects"]:
        if effect["sizes"]:
            report.figure(size_histories(effect), f"The size of {effect['name']} by stretch of every record, with its "
                          "95 % interval (shaded); dashed: one size for all records.")
    if result["unknown"]:
        _terms(report, result, result["unknown"], "What the library lacks")
        if "places" in result["unknown"]:
            report.table(["component", "changed by"], [[c, f"{v:.2f}"] for c, v in sorted(
                result["unknown"]["places"].items(), key=lambda item: -item[1])],
                "All numbers of the model fitted: RMS change of each force (tolerances of ax, ay, az) and moment (of "
                "the rate that it makes in half a second).")  # fmt: skip
    for effect in result["effects"]:
        if effect["other_form"]:
            _terms(report, result, effect["other_form"], f"What {effect['name']} is beside the library's form of it")


def _terms(report: Report, result: Mapping[str, Any], described: Mapping[str, Any], what: str) -> None:
    report.table(["term", "coefficient", "standard error"],
                 [[term_named(t["term"]), t["coefficient"], t["std_error"]] for t in described["terms"]],
                 caption_of_terms(described, what, "discrepancy:" in result["resimulate"]["command"]))


def caption_of_terms(described: Mapping[str, Any], what: str, flown: bool) -> str:
    """What a table of terms shows, and whether they are in the aircraft that the report flies.

    Args:
        described: `unknown` or `other_form` of an answer.
        what: they are.
        flown: whether any terms are.
    """
    every = "places" in described  # all numbers of the model, which fly as such
    at = "changes of the model's numbers" if every else f"terms of {described['component']}"
    servo = any(t["term"] == DAMPING for t in described["terms"])  # the simulator's actuators are of first order
    told = "" if every or (flown and not servo) else ", told and not flown"
    return f"{what}, as {at} ({described['kind']}){told}; coefficients in SI units, angles in rad, delays in s."


def _where(report: Report, found: Diagnosis, result: Mapping[str, Any]) -> None:
    report.section("Where the gap lies")
    training = found.details.training
    report.figure(gap_bars(gap.by_channel(training.before), gap.by_channel(training.after),
                           gap.by_channel(training.alone.mean(axis=0))),
                  "Free simulation of the diagnosed records in 10 s windows, before and after.")
    if result["where"]["components"]:
        report.table(["component", "probability that the gap enters there"],
                     [[c, f"{p:.3f}"] for c, p in result["where"]["components"].items()], "Where the gap enters.")
    _paths(report, found, result)
    report.figure(heat(training, [len(cut(f).first) for f in found.details.flights]),
                  "Residual by channel and window, in tolerances, before the diagnosis.")
    if flown := stretches(found.details.evidences):
        report.figure(regime_heat(flown),
                      "One-step predictions by channel and flight regime (quarters of each variable, low to high): "
                      "root mean square error over what noise and gusts make. Dots: beyond chance (false discoveries "
                      "5 %).")
    if result["where"]["regimes"]:
        report.table(["variable", "from", "to", "unit", "excess", "channels"],
                     [regime_row(r) for r in result["where"]["regimes"][:10]],
                     "Regimes in which one-step predictions err by more than noise and gusts (mean square less one).")


def regime_row(regime: Mapping[str, Any]) -> list[Cell]:
    """A stretch of flight that stands out: its variable, edges as charts show them, excess, and channels."""
    shown = scale_of(regime["variable"])
    # a surface that nobody moved is some 1e-19 rad off
    low, high = (round(regime[edge] * shown.factor + shown.offset, 6) + 0.0 for edge in ("low", "high"))
    return [shown.label, low, high, shown.unit or "-", regime["excess"], ", ".join(regime["channels"]) or "-"]


def _paths(report: Report, found: Diagnosis, result: Mapping[str, Any]) -> None:
    """Surfaces behind their commands, which no flight residual shows: it starts from the surfaces as recorded."""
    if rows := by_surface(found, result):
        report.table(["path", "before (deg)", "after (deg)"], rows,
                     "Surfaces behind their commands: RMS of recorded less predicted position.")
    for surface in suspected(result):
        if (figure := answer(found, result, surface)) is not None:
            report.figure(figure, f"The {surface} as its command moves it, where that moves most: as recorded, behind "
                          "the model's actuator, and behind the one diagnosed.")


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
    if model := result["resimulate"]["model"]:
        report.table(["number", "changed by", "standard error"], own_numbers(model),
                     "The model's own numbers as they settled beside the explanation, flown with it: change of each, "
                     "what the records say most of first. Where a standard error is as large as the number was thought "
                     "to be uncertain (a derivative: 5 %, mass: 1 %) they say nothing of it.")


def own_numbers(model: Mapping[str, Mapping[str, float]]) -> list[list[Any]]:
    """Name, change and standard error of each: parts of the number, of offsets in their channel's unit."""
    rows = []
    for name, own in sorted(model.items(), key=lambda item: -abs(item[1]["change"]) / max(item[1]["std_error"], 1e-12)):
        change, error = own["change"], own["std_error"]
        unit = OFFSETS.get(name, "%").removeprefix("1")
        share, digits = (100.0, ".1f") if unit == "%" else (1.0, ".2g")
        rows.append([name, *(f"{share * value:{sign}{digits}} {unit}".rstrip()
                             for value, sign in ((change, "+"), (error, "")))])  # fmt: skip
    return rows


def _ladder(report: Report, ladder: Mapping[str, Any]) -> None:
    report.figure(ladder_gaps(ladder),
                  "The evidence ladder: the gap left on the held-out records by the model as it is, by the model's own "
                  "numbers refined without any effect, by the best explanation that shares nothing with the diagnosed "
                  "one, by the diagnosed effects alone and with the numbers beside them, and by a regression that "
                  "knows no physics. Whiskers: 95 % intervals over windows. Dashed: what noise and gusts alone "
                  "stay below 95 times in 100.")
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


def _given(report: Report, result: Mapping[str, Any]) -> None:
    if not (given := taken_as_given(result["provenance"])):
        return
    report.section("What was taken as given",
                   "What the records and their side files do not tell, and what was found of the instruments first. Of "
                   "records that differ in the numbers alone, the first one's; a side file can say otherwise.")
    report.table(["of the records", "in how many"], [[note, count] for note, count in given], "Taken as given.")


def _label(hypothesis: Mapping[str, Any]) -> str:
    if hypothesis["effects"]:
        return " + ".join([*hypothesis["effects"], *["something unknown"] * hypothesis["unknown"]])
    return "nothing in the library" if hypothesis["unknown"] else "no gap"


def _tolerances() -> FloatArray:
    return np.array([TOLERANCE[c] for c in COMPARED])
