"""`icing identify`: aerodynamic derivatives from flight records."""

from __future__ import annotations

import platform
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from estimators.methods import METHODS, method
from testbed.commands.common import print_json, print_table, verb

if TYPE_CHECKING:
    from estimators.estimate import Estimate
    from testbed.reports.identification import Identified

EXAMPLE = """icing identify flight.csv
icing identify doublet1.csv doublet2.csv --method hinf --start 0.4 --json
icing identify flight.csv --compatible wind --out report"""
MODES = ("matched", "fourier", "textbook", "unmatched", "unmatched_smoothed")


@verb("identify", EXAMPLE)
@click.argument("records", nargs=-1, required=True, metavar="RECORD...", type=click.Path(path_type=Path))
@click.option("--method", "name", type=click.Choice(list(METHODS)), default="stepwise", show_default=True,
              help="How: regression, likelihood, or an observer run once over the record.")  # fmt: skip
@click.option("--mode", type=click.Choice(MODES), default="matched", show_default=True,
              help="Stepwise: our filters on raw channels, or the columns that the owner stored (textbook); unmatched "
              "filters are for comparison and bias Cm_q.")  # fmt: skip
@click.option("--start", type=click.FloatRange(min=0.0, min_open=True), default=1.0, show_default=True,
              help="Recursive methods: factor on the published model at which the estimates start.")  # fmt: skip
@click.option("--compatible", type=click.Choice(["none", "kinematic", "wind"]), default="none", show_default=True,
              help="First take out the instruments' biases and scale factors that kinematics show: in still air, or "
              "with gusts as states.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for identify.html, the report.")
def command(records: tuple[Path, ...], name: str, mode: str, start: float, compatible: str, out: Path | None,
            as_json: bool, seed: int) -> None:
    """Estimate aerodynamic derivatives from flight records (.csv, .parquet, SIDPAC's .mat), per rad.

    A derivative that a record does not excite is refused, with the reason, rather than guessed. With several
    records each is identified alone; the derivatives are then their mean weighted by inverse variance, its error
    widened where they scatter more than their errors allow. Nothing is drawn at random; --seed changes nothing.
    """
    found = [identify(path, name, mode, start, compatible) for path in records]
    result = answer(found)
    if out is not None:
        from testbed.reports.identification import write

        result["report"] = str(write(found, name, provenance(), out))
    if as_json:
        print_json(result)
        return
    headers = {"derivative": "left", "estimate": "right", "std error": "right", "unit": "left", "method": "left"}
    rows = [[key, f"{d['estimate']:.4g}", f"{d['std_error']:.2g}", d["unit"], d["method"]]
            for key, d in result["derivatives"].items()]  # fmt: skip
    print_table(", ".join(str(path) for path in records), headers, rows)
    for why in dict.fromkeys(result["refused"].values()):
        click.echo(f"refused  {', '.join(n for n, w in result['refused'].items() if w == why)}: {why}")
    for warning in result["warnings"]:
        click.echo(f"beware   {warning}")
    for problem in result["problems"]:
        click.echo(f"record   {problem['record']}: {problem['channel']} {problem['kind']}")
    if out is not None:
        click.echo(f"report   {result['report']}")


def identify(path: Path, name: str, mode: str = "matched", start: float = 1.0, compatible: str = "none") -> Identified:
    """Estimates by name from one record, and the record as checked and corrected.

    Raises:
        InputError: the record cannot be read or used, or an option does not go with the method.
    """
    from estimators.compatibility.record import check_compatibility
    from estimators.signals.data_checks import check
    from estimators.signals.instruments import calibrated
    from icing_env.errors import InputError
    from icing_env.record import read
    from testbed.reports.identification import Identified

    options: dict[str, Any] = {}
    if name == "stepwise":
        options["mode"] = mode
    elif mode != "matched":
        raise InputError(f"identify: --mode {mode} belongs to --method stepwise; {name} has no modes")
    if start != 1.0:
        options["start"] = _start(name, start)
    record = check(read(path))
    calibration = None
    if compatible != "none":
        calibration = check_compatibility(record, wind=compatible == "wind")
        record = calibration.record
    return Identified(path, calibrated(record), method(name)(record, **options), calibration)


def _start(name: str, start: float) -> float:
    """The start, where the method has one."""
    from inspect import signature

    from icing_env.errors import InputError

    if "start" not in signature(method(name)).parameters:
        raise InputError(f"identify: --start {start:g}: {name} starts from nothing; leave it out")
    return start


def answer(found: Sequence[Identified]) -> dict[str, Any]:
    """What `--json` prints: derivatives of all records together, what was refused and why, and each record's own."""
    from estimators.combine import combine

    each = {str(i.path): i.estimates for i in found}
    derivatives = combine([dict(estimates) for estimates in each.values()])
    refused = {name: e.why for estimates in each.values() for name, e in estimates.items() if name not in derivatives}
    problems = [
        {"record": str(i.path), "channel": p.channel, "kind": p.kind, "from": p.start, "to": p.end,
         "repaired": p.repaired} for i in found for p in i.record.problems
    ]  # fmt: skip
    warnings = list(dict.fromkeys(e.warning for estimates in each.values() for e in estimates.values() if e.warning))
    result = {"derivatives": _shown(derivatives), "refused": refused, "warnings": warnings, "problems": problems}
    if len(found) > 1:
        result["records"] = {
            path: {"derivatives": _shown(dict(estimates)),
                   "refused": {name: e.why for name, e in estimates.items() if not e.identifiable}}
            for path, estimates in each.items()
        }  # fmt: skip
    return result


def _shown(estimates: dict[str, Estimate]) -> dict[str, dict[str, Any]]:
    keys = ("estimate", "std_error", "unit", "method", "r2")
    return {name: {key: getattr(e, key) for key in keys} for name, e in estimates.items() if e.identifiable}


def provenance() -> dict[str, str]:
    """What made a report: command, version, Python."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        ours = f"icing-testbed {version('icing-testbed')}"
    except PackageNotFoundError:
        ours = "run from its sources, not installed"
    return {"command": " ".join(["icing", *sys.argv[1:]]), "version": ours, "python": platform.python_version()}
