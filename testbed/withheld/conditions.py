"""What records of a case are made in: gusts and noise."""

from __future__ import annotations

from typing import NamedTuple

KINDS = ("later", "turning", "at_once", "rolling")  # how gusts differ along the aircraft (`gusts.py`)


class Conditions(NamedTuple):
    """Air and instruments of a case.

    Attributes:
        sigma: gust intensity, m/s.
        scale: of the gusts' length.
        level: of the instruments' noise.
        gusts: one of KINDS.
    """

    sigma: float
    scale: float
    level: float
    gusts: str = "later"
