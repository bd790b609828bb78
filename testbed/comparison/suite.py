"""A suite: which scenarios a comparison flies, how long, and in which turbulence. Files under configs/suites/."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import Field as Limited

from icing_env import scenario as scenarios
from icing_env.configuration import Strict, available, read_toml, validate
from icing_env.errors import InputError, nearest
from icing_env.scenario import Scenario

# Severities drawn for a pre-iced start: up to the size of the founding flight's encounters (0.073 after 20 minutes gave
# a drag of 0.0233) and half as much again; assumed.
PRE_ICED = {surface: {"low": 0.02, "high": 0.11}
            for surface in ("left_wing", "right_wing", "htail", "vtail", "struts", "other")}


class Entry(Strict):
    """One scenario of a suite."""

    scenario: str
    duration: float | None = Limited(None, gt=0.0)  # s, instead of the suite's
    pre_iced: bool = False  # severities drawn from PRE_ICED at the start
    turbulence: tuple[str, ...] | None = None  # classes, instead of all of the suite
    changes: dict[str, Any] = {}  # keys of the scenario to replace


class Suite(Strict):
    """One suite, as its file says."""

    name: str
    description: str = ""
    episodes: int = Limited(8, gt=0)
    duration: float = Limited(120.0, gt=0.0)  # s
    turbulence: dict[str, float]  # sigma_w [m/s] by class
    entries: tuple[Entry, ...]

    def cases(self) -> Iterator[tuple[str, Scenario]]:
        """Turbulence class and scenario of every case, in order."""
        for entry in self.entries:
            for label in entry.turbulence or tuple(self.turbulence):
                yield label, self._scenario(entry, label)

    def _scenario(self, entry: Entry, label: str) -> Scenario:
        if label not in self.turbulence:
            raise InputError(f"suite '{self.name}', {entry.scenario}: no turbulence class '{label}': "
                             f"{nearest(label, list(self.turbulence))}")
        changes: dict[str, Any] = {"duration": entry.duration or self.duration, **entry.changes}
        changes["parameters"] = {**changes.get("parameters", {}), "turbulence_sigma_w": self.turbulence[label]}
        if entry.pre_iced:
            changes["randomise"] = {**changes.get("randomise", {}), "eta": PRE_ICED}
        return scenarios.load(entry.scenario, **changes)


def load(name: str | Path) -> Suite:
    """A suite by name or path.

    Raises:
        InputError: no such suite, or a key or value in it is wrong (the nearest valid one is named).
    """
    data = read_toml("suites", name)
    data.setdefault("name", Path(str(name)).stem)
    return validate(Suite, data, f"suite '{data['name']}'")


def names() -> list[str]:
    """Every suite that comes with the project."""
    return available("suites")
