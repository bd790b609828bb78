"""What the report says of the identified records: derivatives side by side, and how the observer comes to them."""

from __future__ import annotations

from matplotlib.figure import Figure

from estimators.estimate import Estimate
from testbed.demo.identify import CLOSE, STARTS, Identified, verdicts
from testbed.demo.parts import write_verdicts
from testbed.reports.page import Cell, Report
from testbed.reports.plot_style import ROLES, legend_above, line, styled
from testbed.reports.plotting import derivative_dots

REAL = """
NASA flew this aircraft, instrumented, in February 2002. Two of its records stand in the textbook of Klein and Morelli
with the derivatives found there. Here they are identified again, in three ways. Least squares on the columns that the
record's owner stored should give the printed values: it shows that the data are read as they were meant. Least squares
on the raw channels with matched filters is our own answer. The H-infinity observer runs once through the record, as it
would on board, and starts far off: at 0.4 and at 1.6 of the published model.

Where the records and the published model differ, an icing detector that trusts the model would see ice that is not
there, or miss some that is.
"""
SIMULATED = """
NASA's flight records were not found, so that a simulated record stands in: two doublet sets in clear air. Least squares
and the H-infinity observer identify it; the H-infinity observer starts far off, at 0.4 and at 1.6 of the published
model. The truth is known here, and stands where the textbook's values would.
"""
PANELS = {"longitudinal": ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_elevator"),
          "lateral": ("Cl_beta", "Cl_p", "Cn_beta", "Cn_r")}  # fmt: skip


def write(report: Report, found: list[Identified]) -> None:
    """Add the section."""
    real = any(i.stored is not None for i in found)
    report.section("Real flight records" if real else "A simulated record", REAL if real else SIMULATED)
    write_verdicts(report, verdicts(found))
    for i in found:
        report.figure(dots(i), f"{i.title}: derivatives as a share of the published model, with 95 % intervals. "
                      f"Where the two starts of H-infinity lie on one another, the record decides and not the start.")
        report.figure(courses(i), f"{i.title}: how the observer, started at {STARTS[0]:g} and at {STARTS[1]:g} of the "
                      "published model, comes to its values. Nothing moves until the controls do.")
        report.table(headers(i), rows(i), f"{i.title}, per rad, standard errors in brackets. A derivative that the "
                     "record does not show is refused."
                     + (" H-infinity gives lift, CL, the textbook CZ." if "CL_alpha" in i.names else ""))
    close = f"Two methods agree where they differ by less than {100*CLOSE:.0f} % or by less than two standard errors."
    report.text(close)


def shown(i: Identified) -> tuple[str, ...]:
    """Rows of the table: what the methods estimate, then what only the textbook gives."""
    return (*i.names, *(n for n in i.reference if n not in i.names))


def headers(i: Identified) -> tuple[str, ...]:
    """Heads of the columns."""
    stored = ("stored columns",) if i.stored is not None else ()
    return ("derivative", "published model", i.reference_name, *stored, "matched filters",
            *(f"H-infinity from {start:g}" for start in STARTS))


def rows(i: Identified) -> list[list[Cell]]:
    """Lines of the table."""
    def cell(estimates: object, name: str) -> str:
        e = estimates.get(name) if isinstance(estimates, dict) else None
        return _worded(e) if isinstance(e, Estimate) else "–"

    tables = ([i.stored] if i.stored is not None else []) + [i.matched, *i.hinf.values()]
    return [[name, i.published.get(name), i.reference.get(name, "–").replace("-", "−"),
             *(cell(table, name) for table in tables)] for name in shown(i)]


def _worded(e: Estimate) -> str:
    if not e.identifiable:
        return "refused"
    return f"{e.estimate:.4g} ({e.std_error:.2g})".replace("-", "−")


def dots(i: Identified) -> Figure:
    """Shares of the published model."""
    names = [n for n in shown(i) if i.published.get(n) and n in i.matched and i.matched[n].identifiable]
    series = {i.reference_name: {n: (float(v), 0.0) for n, v in i.reference.items() if n in names},
              "matched filters": _told(i.matched, names),
              **{f"H-infinity from {start:g}": _told(found, names) for start, found in i.hinf.items()}}  # fmt: skip
    roles = {i.reference_name: "limit", "matched filters": "estimate", f"H-infinity from {STARTS[0]:g}": "iced",
             f"H-infinity from {STARTS[1]:g}": "protected"}  # fmt: skip
    return derivative_dots(series, {n: i.published[n] for n in names}, roles, "the published model")


def _told(estimates: object, names: list[str]) -> dict[str, tuple[float, float]]:
    assert isinstance(estimates, dict)
    return {n: (estimates[n].estimate, estimates[n].std_error) for n in names
            if n in estimates and estimates[n].identifiable}  # fmt: skip


@styled
def courses(i: Identified) -> Figure:
    """Four derivatives against time from both starts, with least squares' answer."""
    names = PANELS["longitudinal" if "Cm_alpha" in i.names else "lateral"]
    figure = Figure(figsize=(9.2, 4.4), layout="constrained")
    panels = list(figure.subplots(2, 2, sharex=True).flat)
    for axes, name in zip(panels, names, strict=True):
        for role, (start, run) in zip(("iced", "protected"), i.runs.items(), strict=True):
            line(axes, run.time - run.time[0], run.parameter(name)[0], color=ROLES[role]["color"],
                 label=f"H-infinity from {start:g}")  # fmt: skip
        axes.axhline(i.matched[name].estimate, label="least squares, matched filters", **ROLES["truth"])
        axes.axhline(i.published[name], label="published model", **ROLES["clean"])
        low, high = sorted(start*i.published[name] for start in STARTS)
        axes.set_ylim(low - 0.15*(high - low), high + 0.15*(high - low))  # a filter's first guesses may leave the page
        axes.set_title(f"{name} (1/rad)", loc="left")
        axes.margins(x=0.0)
    for axes in panels[2:]:
        axes.set_xlabel("time (s)")
    legend_above(figure, panels)
    return figure
