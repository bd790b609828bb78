"""One line of the side-by-side with the founding paper."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """A number of the paper beside ours.

    Attributes:
        item: what was asked for, as in `icing reproduce ITEM`.
        quantity: which number of it.
        kind: "simulated" or "recorded".
        paper, project: the two values; text where the paper gives no number.
        unit: of both.
        difference_percent: project less paper, over paper; None where one is not a number or the paper's is 0.
        agrees: by `rule`.
        rule: when they agree, fixed beforehand for every row of its sort.
        why: in plain words: how ours was found, and what explains a disagreement.
    """

    item: str
    quantity: str
    kind: str
    paper: float | str
    project: float | str
    unit: str
    difference_percent: float | None
    agrees: bool
    rule: str
    why: str


@dataclass(frozen=True)
class Rule:
    """When two numbers agree: within `absolute` or within the share `relative` of the paper's, or past a bound."""

    absolute: float = 0.0
    relative: float = 0.0
    at_least: bool = False  # the paper states a lower bound: more is no disagreement

    def holds(self, paper: float, project: float) -> bool:
        """True if they agree; never for a number that is not finite."""
        short = paper - project if self.at_least else abs(project - paper)
        return bool(math.isfinite(project) and short <= self.absolute + self.relative*abs(paper) + 1e-12)

    def text(self, unit: str) -> str:
        """The rule in words."""
        if not (self.absolute or self.relative):
            return "not lower" if self.at_least else "equal"
        size = f"{100*self.relative:g} %"
        if self.absolute:
            size = f"{self.absolute:g} {'points' if unit == '%' else '' if unit == '1' else unit}".rstrip()
        return f"not lower by more than {size}" if self.at_least else f"within {size}"


def row(item: str, quantity: str, paper: float, project: float, unit: str, rule: Rule, why: str,
        kind: str = "simulated", miss: str = "") -> Row:
    """A row of two numbers; `miss` is added to `why` where they disagree."""
    agrees = rule.holds(paper, project)
    percent = 100.0*(project - paper)/paper if paper else None
    return Row(item, quantity, kind, paper, project, unit, percent, agrees, rule.text(unit),
               why if agrees or not miss else f"{why}; {miss}")
