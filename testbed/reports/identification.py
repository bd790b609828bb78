"""The report of `icing identify --out`: what was found in each record, how well it fits, and what rivals say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from estimators.compatibility.record import Compatibility
from estimators.estimate import Estimate
from estimators.methods import METHODS, method
from estimators.observability import observability
from estimators.observer.layout import PARAMETER_NAMES
from estimators.observer.record import History, histories
from estimators.regression import equation_error
from icing_env.errors import InputError
from icing_env.record import FlightRecord
from testbed.reports.flown_again import FlownAgain, fly_again
from testbed.reports.identification_figures import fit_histories, methods_compared, residual_correlations
from testbed.reports.page import Cell, Report
from testbed.reports.plotting import estimate_history

DEGREE = np.pi/180.0
AXES = {"longitudinal": ("CL_alpha", "CL_elevator", "CZ_alpha", "CZ_q", "CZ_elevator", "Cm_alpha", "Cm_q",
                         "Cm_elevator"),
        "lateral": ("CY_beta", "CY_p", "CY_r", "CY_rudder", "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder",
                    "Cn_beta", "Cn_p", "Cn_r", "Cn_aileron", "Cn_rudder")}  # fmt: skip
CONTROLS = {"longitudinal": ("elevator",), "lateral": ("aileron", "rudder")}
OPENING = """
Derivatives are in the record's own body axes, per rad and per degree. A derivative that the record does not show is
refused with the reason. Standard errors are corrected for coloured residuals; intervals are 95 %.
"""
FIT = """
The record is flown again from its controls with the derivatives that were found. Only the datum is fitted besides:
first state, constant coefficients, constant errors of instruments. What a channel still holds beyond that is the
residual; where its autocorrelation leaves the band, the residual is coloured, and a standard error that took it for
white noise would be too small.
"""
STEPWISE = """
Modified stepwise regression, coefficient by coefficient: what was forced into the model, what entered, what left or was
refused, with partial F, R² and predicted square error.
"""
COURSES = """
How the recursive methods come to their estimates, sample by sample, as they would have on board; the band is what the
method itself believes. Nothing moves until a surface does.
"""


@dataclass(frozen=True)
class Identified:
    """One record, what the asked-for method found in it, and its calibration where one was asked for."""

    path: Path
    record: FlightRecord
    estimates: Mapping[str, Estimate]
    compatibility: Compatibility | None = None

    @property
    def axes(self) -> list[str]:
        """Axes with at least one derivative that the record shows."""
        return [axis for axis, names in AXES.items() if any(n in self.estimates and self.estimates[n].identifiable
                                                            for n in names)]


def write(found: Sequence[Identified], how: str, command: Mapping[str, str], folder: Path) -> Path:
    """Write `identify.html` into `folder`, whole or not at all; returns its path.

    Args:
        found: records with their estimates.
        how: the method that was asked for.
        command: what made the report, for its foot.
        folder: made if absent.
    """
    names = ", ".join(i.path.name for i in found)
    report = Report("Derivatives from flight records", f"{names}, by {how}.", command)
    for one in found:
        _record(report, one, how)
    return report.write(folder/"identify.html")


def _record(report: Report, one: Identified, how: str) -> None:
    shown = {n: e for n, e in one.estimates.items() if e.identifiable}
    axes = " and ".join(one.axes) or "no"
    report.section(one.path.name, OPENING)
    refused = len(one.estimates) - len(shown)
    report.verdict(f"{one.path.name}: {len(shown)} parameters identified ({axes} axis), {refused} refused; "
                   f"{len(one.record.problems)} data problems.",
                   "good" if shown and not one.record.problems else "caution" if shown else "bad")
    for warning in dict.fromkeys(e.warning for e in shown.values() if e.warning):
        report.verdict(warning, "caution")
    _data(report, one)
    means = ", ".join(dict.fromkeys(e.method for e in shown.values()))
    report.table(("derivative", "1/rad", "std error", "95 % from", "95 % to", "1/deg", "R²"),
                 [_line(n, e) for n, e in shown.items() if e.unit == "1/rad"],
                 f"Derivatives in {one.path.name} by {means}. By hat rates there is no value per degree.")
    report.table(("parameter", "estimate", "std error", "unit", "R²"),
                 [(n, e.estimate, e.std_error, e.unit, e.r2) for n, e in shown.items() if e.unit != "1/rad"],
                 "Parameters that are no derivatives: biases, polar, errors of instruments.")
    _observability(report, one)
    _fit(report, one)
    _rivals(report, one, how)
    _courses(report, one)
    _history(report, one)


def _line(name: str, e: Estimate) -> tuple[Cell, ...]:
    half = 1.96*e.std_error
    rate = name.split("_")[-1] in ("p", "q", "r")  # by hat rate: a degree has no meaning there
    return (name, e.estimate, e.std_error, e.estimate - half, e.estimate + half, None if rate else e.estimate*DEGREE,
            e.r2)


def _data(report: Report, one: Identified) -> None:
    rows = [(p.channel, p.kind, p.start, p.end, "mended" if p.repaired else "left") for p in one.record.problems]
    if rows:
        report.table(("channel", "problem", "from (s)", "to (s)", "what was done"), rows,
                     "Data problems and repairs.")
    else:
        report.text("No data problem was found.")
    if one.compatibility is not None:
        report.table(("error of an instrument", "estimate", "std error", "unit", "why not"),
                     [(n, e.estimate if e.identifiable else None, e.std_error if e.identifiable else None, e.unit,
                       e.why or "–") for n, e in one.compatibility.parameters.items()],
                     "Data compatibility: biases and scale factors taken out of the record before identification.")
        for note in one.compatibility.notes:
            report.text(f"{note[:1].upper()}{note[1:]}.")


def _observability(report: Report, one: Identified) -> None:
    """What the record says of each derivative, and the refusals in plain words."""
    wanted = {n: e for n, e in one.estimates.items() if any(n in names for names in AXES.values())}
    told = observability(one.record, wanted)
    flown = [n for axis in one.axes for n in AXES[axis] if n in told]
    report.table(("derivative", "error (%)", "goes with", "correlation", "control (deg rms)", "motion (rms)"),
                 [(n, None if o.relative_error is None else 100.0*o.relative_error, o.correlated_with or "–",
                   o.correlation, o.control_rms/DEGREE, o.motion_rms) for n in flown for o in (told[n],)],
                 "How well the record shows each derivative: its error, the derivative that it goes with most closely, "
                 "how far the surface that drives it moved, and its regressor (rad, or hat rate).")
    refused: dict[str, list[str]] = {}
    for name in told:
        if not one.estimates[name].identifiable:
            refused.setdefault(one.estimates[name].why, []).append(name)
    for why, names in refused.items():
        report.text(f"{', '.join(names)} cannot be had from this record: {why}.")


def _fit(report: Report, one: Identified) -> None:
    """The flight flown again, and what is left of it."""
    try:
        flights = [f for f in fly_again(one.record, one.estimates) if f.axis in one.axes]
    except InputError as error:
        report.verdict(f"{one.path.name} could not be flown again: {error}", "caution")
        return
    if flights:
        report.section(f"{one.path.name}: flown again", FIT)
    for flown in flights:
        report.figure(fit_histories(flown, _controls(one.record, flown)),
                      f"{one.path.name}, {flown.axis}: measured, and flown again with the derivatives found.")
        report.figure(residual_correlations(flown), f"{one.path.name}, {flown.axis}: autocorrelation of the residuals.")


def _controls(record: FlightRecord, flown: FlownAgain) -> dict[str, Any]:
    names = [n for n in CONTROLS[flown.axis] if record.has(n)]
    return {n: np.interp(flown.time, record.time[np.isfinite(record[n])], record[n][np.isfinite(record[n])])
            for n in names}


def _rivals(report: Report, one: Identified, how: str) -> None:
    """Every registered method side by side."""
    found, failed = {}, {}
    for name in METHODS:
        try:
            found[name] = one.estimates if name == how else method(name)(one.record)
        except InputError as error:
            failed[name] = str(error)
    if one.axes:
        report.section(f"{one.path.name}: rival methods")
    for axis in one.axes:
        names = [n for n in AXES[axis] if any(n in e and e[n].identifiable for e in found.values())]
        series = {m: {n: (e[n].estimate, e[n].std_error) for n in names if n in e and e[n].identifiable}
                  for m, e in found.items()}  # fmt: skip
        report.figure(methods_compared(series, names, how),
                      f"{one.path.name}, {axis}: every method with its 95 % interval; dashed, {how}. A method that "
                      "refuses a derivative has no mark.")
        report.table(("derivative", *found), [(n, *(_cell(e.get(n)) for e in found.values())) for n in names],
                     "The same in numbers, per rad, standard errors in brackets.")
    for name, why in failed.items():
        report.text(f"{name} refused the record: {why}")


def _cell(e: Estimate | None) -> str:
    if e is None:
        return "–"
    return f"{e.estimate:.4g} ({e.std_error:.2g})".replace("-", "−") if e.identifiable else "refused"


def _courses(report: Report, one: Identified) -> None:
    """Estimates with intervals over time, by every recursive method."""
    if one.axes:
        report.section(f"{one.path.name}: estimates over time", COURSES)
    for name in METHODS:
        module = import_module(METHODS[name])
        recursive = getattr(module, "METHOD", None)
        if recursive is None or not hasattr(recursive, "step"):
            continue
        run = histories(recursive, one.record, (1.0,))[0]
        names = [n for axis in one.axes for n in AXES[axis] if n in PARAMETER_NAMES]
        if names:
            report.figure(_course(run, names), f"{one.path.name}: estimates over time by {name}, per rad.")


def _course(run: History, names: Sequence[str]) -> Any:
    pairs = {n: run.parameter(n) for n in names}
    return estimate_history(run.time - run.time[0], {n: p[0] for n, p in pairs.items()},
                            {n: p[1] for n, p in pairs.items()}, columns=3 if len(names) > 4 else 2)


def _history(report: Report, one: Identified) -> None:
    """What entered and left the stepwise models."""
    told = equation_error.histories(one.record)
    if told:
        report.section(f"{one.path.name}: stepwise history", STEPWISE)
    for coefficient, steps in told.items():
        report.code(f"{coefficient}\n{steps.table()}")
