"""`icing demo`: one report of what the testbed does."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from testbed.commands.common import print_json, verb

if TYPE_CHECKING:
    from testbed.demo.demonstration import Demonstration, Size

MARKS = {"good": "[green]✓[/]", "caution": "[yellow]![/]", "bad": "[red]✕[/]", "info": "[blue]i[/]"}


@verb("demo", "icing demo\nicing demo --seed 7 --out my_demo --quick")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=Path("out/demo"), show_default=True,
              help="Folder of the report.")
@click.option("--quick", is_flag=True, help="Shorter flights and fewer seeds: to see that everything works.")
def command(out: Path, quick: bool, as_json: bool, seed: int) -> None:
    """Fly the demonstration and write its report.

    An icing encounter with and without protection, the observer's derivatives over time, NASA's flight records
    identified (ICING_FLIGHT_DATA names their folder; without them a simulated record stands in), and a hidden
    difference between model and aircraft, diagnosed.
    """
    from testbed.demo.demonstration import FULL, QUICK

    found = _run(out, seed, QUICK if quick else FULL)
    if as_json:
        print_json({"report": found.report, "seconds": found.seconds, "verdicts": found.verdicts})
        return
    from rich.console import Console
    from rich.markup import escape

    console = Console(highlight=False)
    for part, verdicts in found.verdicts.items():
        console.print(f"\n[bold]{part}[/]")
        for verdict in verdicts:
            console.print(f" {MARKS[verdict.kind]} {escape(verdict.text)}")
    console.print(f"\nreport: {escape(str(found.report))} ({found.seconds:.0f} s)", soft_wrap=True)


def _run(out: Path, seed: int, size: Size) -> Demonstration:
    """Run it, with a progress bar on standard error."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from testbed.demo.demonstration import run

    columns = (BarColumn(24), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("", total=1.0)
        return run(out, seed, size, lambda what, share: progress.update(bar, description=what, completed=share))
