"""A report in one HTML file: text, verdicts, figures and tables, readable offline, on paper and in ten years.

Nothing is loaded from anywhere: pictures and style sheet are inside the file, and there is no script.
"""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import jinja2
import numpy as np

from icing_env.errors import InputError, nearest
from testbed.files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | int | float | None
VERDICTS = {"good": "✓", "caution": "!", "bad": "✕", "info": "i"}  # a sign beside the colour, for those who see none
PNG_DPI = 160


@dataclass(frozen=True)
class Block:
    """One item of a section, as the template reads it."""

    kind: str
    text: str = ""
    number: int = 0
    caption: str = ""
    alt: str = ""
    source: str = ""
    width: int = 0
    sign: str = ""
    level: str = ""
    headers: tuple[str, ...] = ()
    numeric: tuple[bool, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()


@dataclass
class Section:
    """A heading and what stands under it."""

    title: str
    anchor: str
    blocks: list[Block] = field(default_factory=list)


def format_cell(cell: Cell) -> str:
    """A table's cell as text: four significant digits for a float, a dash for nothing or for nan."""
    if cell is None or (isinstance(cell, float | np.floating) and np.isnan(cell)):
        return "–"
    if isinstance(cell, float | np.floating):
        return f"{cell:.4g}".replace("-", "−")
    return str(cell).replace("-", "−") if isinstance(cell, int | np.integer) else str(cell)


def _data_uri(mime: str, content: bytes) -> str:
    return f"data:{mime};base64,{base64.b64encode(content).decode('ascii')}"


def figure_source(figure: Figure) -> tuple[str, int]:
    """A matplotlib figure as a data URI, SVG or PNG, whichever is smaller, and its width in CSS pixels."""
    from matplotlib import rc_context

    svg, png = io.BytesIO(), io.BytesIO()
    # A fixed salt and no date: the same figure gives the same bytes.
    with rc_context({"svg.hashsalt": "report", "svg.fonttype": "path"}):
        figure.savefig(svg, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    figure.savefig(png, format="png", dpi=PNG_DPI, metadata={"Software": None}, pil_kwargs={"optimize": True})
    width = round(figure.get_figwidth() * 96.0)
    if len(svg.getvalue()) <= len(png.getvalue()):
        return _data_uri("image/svg+xml", svg.getvalue()), width
    return _data_uri("image/png", png.getvalue()), width


class Report:
    """Builds a report from top to bottom; every method adds at the end and returns the report.

    Args:
        title: what the report is about.
        subtitle: one sentence under it.
        provenance: what made the report (command, seed, version ...), shown at its foot.
    """

    def __init__(self, title: str, subtitle: str = "", provenance: Mapping[str, str] | None = None) -> None:
        self.title = title
        self.subtitle = subtitle
        self.provenance = dict(provenance or {})
        self._sections: list[Section] = []
        self._figures = 0
        self._tables = 0

    def _add(self, block: Block) -> Report:
        if not self._sections:
            self.section("Overview")
        self._sections[-1].blocks.append(block)
        return self

    def section(self, title: str, text: str = "") -> Report:
        """Start a section. `text` is plain; a blank line parts its paragraphs."""
        slug = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "section"
        self._sections.append(Section(title, f"s{len(self._sections) + 1}-{slug}"))
        return self.text(text)

    def text(self, text: str) -> Report:
        """Add paragraphs of plain text, parted by blank lines."""
        for paragraph in re.split(r"\n\s*\n", text.strip()):
            if paragraph:
                self._add(Block("paragraph", " ".join(paragraph.split())))
        return self

    def code(self, text: str) -> Report:
        """Add lines of code, set as they are."""
        return self._add(Block("code", text.strip("\n")))

    def verdict(self, text: str, kind: str = "info") -> Report:
        """Add a verdict; those that are not "info" are gathered at the head of the report as well.

        Raises:
            InputError: `kind` is not one of good, caution, bad, info.
        """
        if kind not in VERDICTS:
            raise InputError(f"verdict kind '{kind}': {nearest(kind, list(VERDICTS))}")
        return self._add(Block("verdict", text, sign=VERDICTS[kind], level=kind))

    def figure(self, figure: Figure, caption: str, alt: str = "") -> Report:
        """Add a matplotlib figure; `alt` says in words what it shows (the caption stands in for it)."""
        source, width = figure_source(figure)
        return self._picture(source, width, caption, alt)

    def image(self, array: np.ndarray, caption: str, alt: str = "") -> Report:
        """Add a picture from a uint8 array, shape (height, width, 3).

        Raises:
            InputError: another type or shape.
        """
        if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] != 3:
            raise InputError(f"image is {array.dtype} {array.shape}: must be uint8 of shape (height, width, 3)")
        from PIL import Image

        png = io.BytesIO()
        Image.fromarray(array).save(png, format="PNG", optimize=True)
        return self._picture(_data_uri("image/png", png.getvalue()), array.shape[1], caption, alt)

    def _picture(self, source: str, width: int, caption: str, alt: str) -> Report:
        self._figures += 1
        block = Block("figure", number=self._figures, caption=caption, alt=alt or caption, source=source, width=width)
        return self._add(block)

    def table(self, headers: Sequence[str], rows: Sequence[Sequence[Cell]], caption: str = "") -> Report:
        """Add a table; a column that holds numbers only is set flush right.

        Raises:
            InputError: a row has not as many cells as there are headers.
        """
        for index, row in enumerate(rows):
            if len(row) != len(headers):
                raise InputError(f"table '{caption}', row {index}: {len(row)} cells, must be {len(headers)}")
        numbers = int | float | np.integer | np.floating | None
        numeric = tuple(bool(rows) and all(isinstance(row[i], numbers) for row in rows) for i in range(len(headers)))
        cells = tuple(tuple(format_cell(cell) for cell in row) for row in rows)
        self._tables += 1
        return self._add(Block("table", number=self._tables, caption=caption, headers=tuple(headers),
                               numeric=numeric, rows=cells))  # fmt: skip

    def html(self) -> str:
        """The whole report as one HTML document."""
        environment = jinja2.Environment(
            loader=jinja2.PackageLoader("testbed.reports"),
            autoescape=True,
            undefined=jinja2.StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        verdicts = [(section.anchor, block) for section in self._sections for block in section.blocks
                    if block.kind == "verdict" and block.level != "info"]  # fmt: skip
        return environment.get_template("report.html.jinja").render(
            report=self, sections=self._sections, verdicts=verdicts
        )

    def write(self, path: str | Path) -> Path:
        """Write the report to `path`, whole or not at all; folders are made as needed. Returns the path."""
        return write_whole(path, self.html())
