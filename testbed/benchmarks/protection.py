"""`icing benchmark protection`: what protection is worth over drawn encounters, and what it costs in a step."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from controllers.choice import PROTECTIONS
from testbed.benchmarks.encounters import DRAG, ENCOUNTERS, Tally, fly, seeds_of, world_of
from testbed.benchmarks.speed import measured, microseconds
from testbed.comparison.metrics import interval

ENCOUNTERS_EACH, QUICK, BATCH = 1000, 40, 250
WHO: dict[str, dict[str, Any]] = {
    "unprotected": {"management": False, "protection": False},
    **{name: {"shield": name} for name in PROTECTIONS},
    "oracle": {"estimator": "oracle"},
}
CALLS, ROUNDS = 20_000, 20  # of a filter, for its 99th percentile
RATE_BATCH, RATE_ROUNDS = 1024, 5


def joined(tallies: list[Tally]) -> dict[str, np.ndarray]:
    """Fields of several tallies, one after another."""
    names = ("stalled", "departed", "beyond", "moved", "alive", "worst")
    return {name: np.concatenate([getattr(t, name) for t in tallies]) for name in names}


def spread(values: np.ndarray, share: bool = False) -> dict[str, float | None]:
    """Mean with its 95 % interval, Wilson's for shares."""
    mean, low, high = interval(values.astype(float), share)
    return {"mean": mean, "low95": low, "high95": high}


def row(name: str, who: str, n: int, purpose: str) -> dict[str, Any]:
    """Figures of `n` encounters of one scenario, flown by the autopilot with one way of protection."""
    seeds, tallies = seeds_of(name, purpose, n), []
    for first in range(0, n, BATCH):
        part = seeds[first:first + BATCH]
        tallies.append(fly(world_of(name, len(part), **WHO[who]), part))
    t = joined(tallies)
    return {"scenario": name, "protection": who, "stalled": spread(t["stalled"], share=True),
            "departed": spread(t["departed"], share=True), "exceedances": spread(t["beyond"]/t["alive"]),
            "interventions": spread(t["moved"]/t["alive"]), "worst_margin": float(t["worst"].min())}


def filter_time(shield: str) -> dict[str, float]:
    """Median and 99th percentile [us] of one call for one aircraft in a severe encounter, at its limits."""
    world = world_of("holding_asymmetric", 1, shield=shield)
    world.reset(seeds=[1], initial={"eta": dict.fromkeys(DRAG, 0.19)})
    for _ in range(2000):
        world.step()
    command, before, spent = world.fleet.command, world.fleet.command.copy(), np.empty(CALLS)
    before["elevator"], before["aileron"] = -0.4, -0.28  # full back stick, full right
    call = world.loop._protect  # type: ignore[attr-defined]
    for k in range(CALLS):
        command[:] = before
        start = time.perf_counter()
        call()
        spent[k] = time.perf_counter() - start
    rounds = 1e6*spent.reshape(ROUNDS, -1)  # what else the machine does falls into some of them
    return {"median": float(np.median(rounds)), "p99": float(np.median(np.percentile(rounds, 99, axis=1)))}


def rates() -> dict[str, float]:
    """Environment steps per second of a batch: observed alone, and observed, flown by the autopilot and protected."""
    from icing_env.vector_env import TwinOtterVectorEnv
    from testbed.environments import loop_factory

    steps = {}
    for name, options, mode in (("observed", {"management": False, "protection": False}, "surfaces"),
                                ("controlled", {}, "targets")):
        env = TwinOtterVectorEnv(RATE_BATCH, measured(), loop=loop_factory(**options), mode=mode)  # type: ignore[arg-type]
        env.reset(seed=0)
        steps[name] = partial(env.step, np.zeros(env.action_space.shape or (), np.float32))
    found: dict[str, list[float]] = {name: [] for name in steps}
    for _ in range(RATE_ROUNDS):  # in turns: what else the machine does meets both alike
        for name, step in steps.items():
            found[name].append(1e6/microseconds(step, RATE_BATCH))
    middle = {name: float(np.median(values)) for name, values in found.items()}
    return middle | {"ratio": middle["controlled"]/middle["observed"]}


def measure(quick: bool, n: int | None, say: Callable[[str], None], only: tuple[str, ...] = ()) -> dict[str, Any]:
    """All rows and times.

    Args:
        quick: few encounters, on the seeds of development.
        n: encounters per row; 1000, or 40 if quick, if omitted.
        say: called with a line before each row.
        only: names in WHO; all if empty.
    """
    count, purpose = n or (QUICK if quick else ENCOUNTERS_EACH), "development" if quick else "report"
    rows = []
    for name in ENCOUNTERS:
        for who in only or tuple(WHO):
            say(f"{name}, {who}")
            rows.append(row(name, who, count, purpose))
    return {"encounters": count, "seeds": purpose, "rows": rows,
            "filter_us": {name: filter_time(name) for name in PROTECTIONS}, "steps_per_s": rates()}


def tables(found: dict[str, Any]) -> list[tuple[str, dict[str, str], list[list[str]]]]:
    """Title, headings and rows for the terminal."""
    def percent(value: dict[str, float]) -> str:
        return f"{100*value['mean']:.2f} ({max(100*value['low95'], 0.0):.1f}-{100*value['high95']:.1f})"

    columns = ("stalled", "departed", "exceedances", "interventions")
    headers = {"scenario": "left", "protection": "left", **dict.fromkeys(columns, "right"), "margin": "right"}
    rows = [[r["scenario"], r["protection"], *(percent(r[c]) for c in columns), f"{r['worst_margin']:.3f}"]
            for r in found["rows"]]
    cost = [[name, f"{us['median']:.1f}", f"{us['p99']:.1f}"] for name, us in found["filter_us"].items()]
    speed = found["steps_per_s"]
    told = f"observed {speed['observed']:,.0f} steps/s, controlled and protected too {speed['controlled']:,.0f}"
    title = f"{found['encounters']} encounters a row, {found['seeds']} seeds, %; margin to the iced stall, rad"
    return [(title, headers, rows),
            (f"one call for one aircraft; {told} ({100*speed['ratio']:.0f} %)",
             {"protection": "left", "median, us": "right", "p99, us": "right"}, cost)]
