"""Ink, colours and fonts of the flight display: a thin layer over Pillow that works in layout units.

The layout is written once for a page of 960 x 720 units. A `Pen` scales it to the image it draws on, which is twice
as large as the frame asked for; the reduction by two at the end smooths every edge.
Colours follow cockpit practice (14 CFR 25.1322: red warning, amber caution, green normal; cyan for what is selected).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

Colour = tuple[int, int, int]
Point = tuple[float, float]
Box = tuple[float, float, float, float]  # left, top, right, bottom

PAGE = (960, 720)
BACK: Colour = (9, 12, 17)
PANEL: Colour = (19, 24, 32)
WELL: Colour = (32, 39, 50)
EDGE: Colour = (52, 62, 77)
INK: Colour = (238, 242, 247)
DIM: Colour = (158, 169, 184)
GREEN: Colour = (72, 217, 120)
AMBER: Colour = (255, 178, 36)
RED: Colour = (255, 72, 64)
CYAN: Colour = (80, 216, 255)
YELLOW: Colour = (255, 216, 32)
BLACK: Colour = (0, 0, 0)


@lru_cache(maxsize=128)
def font(pixels: int, bold: bool) -> ImageFont.FreeTypeFont:
    """DejaVu Sans as matplotlib bundles it (its digits share one width), `pixels` high."""
    from matplotlib import get_data_path

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(get_data_path()) / "fonts" / "ttf" / name), pixels)


@lru_cache(maxsize=1024)
def text_mask(text: str, pixels: int, bold: bool) -> Image.Image:
    """Coverage of a line of text in a tight box (mode L). Cached, as a display writes the same few words all day."""
    face = font(pixels, bold)
    ascent, descent = face.getmetrics()
    mask = Image.new("L", (max(1, math.ceil(face.getlength(text))) + 2, ascent + descent), 0)
    ImageDraw.Draw(mask).text((1, 0), text, fill=255, font=face)
    return mask


def mix(first: Colour, second: Colour, share: float) -> Colour:
    """Colour between two: `share` 0 gives the first, 1 the second."""
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(first, second, strict=True))
    return red, green, blue


def clamp(value: float, low: float, high: float) -> float:
    """`value` held inside low..high."""
    return min(max(value, low), high)


def polar(centre: Point, radius: float, degrees: float) -> Point:
    """Point at an angle clockwise from the top."""
    angle = math.radians(degrees)
    return centre[0] + radius * math.sin(angle), centre[1] - radius * math.cos(angle)


class Pen:
    """Draws on a Pillow image in layout units.

    Args:
        image: what to draw on, mode RGB.
        scale: pixels of the image in one layout unit.
        origin: layout coordinates of the image's upper left corner.
    """

    def __init__(self, image: Image.Image, scale: float, origin: Point = (0.0, 0.0)) -> None:
        self.image = image
        self.scale = scale
        self.origin = origin
        self._draw = ImageDraw.Draw(image)

    def _pixel(self, point: Point) -> Point:
        return (point[0] - self.origin[0]) * self.scale, (point[1] - self.origin[1]) * self.scale

    def _width(self, width: float) -> int:
        return max(1, round(width * self.scale))

    def line(self, points: list[Point], colour: Colour, width: float = 2.0) -> None:
        """Open line through `points`."""
        self._draw.line([self._pixel(p) for p in points], colour, self._width(width), joint="curve")

    def polygon(self, points: list[Point], fill: Colour, outline: Colour | None = None, width: float = 1.0) -> None:
        """Filled polygon, optionally with an outline."""
        pixels = [self._pixel(p) for p in points]
        self._draw.polygon(pixels, fill)
        if outline is not None:
            self._draw.line([*pixels, pixels[0], pixels[1]], outline, self._width(width), joint="curve")

    def rectangle(
        self, box: Box, fill: Colour | None, outline: Colour | None = None, radius: float = 0.0, width: float = 1.5
    ) -> None:
        """Rectangle with rounded corners; a box turned inside out is put right first."""
        x0, x1 = sorted((box[0], box[2]))
        y0, y1 = sorted((box[1], box[3]))
        pixels = [*self._pixel((x0, y0)), *self._pixel((x1, y1))]
        line = self._width(width) if outline is not None else 0
        if radius > 0.0:
            self._draw.rounded_rectangle(pixels, radius * self.scale, fill, outline, line)
        else:
            self._draw.rectangle(pixels, fill, outline, line)

    def arc(self, centre: Point, radius: float, start: float, end: float, colour: Colour, width: float) -> None:
        """Arc from `start` to `end`, degrees clockwise from the top; `radius` is that of its middle line."""
        x, y = self._pixel(centre)
        outer = (radius + width / 2.0) * self.scale
        box = [x - outer, y - outer, x + outer, y + outer]
        self._draw.arc(box, start - 90.0, end - 90.0, colour, self._width(width))

    def text(
        self,
        at: Point,
        text: str,
        size: float,
        colour: Colour = INK,
        anchor: str = "m",
        bold: bool = False,
        turn: float = 0.0,
    ) -> None:
        """One line of text, vertically centred on `at`.

        Args:
            at: where, in layout units.
            text: what.
            size: height of the letters' em, layout units.
            colour: of the ink.
            anchor: "l", "m" or "r": which part of the line stands at `at`.
            bold: heavier letters.
            turn: rotation, degrees counter-clockwise, about the middle.
        """
        mask = text_mask(text, max(6, round(size * self.scale)), bold)
        if turn:
            mask = mask.rotate(turn, Image.Resampling.BILINEAR, expand=True)
        x, y = self._pixel(at)
        x -= mask.width * {"l": 0.0, "m": 0.5, "r": 1.0}[anchor]
        self.image.paste(colour, (round(x), round(y - mask.height / 2.0)), mask)

    @contextmanager
    def inside(self, box: Box, fill: Colour, radius: float = 6.0) -> Iterator[Pen]:
        """A pen whose ink stays inside `box` (rounded corners); the box is laid on the page on leaving."""
        left, top = self._pixel((box[0], box[1]))
        size = (round((box[2] - box[0]) * self.scale), round((box[3] - box[1]) * self.scale))
        inner = Pen(Image.new("RGB", size, fill), self.scale, (box[0], box[1]))
        yield inner
        self.image.paste(inner.image, (round(left), round(top)), rounded_mask(size, round(radius * self.scale)))


@lru_cache(maxsize=32)
def rounded_mask(size: tuple[int, int], radius: int) -> Image.Image:
    """Coverage of a rectangle with rounded corners (mode L)."""
    mask = Image.new("L", size, 0)
    ImageDraw.Draw(mask).rounded_rectangle([0, 0, size[0] - 1, size[1] - 1], radius, fill=255)
    return mask


def panel(pen: Pen, box: Box, title: str = "") -> None:
    """Background of a group of readings, with its title in the upper left corner."""
    pen.rectangle(box, PANEL, EDGE, radius=6.0)
    if title:
        pen.text((box[0] + 12.0, box[1] + 17.0), title, 14.0, DIM, "l", bold=True)


def failed(pen: Pen, box: Box, name: str) -> None:
    """What stands in place of an instrument whose input is not a finite number: a red cross and its name."""
    pen.rectangle(box, PANEL, RED, radius=6.0)
    pen.line([(box[0] + 8, box[1] + 8), (box[2] - 8, box[3] - 8)], RED, 2.5)
    pen.line([(box[0] + 8, box[3] - 8), (box[2] - 8, box[1] + 8)], RED, 2.5)
    x, y = (box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0
    half = 7.0 + 5.2 * len(name)
    pen.rectangle((x - half, y - 14.0, x + half, y + 14.0), BLACK, RED, radius=4.0)
    pen.text((x, y), name, 14.0, RED, bold=True)
