"""What the parts of the demonstration share: a verdict, a way to say how far one is, and how numbers are worded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from testbed.reports.page import Report

Tell = Callable[[str, float], None]  # what is being done, and the share of it done, 0..1
KNOT, FOOT, COUNT = 0.514444, 0.3048, 1.0e-4  # m/s, m, drag coefficient


@dataclass(frozen=True)
class Verdict:
    """One sentence that the figures of a section bear out; `kind` is good, caution, bad or info."""

    text: str
    kind: str


def write_verdicts(report: Report, verdicts: list[Verdict]) -> None:
    """Add verdicts to the section that is open."""
    for verdict in verdicts:
        report.verdict(verdict.text, verdict.kind)


def several(count: int, one: str, many: str = "") -> str:
    """`1 flight`, `3 flights`, `no flight`."""
    if count == 1:
        return f"1 {one}"
    return f"{count or 'no'} {(many or one + 's') if count else one}"


def rms(values: NDArray[np.float64]) -> float:
    """Root mean square of what is finite."""
    return float(np.sqrt(np.nanmean(np.square(values))))
