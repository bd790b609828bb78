"""Controllers with and without ice management and envelope protection, over a suite, on the same drawn cases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from testbed.comparison.metrics import measure
from testbed.comparison.suite import Suite
from testbed.comparison.trace import trace
from testbed.flight import CONTROLLERS, controller, make_world


def compare(suite: Suite, controllers: Sequence[str] | None = None, episodes: int | None = None, seed: int = 0, *,
            progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Fly every case of a suite with every controller, protected and not.

    Episode i of a case has seed `seed` 1,000,000 + i whoever flies, so all rows of a case meet the same weather, ice
    and starting conditions.

    Args:
        suite: of `testbed.suite.load`.
        controllers: names in `testbed.flight.CONTROLLERS`; all if omitted.
        episodes: per row; the suite's own number if omitted.
        seed: of everything drawn.
        progress: called with a line before each row.

    Returns:
        {"suite", "episodes", "rows"}: the form that `icing compare --json` prints.

    Raises:
        InputError: unknown controller, or a scenario of the suite does not load.
    """
    who = [controller(name) for name in controllers or CONTROLLERS]
    count = episodes or suite.episodes
    seeds = [seed*1_000_000 + i for i in range(count)]
    rows = []
    for label, scenario in suite.cases():
        for pilot in who:
            for protection in (True, False):
                if progress is not None:
                    progress(f"{scenario.name}, {label} turbulence, {pilot.name}, "
                             f"{'protected' if protection else 'unprotected'}")
                flown = trace(make_world(scenario, count, pilot.name, protection), seeds)
                rows.append({"controller": pilot.name, "kind": pilot.kind, "protection": protection,
                             "scenario": scenario.name, "turbulence": label, "metrics": measure(flown, protection)})
    return {"suite": suite.name, "episodes": count, "rows": rows}
