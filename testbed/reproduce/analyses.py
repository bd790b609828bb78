"""Ways in which a doublet set may be analysed by regression: with filters that match or not, with which alpha."""

from __future__ import annotations

from collections.abc import Callable

from estimators.compatibility.record import corrected as compatible
from estimators.estimate import Estimate
from estimators.regression import equation_error
from icing_env.record import FlightRecord
from testbed.reproduce.compatible import calibrate
from testbed.reproduce.windows import Window

Analysis = Callable[[Window], dict[str, Estimate]]


def unmatched(record: FlightRecord, half: int) -> dict[str, Estimate]:
    """Local slopes over 2 `half` + 1 points against regressors that were not smoothed alike."""
    return equation_error.identify(record, mode="unmatched", half=half)


def corrected(window: Window) -> FlightRecord:
    """The record without the scale factor of alpha that data compatibility in still air gives it, as the paper's."""
    return calibrate(window.record).record


PAPER = "alpha corrected, unmatched over 9 points"
ANALYSES: dict[str, Analysis] = {
    "matched": lambda w: w.stepwise,
    "unmatched over 5 points": lambda w: unmatched(w.record, 2),
    "unmatched over 7 points": lambda w: unmatched(w.record, 3),
    "unmatched over 11 points": lambda w: unmatched(w.record, 5),
    "alpha corrected": lambda w: equation_error.identify(corrected(w)),
    "alpha corrected with wind states": lambda w: equation_error.identify(compatible(w.record, wind=True)),
    PAPER: lambda w: unmatched(corrected(w), 4),
}
