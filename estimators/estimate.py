"""What an identification says of one parameter."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """A parameter, its standard error and whether the record could show it.

    `r2` is that of the equation it was fitted in. `why` is a plain sentence where `identifiable` is false;
    `warning` one where the record breaks an assumption of the method, so that the standard error may be too small.
    """

    estimate: float
    std_error: float
    unit: str
    method: str
    r2: float | None = None
    identifiable: bool = True
    why: str = ""
    warning: str = ""
