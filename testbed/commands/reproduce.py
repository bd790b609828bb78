"""`icing reproduce`: the founding paper's numbers beside ours."""

from __future__ import annotations

import sys

import click

from testbed.commands.common import print_json, print_table, verb


@verb("reproduce", "icing reproduce table1\nicing reproduce all --json")
@click.argument("names", nargs=-1, metavar="[ITEM...]")
def command(names: tuple[str, ...], as_json: bool, seed: int) -> None:
    """Put the founding paper's tables and figures beside what flies and is identified here.

    ITEM is one or several of table1, tables2_5, flight_010302f1, fig15_16, fig17_18, fig19, fig21_22,
    textbook; all if omitted.
    Rows marked `simulated` are analogues, rows marked `recorded` come from recorded flights and are left out where
    these are absent. When a row agrees is fixed per sort of number; disagreements are shown with their reason.
    """
    from testbed.reproduce.items import reproduce

    say = (lambda line: click.echo(line, err=True)) if sys.stderr.isatty() else None
    rows = reproduce(names or ("all",), seed, progress=say)
    if as_json:
        print_json({"rows": rows})
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


def _number(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"
