"""`icing identify`: aerodynamic derivatives from flight records."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from estimators.methods import METHODS, method
from testbed.commands.common import print_json, print_table, verb

if TYPE_CHECKING:
    from estimators.estimate import Estimate
    from icing_env.record import FlightRecord


EXAMPLE = """icing identify flight.csv
icing identify doublet1.csv doublet2.csv --method hinf --start 0.4 --json"""


@verb("identify", EXAMPLE)
@click.argument("records", nargs=-1, required=True, metavar="RECORD...", type=click.Path(path_type=Path))
@click.option("--method", "name", type=click.Choice(list(METHODS)), default="stepwise", show_default=True,
              help="Equation error, or the recursive H-infinity observer run once over the record.")  # fmt: skip
@click.option("--mode", type=click.Choice(["matched", "textbook"]), default="matched", show_default=True,
              help="Equation error: our filters on raw channels, or the columns that the owner stored.")  # fmt: skip
@click.option("--start", type=click.FloatRange(min=0.0, min_open=True), default=1.0, show_default=True,
              help="H-infinity: factor on the published model at which the estimates start.")  # fmt: skip
def command(records: tuple[Path, ...], name: str, mode: str, start: float, as_json: bool, seed: int) -> None:
    """Estimate aerodynamic derivatives from flight records (.csv, .parquet, SIDPAC's .mat), per rad.

    A derivative that a record does not excite is refused, with the reason, rather than guessed. With several
    records each is identified alone; the derivatives are then their mean weighted by inverse variance, its error
    widened where they scatter more than their errors allow. Nothing is drawn at random; --seed changes nothing.
    """
    found = {str(path): identify(path, name, mode, start) for path in records}
    result = answer(found)
    if as_json:
        print_json(result)
        return
    headers = {"derivative": "left", "estimate": "right", "std error": "right", "unit": "left", "method": "left"}
    rows = [[name, f"{d['estimate']:.4g}", f"{d['std_error']:.2g}", d["unit"], d["method"]]
            for name, d in result["derivatives"].items()]  # fmt: skip
    print_table(", ".join(found), headers, rows)
    for why in dict.fromkeys(result["refused"].values()):
        click.echo(f"refused  {', '.join(n for n, w in result['refused'].items() if w == why)}: {why}")
    for problem in result["problems"]:
        click.echo(f"record   {problem['record']}: {problem['channel']} {problem['kind']}")


def identify(path: Path, name: str, mode: str, start: float) -> tuple[dict[str, Estimate], FlightRecord]:
    """Estimates by name from one record, and the record as checked.

    Raises:
        InputError: the record cannot be read or used.
    """
    from estimators.signals.data_checks import check
    from icing_env.record import read

    record = check(read(path))
    options: dict[str, dict[str, Any]] = {"stepwise": {"mode": mode}, "hinf": {"start": start}}
    return method(name)(record, **options.get(name, {})), record


def answer(found: Mapping[str, tuple[dict[str, Estimate], FlightRecord]]) -> dict[str, Any]:
    """What `--json` prints: derivatives of all records together, what was refused and why, and each record's own."""
    from estimators.combine import combine

    each = {path: estimates for path, (estimates, _) in found.items()}
    derivatives = combine(list(each.values()))
    refused = {name: e.why for estimates in each.values() for name, e in estimates.items() if name not in derivatives}
    problems = [
        {"record": path, "channel": p.channel, "kind": p.kind, "from": p.start, "to": p.end, "repaired": p.repaired}
        for path, (_, record) in found.items() for p in record.problems
    ]  # fmt: skip
    result = {"derivatives": _shown(derivatives), "refused": refused, "problems": problems}
    if len(found) > 1:
        result["records"] = {
            path: {"derivatives": _shown(estimates),
                   "refused": {name: e.why for name, e in estimates.items() if not e.identifiable}}
            for path, estimates in each.items()
        }  # fmt: skip
    return result


def _shown(estimates: Mapping[str, Estimate]) -> dict[str, dict[str, Any]]:
    keys = ("estimate", "std_error", "unit", "method", "r2")
    return {name: {key: getattr(e, key) for key in keys} for name, e in estimates.items() if e.identifiable}
