"""Controllers with and without ice management and envelope protection, over a suite, on the same drawn cases."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.scenario import Scenario
from testbed.comparison.metrics import per_episode, summary
from testbed.comparison.suite import Suite
from testbed.comparison.trace import trace
from testbed.flight import CONTROLLERS, Controller, controller, make_world
from testbed.workers import processes

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Row:
    """One row of a comparison: who flies which case, protected or not, and on which seeds."""

    pilot: Controller
    protection: bool
    label: str  # class of turbulence
    scenario: Scenario
    seeds: tuple[int, ...]

    def __str__(self) -> str:
        how = "protected" if self.protection else "unprotected"
        return f"{self.scenario.name}, {self.label} turbulence, {self.pilot.name}, {how}"


def compare(suite: Suite, controllers: Sequence[str] | None = None, episodes: int | None = None, seed: int = 0, *,
            workers: int = 1, progress: Progress | None = None) -> dict[str, Any]:
    """Fly every case of a suite with every controller, protected and not.

    Episode i of a case has seed `seed` 1,000,000 + i whoever flies, so all rows of a case meet the same weather, ice
    and starting conditions.

    Args:
        suite: of `testbed.suite.load`.
        controllers: names in `testbed.flight.CONTROLLERS`; all if omitted.
        episodes: per row; the suite's own number if omitted. A controller that is slow may fly fewer: its row says so.
        seed: of everything drawn.
        workers: processes.
        progress: called with a line before each row.

    Returns:
        {"suite", "episodes", "rows"}: the form that `icing compare --json` prints.

    Raises:
        InputError: unknown controller, or a scenario of the suite does not load.
    """
    who = [controller(name) for name in controllers or CONTROLLERS]
    count = episodes or suite.episodes
    asked = list(_rows(suite, who, count, seed))
    flown = in_order(asked, workers, progress)
    rows = [{"controller": row.pilot.name, "kind": row.pilot.kind, "protection": row.protection,
             "scenario": row.scenario.name, "turbulence": row.label, "episodes": len(row.seeds),
             "metrics": summary(runs, row.pilot.kind == "learned")} for row, runs in zip(asked, flown, strict=True)]
    return {"suite": suite.name, "episodes": count, "rows": rows}


def _rows(suite: Suite, who: Sequence[Controller], count: int, seed: int) -> Iterator[Row]:
    for label, scenario in suite.cases():
        for pilot in who:
            seeds = tuple(seed*1_000_000 + i for i in range(min(count, pilot.episodes)))
            for protection in (True, False):
                yield Row(pilot, protection, label, scenario, seeds)


def in_order(asked: Sequence[Row], workers: int, progress: Progress | None
              ) -> Iterator[list[dict[str, NDArray[np.float64]]]]:  # fmt: skip
    """Results of the rows in their order, flown here or by several processes."""
    if workers == 1:
        for row in asked:
            if progress is not None:
                progress(str(row))
            yield fly_row(row)
        return
    with processes(workers, None) as pool:
        for row, runs in zip(asked, pool.map(fly_row, asked), strict=True):
            if progress is not None:
                progress(str(row))
            yield runs


def fly_row(row: Row) -> list[dict[str, NDArray[np.float64]]]:
    """Metrics by episode, once per training seed of a learned controller, else once."""
    return [per_episode(trace(make_world(row.scenario, len(row.seeds), name, row.protection), list(row.seeds)),
                        row.protection) for name in row.pilot.members]
