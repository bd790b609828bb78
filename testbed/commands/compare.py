"""`icing compare`: controllers on the same cases, with and without protection."""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path
from typing import Any

import click

from testbed.commands.common import print_json, print_table, verb

WIDTH = 100  # columns of a terminal

@verb("compare", "icing compare --quick\nicing compare --controllers autopilot,hands_off --episodes 8 --out report")
@click.option("--suite", default="standard", show_default=True, help="A name under configs/suites, or a .toml's path.")
@click.option("--quick", is_flag=True, help="The suite `quick`.")
@click.option("--controllers", metavar="A,B,...", help="Who flies; everybody if omitted.")
@click.option("--episodes", type=click.IntRange(min=1), help="Episodes per row; the suite's own number if omitted.")
@click.option("--workers", type=click.IntRange(min=1), default=2, show_default=True, help="Processes.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for compare.html and .json.")
def command(suite: str, quick: bool, controllers: str | None, episodes: int | None, workers: int, out: Path | None,
            as_json: bool, seed: int) -> None:
    """Fly a suite with every controller, protected and not, on the same drawn cases.

    Figures for each of the four functions of an ice management system, as means over the episodes with 95 %
    intervals; here over all cases, by case in the report and with --json. A dash is a figure that no episode has, such
    as a detection delay without ice or without detection.
    """
    from testbed.comparison.compare import compare
    from testbed.comparison.suite import load

    say = (lambda line: click.echo(line, err=True)) if sys.stderr.isatty() else None
    names = [name.strip() for name in controllers.split(",")] if controllers else None
    result = compare(load("quick" if quick else suite), names, episodes, seed, workers=workers, progress=say)
    if out is not None:
        from testbed.commands.identify import provenance
        from testbed.comparison.page import write

        click.echo(f"report   {write(result, provenance(), out)}", err=as_json)
    if as_json:
        print_json(result)
        return
    _overview(result)


def _overview(result: dict[str, Any]) -> None:
    """Tables per function over all cases, as many as it takes to keep to WIDTH, then what follows."""
    from testbed.comparison.overview import FUNCTIONS, heading, overview, sentences, told

    rows = result["rows"]
    seen = overview(rows)
    click.echo(f"suite {result['suite']}, {seen[0]['cases']} cases of {result['episodes']} episodes; mean and half of "
               "the 95 % interval")
    who = [[one["controller"], "on" if one["protection"] else "off"] for one in seen]
    for function, title in FUNCTIONS.items():
        columns = [["\n".join(heading(rows, n).split(maxsplit=2)), *(_cell(*one["metrics"][n]) for one in seen)]
                   for n in told(rows, function)]
        for part in _fitting(columns, WIDTH - max(len(name) for name, _ in who) - len("  prot.")):
            print_table(f"\n{title}", {"controller": "left", "prot.": "left", **{head: "right" for head, *_ in part}},
                        [[*names, *cells] for names, *cells in zip(who, *(cells for _, *cells in part), strict=True)])
    for text, _ in sentences(rows):
        click.echo(textwrap.fill(text, WIDTH))


def _fitting(columns: list[list[str]], room: int) -> list[list[list[str]]]:
    """Columns, each a heading and its cells, in groups that are at most `room` characters wide (one at least)."""
    groups: list[list[list[str]]] = []
    used = 0
    for column in columns:
        width = 2 + max(len(line) for text in column for line in text.splitlines())
        if not groups or used + width > room:
            groups.append([])
            used = 0
        groups[-1].append(column)
        used += width
    return groups


def _cell(mean: float | None, half: float | None) -> str:
    return "-" if mean is None or half is None else f"{mean:.3g} ±{half:.2g}"
