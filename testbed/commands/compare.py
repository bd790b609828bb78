"""`icing compare`: controllers on the same cases, with and without protection."""

from __future__ import annotations

import sys
from typing import Any

import click

from testbed.commands.common import print_json, print_table, verb

FUNCTIONS = {1: "1 sense ice", 2: "2 operate ice protection", 3: "3 protect the envelope", 4: "4 fly well"}


@verb("compare", "icing compare --suite quick\nicing compare --controllers autopilot,hands_off --episodes 8 --json")
@click.option("--suite", default="standard", show_default=True, help="A name under configs/suites, or a .toml's path.")
@click.option("--controllers", metavar="A,B,...", help="Who flies; everybody if omitted.")
@click.option("--episodes", type=click.IntRange(min=1), help="Episodes per row; the suite's own number if omitted.")
def command(suite: str, controllers: str | None, episodes: int | None, as_json: bool, seed: int) -> None:
    """Fly a suite with every controller, protected and not, on the same drawn cases.

    Figures for each of the four functions of an ice management system, as means over the episodes with 95 %
    intervals. A dash is a figure that no episode has, such as a detection delay without ice or without detection.
    """
    from testbed.comparison.compare import compare
    from testbed.comparison.suite import load

    say = (lambda line: click.echo(line, err=True)) if sys.stderr.isatty() else None
    names = [name.strip() for name in controllers.split(",")] if controllers else None
    result = compare(load(suite), names, episodes, seed, progress=say)
    if as_json:
        print_json(result)
        return
    for function, title in FUNCTIONS.items():
        _table(result, function, title)


def _table(result: dict[str, Any], function: int, title: str) -> None:
    """The metrics of one function."""
    names = [n for n, m in result["rows"][0]["metrics"].items() if m["ims_function"] == function]
    units = {n: result["rows"][0]["metrics"][n]["unit"] for n in names}
    headers = {"scenario": "left", "gusts": "left", "controller": "left", "prot.": "left"}
    headers |= {f"{n.replace('_', ' ')} ({units[n]})": "right" for n in names}
    rows = [[row["scenario"], row["turbulence"], row["controller"], "on" if row["protection"] else "off",
             *(_cell(row["metrics"][n]) for n in names)] for row in result["rows"]]
    print_table(f"{title} (suite {result['suite']}, {result['episodes']} episodes, mean and half of the 95 % interval)",
                headers, rows)


def _cell(metric: dict[str, Any]) -> str:
    if metric["mean"] is None:
        return "-"
    return f"{metric['mean']:.3g} ±{0.5*(metric['high95'] - metric['low95']):.2g}"
