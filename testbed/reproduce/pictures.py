"""Figures of the side-by-side, each an analogue of one or several of the paper's."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.figure import Figure


@dataclass(frozen=True)
class Picture:
    """A figure, what stands under it, and what it shows in words."""

    figure: Figure
    caption: str
    alt: str
