"""`icing reproduce`: the founding paper's numbers beside ours."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from testbed.commands.common import print_json, print_table, verb

if TYPE_CHECKING:
    from testbed.reproduce.row import Row


@verb("reproduce", "icing reproduce table1\nicing reproduce all --out report")
@click.argument("names", nargs=-1, metavar="[ITEM...]")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False),
              help="Folder for reproduce.html, a report with every figure.")  # fmt: skip
def command(names: tuple[str, ...], out: Path | None, as_json: bool, seed: int) -> None:
    """Put the founding paper's tables and figures beside what flies and is identified here.

    ITEM is one or several of table1, tables2_5, flight_010302f1, fig15_16, fig17_18, fig19, fig20, fig21_22, fig23_26,
    fig27_30, recorded_methods, prediction, textbook; all if omitted.
    Rows marked `simulated` are analogues, rows marked `recorded` come from recorded flights and are left out where
    these are absent. When a row agrees is fixed per sort of number; disagreements are shown with their reason.
    """
    from testbed.reproduce.items import reproduce

    say = (lambda line: click.echo(line, err=True)) if sys.stderr.isatty() else None
    rows = reproduce(names or ("all",), seed, progress=say)
    report = _report(rows, seed, out, say)
    if as_json:
        print_json({"rows": rows, **report})
        return
    headers = {"item": "left", "quantity": "left", "kind": "left", "paper": "right", "project": "right",
               "unit": "left", "diff. %": "right", "agrees": "left"}
    print_table("founding paper and project", headers, [
        [r.item, r.quantity, r.kind, _number(r.paper), _number(r.project), r.unit,
         "" if r.difference_percent is None else f"{r.difference_percent:+.1f}", "yes" if r.agrees else "NO"]
        for r in rows])
    click.echo(f"{sum(r.agrees for r in rows)} of {len(rows)} agree. Those that do not:")
    for r in rows:
        if not r.agrees:
            click.echo(f"  {r.item}, {r.quantity} ({r.rule}): {r.why}")
    for path in report.values():
        click.echo(f"report   {path}")


def _report(rows: list[Row], seed: int, out: Path | None, say: Callable[[str], None] | None) -> dict[str, str]:
    """Where the report was written, if one was asked for."""
    if out is None:
        return {}
    from testbed.commands.identify import provenance
    from testbed.reproduce.page import write

    return {"report": str(write(rows, seed, provenance(), out, say))}


def _number(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"
