"""The report of `icing reproduce --out`: every figure and every row, disagreements first in each item."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path

from testbed.reports.page import Cell, Report
from testbed.reproduce.items import ITEMS
from testbed.reproduce.pictures import Picture
from testbed.reproduce.row import Row

OPENING = """
Whalen, Melody, Bragg and Basar, Aircraft Characterization in Icing Using Flight Test Data. Every number of the paper
that can be put beside one of ours is here, with the rule by which the two agree, fixed per sort of number, and the
reason where they do not. Nothing is tuned per row.

The paper's records in natural ice are not public. Rows marked simulated are analogues flown in the testbed; rows marked
recorded come from NASA's flights of the same aircraft.
"""


def write(rows: Sequence[Row], seed: int, command: Mapping[str, str], folder: Path,
          progress: Callable[[str], None] | None = None) -> Path:
    """Write `reproduce.html` into `folder`, whole or not at all; returns its path.

    Args:
        rows: as `reproduce` gave them; their items' figures are drawn from the same flights.
        seed: of the flights.
        command: what made the report, for its foot.
        folder: made if absent.
        progress: told what is being drawn.
    """
    report = Report("The founding paper's numbers beside ours",
                    f"{sum(r.agrees for r in rows)} of {len(rows)} rows agree.", command)
    report.section("What stands here", OPENING)
    items = list(dict.fromkeys(r.item for r in rows))
    report.table(("item", "what it is", "agree", "of"), [(i, ITEMS[i][1], *_count(rows, i)) for i in items],
                 "Items and how many of their rows agree.")
    for item in items:
        if progress is not None:
            progress(f"drawing {item}")
        _section(report, item, [r for r in rows if r.item == item], seed)
    return report.write(folder/"reproduce.html")


def _count(rows: Sequence[Row], item: str) -> tuple[int, int]:
    of = [r.agrees for r in rows if r.item == item]
    return sum(of), len(of)


def _section(report: Report, item: str, rows: Sequence[Row], seed: int) -> None:
    """One item: its count, figures and rows."""
    report.section(f"{item}: {ITEMS[item][1]}")
    agree, of = _count(rows, item)
    report.verdict(f"{item}: {agree} of {of} rows agree.", "good" if agree == of else "caution")
    for picture in pictures(item, seed):
        report.figure(picture.figure, picture.caption, picture.alt)
    report.table(("quantity", "paper", "project", "unit", "difference (%)", "agrees", "rule"),
                 [_cells(r) for r in rows], f"Rows of {item}.")
    apart = [r for r in rows if not r.agrees]
    if apart:
        report.table(("what does not agree", "how ours was found, and why"), [(r.quantity, r.why) for r in apart])


def _cells(r: Row) -> tuple[Cell, ...]:
    return (r.quantity, _text(r.paper), _text(r.project), r.unit, r.difference_percent, "yes" if r.agrees else "NO",
            r.rule)


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}".replace("-", "−")


def pictures(item: str, seed: int) -> list[Picture]:
    """Figures of an item; none where it draws nothing."""
    draw = getattr(import_module(f"testbed.reproduce.{ITEMS[item][0]}"), "pictures", None)
    return draw(seed) if draw is not None else []
