"""`icing compare`: controllers on the same cases, with and without protection."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from testbed.commands.common import print_json, print_table, verb


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
    """A table per function over all cases, then what follows."""
    from testbed.comparison.overview import FUNCTIONS, names_of, overview, sentences

    rows = result["rows"]
    seen = overview(rows)
    for function, title in FUNCTIONS.items():
        names = names_of(rows, function)
        units = {n: rows[0]["metrics"][n]["unit"] for n in names}
        headers = {"controller": "left", "prot.": "left"}
        headers |= {n.replace("_", " ") + ("" if units[n] == "1" else f" ({units[n]})"): "right" for n in names}
        print_table(f"{title} (suite {result['suite']}, {seen[0]['cases']} cases of {result['episodes']} episodes; "
                    "mean and half of the 95 % interval)", headers,
                    [[one["controller"], "on" if one["protection"] else "off",
                      *(_cell(*one["metrics"][n]) for n in names)] for one in seen])
    for text, _ in sentences(rows):
        click.echo(text)


def _cell(mean: float | None, half: float | None) -> str:
    return "-" if mean is None or half is None else f"{mean:.3g} ±{half:.2g}"
