"""Function 4 in figures: how well an iced aircraft tracks altitude, airspeed and heading, and where power decides.

The steps of `steps_iced` against those of `steps_clean`, protected, in light turbulence: the same seeds, so the same
gusts, second by second. Time is split by the truth: the share of full power that steady flight of the iced aircraft at
the airspeed and altitude asked for takes, in level flight and, apart, with the bank and the climb that are flown (means
over the last CLIMB_TIME; a descent counts as level). Nobody but the score sees that share. An error on ice is compared
with the clean one over the same seeds and the same seconds; intervals by bootstrap over the seeds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env import scenario
from icing_env.atmosphere import G0
from icing_env.trim import conditions, trim_rows
from icing_env.world import World
from testbed.flight import make_world

FloatArray = NDArray[np.float64]
SEEDS = {"development": 91_000_000, "report": 92_000_000}  # first seed
FLIGHTS, QUICK = 64, 8
SIGMA_W = 2.0  # m/s, light: MIL-F-8785C figure 7 at 7500 ft
ENOUGH = 0.9  # share of the power available below which errors are held against the clean ones
LOOK = 50  # steps between looks at the power required: 1 s
SAMPLE = 5  # steps between samples: 10 Hz
CLIMB_TIME = 5.0  # s
TRIMMED = 1e-8  # largest residual of a steady flight that exists
LEVER = 0.999  # lever that counts as full
ERRORS = ("altitude", "airspeed", "heading")
DRAWS = 2000  # of the bootstrap


@dataclass(frozen=True)
class Tracked:
    """What `n` flights went through, [samples, n] each.

    Attributes:
        errors: altitude [m], airspeed [m/s] and heading [rad], asked less measured, by name.
        level, flown: share of full power that steady flight takes, level and at the bank and climb flown; infinite
            where there is none.
        told: the crew is told that power lacks.
        full: the power levers are at their stop.
        raised: the advised lowest airspeed with the guidance's margin lies above the airspeed asked for.
    """

    errors: dict[str, FloatArray]
    level: FloatArray
    flown: FloatArray
    told: NDArray[np.bool_]
    full: NDArray[np.bool_]
    raised: NDArray[np.bool_]


def required(world: World, climb: FloatArray | float = 0.0, bank: FloatArray | float = 0.0) -> FloatArray:
    """Share of full power that steady flight at the airspeed and altitude asked for takes with the true ice [n].

    Args:
        climb: angle of climb [rad].
        bank: bank [rad].
    """
    f, target = world.fleet, world.loop.target
    state, current, command = f.state.copy(), f.current.copy(), f.command.copy()
    asked = conditions(world.n, airspeed=target["airspeed"], altitude=target["altitude"], climb_angle=climb,
                       turn_rate=G0*np.tan(bank)/target["airspeed"])
    left_over = trim_rows(state, current, command, asked, f.parameters)
    return np.where(left_over < TRIMMED, command["throttle_left"], np.inf)


def track(name: str, who: str, seeds: list[int]) -> Tracked:
    """Fly a scenario of steps once per seed, protected.

    Raises:
        RuntimeError: a flight ended early, so that there is nothing to compare.
    """
    world = make_world(scenario.load(name, parameters={"turbulence_sigma_w": SIGMA_W}), len(seeds), who)
    world.reset(seeds=seeds)
    kept: dict[str, list[NDArray]] = {what: [] for what in (*ERRORS, "level", "flown", "told", "full", "raised")}
    height, bank = [world.fleet.state["altitude"].copy()], [world.fleet.measurement["phi"].copy()]
    back = round(CLIMB_TIME/(SAMPLE*world.dt))
    level = flown = required(world)
    margin = float(world.loop.gains["airspeed_margin"][0])  # type: ignore[attr-defined]
    for step in range(1, world.limit + 1):
        world.step()
        if step % SAMPLE:
            continue
        f, said, target = world.fleet, world.loop.advisory, world.loop.target
        height.append(f.state["altitude"].copy())
        bank.append(f.measurement["phi"].copy())
        if step % LOOK == 0:
            past = height[-back - 1:]
            rate = (past[-1] - past[0])/((len(past) - 1)*SAMPLE*world.dt)
            climb = np.maximum(rate, 0.0)/target["airspeed"]  # who sinks for want of power has no power to spare
            level, flown = required(world), required(world, climb, np.mean(bank[-back:], axis=0))
        for what, value in {**{error: world.task[f"{error}_error"] for error in ERRORS}, "level": level, "flown": flown,
                            "told": said["power_lacking"] > 0.5, "full": f.command["throttle_left"] > LEVER,
                            "raised": said["airspeed_limit"] + margin > target["airspeed"]}.items():
            kept[what].append(value.copy())
    if world.terminated.any():
        raise RuntimeError(f"{name}, {who}: {int(world.terminated.sum())} of {world.n} flights ended early")
    found = {what: np.array(rows) for what, rows in kept.items()}
    return Tracked({error: found.pop(error) for error in ERRORS}, **found)


def against(iced: FloatArray, clean: FloatArray, where: NDArray[np.bool_]) -> dict[str, float | None]:
    """Root mean square on ice over the clean one, less 1, over the samples `where`: mean and 95 % interval.

    Args:
        iced, clean: errors [samples, flights], the same gusts in each column.
    """
    there = where.any(axis=0)
    if not there.any():
        return {"mean": None, "low95": None, "high95": None}
    square, basis = ((np.where(where, e, 0.0)**2).sum(axis=0)[there] for e in (iced, clean))
    draw = np.random.default_rng(0).integers(0, len(square), (DRAWS, len(square)))
    low, high = np.quantile(np.sqrt(square[draw].sum(axis=1)/basis[draw].sum(axis=1)), (0.025, 0.975))
    return {"mean": math.sqrt(square.sum()/basis.sum()) - 1.0, "low95": float(low) - 1.0, "high95": float(high) - 1.0}


def compared(iced: Tracked, clean: Tracked) -> dict[str, Any]:
    """Figures by part of the time."""
    parts = {"all": np.ones_like(iced.told), "power suffices, level": iced.level < ENOUGH,
             "power suffices, flown": iced.flown < ENOUGH, "power lacks, level": iced.level >= ENOUGH}
    out: dict[str, Any] = {}
    for name, where in parts.items():
        shares = {what: float(values[where].mean()) if where.any() else None
                  for what, values in (("told", iced.told), ("full_power", iced.full), ("full_power_clean", clean.full),
                                       ("speed_raised", iced.raised))}
        out[name] = {"time": float(where.mean()), "flights": int(where.any(axis=0).sum()), **shares,
                     **{e: against(iced.errors[e], clean.errors[e], where) for e in ERRORS}}
    return out


def measure(quick: bool, say: Callable[[str], None]) -> dict[str, Any]:
    """Figures of the autopilot, the adapted autopilot and the oracle, by part of the time.

    Args:
        quick: few flights, on the seeds of development.
        say: called with what is flown next.
    """
    purpose, n = ("development", QUICK) if quick else ("report", FLIGHTS)
    seeds = [SEEDS[purpose] + i for i in range(n)]
    out: dict[str, Any] = {"flights": n, "seeds": purpose}
    for who in ("autopilot", "adapted", "oracle"):
        say(f"tracking, {who}")
        out[who] = compared(track("steps_iced", who, seeds), track("steps_clean", who, seeds))
    return out


def tables(found: dict[str, Any]) -> Iterator[tuple[str, dict[str, str], list[list[str]]]]:
    """Title, headers and rows of each controller's table."""
    def change(value: dict[str, float | None]) -> str:
        if value["mean"] is None:
            return "-"
        mean, low, high = (f"{round(100*(value[k] or 0.0)):+d}" for k in ("mean", "low95", "high95"))
        return f"{mean} ({low} to {high})"

    def share(value: float | None) -> str:
        return "-" if value is None else f"{100*value:.0f}"

    headers = {"part of the time": "left", "%": "right", **dict.fromkeys((f"{e}, %" for e in ERRORS), "right"),
               "told, %": "right", "full power, %": "right"}
    for who, parts in ((who, by) for who, by in found.items() if isinstance(by, dict)):
        rows = [[part, share(f["time"]), *(change(f[e]) for e in ERRORS), share(f["told"]), share(f["full_power"])]
                for part, f in parts.items()]
        yield (f"{who}, errors in steps: r.m.s. on ice over clean, {found['flights']} {found['seeds']} flights; "
               f"enough is below {100*ENOUGH:.0f} %", headers, rows)
