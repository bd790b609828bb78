"""A batch of holds in ice, one aircraft a seed, each in the very cloud that another of its seed met."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.atmosphere import temperature
from icing_env.scenario import PRESCRIBED, Scenario
from icing_env.tasks import REASONS
from icing_env.world import World
from testbed.environments import loop_factory

Cloud = tuple[NDArray[np.float64], NDArray[np.float64]]  # water kg/m3 and drop diameter m, each (seconds, aircraft)
NONE, LIMITS, ALL = "no protection", "limits alone", "boots and limits"
LOOPS: dict[str, dict[str, Any]] = {
    NONE: {"observer": False, "management": False, "protection": False},
    LIMITS: {"boots": False},
    ALL: {},
}  # fmt: skip


@dataclass(frozen=True)
class Fleet:
    """How one way of protecting ended, by seed, each (n,).

    Attributes:
        lost_at: when the flight ended early, s; nan where it did not.
        reason: why, "" where it did not.
        margin: least distance of the true angle of attack from the onset of separation, rad; negative: stalled.
        airspeed: lowest, m/s.
        descent: altitude given up at the lowest point, m.
        eta: largest wing severity.
    """

    lost_at: NDArray[np.float64]
    reason: list[str]
    margin: NDArray[np.float64]
    airspeed: NDArray[np.float64]
    descent: NDArray[np.float64]
    eta: NDArray[np.float64]

    @property
    def lost(self) -> int:
        """Number of aircraft lost."""
        return int(np.isfinite(self.lost_at).sum())


def stall_margin(current: NDArray, outcome: NDArray) -> NDArray[np.float64]:
    """True angle of attack below the onset of separation on the worse wing, rad, flap up."""
    return np.minimum(current["alpha_stall_left"], current["alpha_stall_right"]) - outcome["alpha"]


def fly_fleet(hold: Scenario, seeds: list[int], protection: str, cloud: Cloud | None = None) -> tuple[Fleet, Cloud]:
    """Fly one aircraft per seed to the end, protected as LOOPS says; what happens after a loss does not count.

    With `cloud` every aircraft meets, second by second, the water and drops that another of its seed met; the
    temperature is that of its own altitude. Returns the fleet and the cloud met, (seconds, n) each.
    """
    n = len(seeds)
    prescribed = {**hold.parameters, **({"cloud_mode": PRESCRIBED} if cloud else {})}
    world = World(hold.model_copy(update={"parameters": prescribed}), n, loop_factory(**LOOPS[protection]))
    world.reset(seeds=seeds)
    f = world.fleet
    lost_at, reason, start = np.full(n, np.nan), [""] * n, f.state["altitude"].copy()
    margin, airspeed = np.full(n, np.inf), np.full(n, np.inf)
    descent, eta = np.zeros(n), np.zeros(n)
    second = round(1.0/world.dt)
    met = np.zeros((2, world.limit//second + 1, n))
    for k in range(world.limit):
        if cloud is not None and k % second == 0:
            f.state["lwc"], f.state["mvd"] = cloud[0][k//second], cloud[1][k//second]
            f.state["temperature"] = [temperature(h) for h in f.state["altitude"]]
            f.state["temperature"] += hold.parameters["temperature_offset"]
        world.step()
        if k % second == 0:
            met[:, k//second] = f.state["lwc"], f.state["mvd"]
        ended = world.terminated & np.isnan(lost_at)
        if k % 5 == 0 or ended.any():
            flying = np.isnan(lost_at)
            np.minimum(margin, stall_margin(f.current, f.outcome), out=margin, where=flying)
            np.minimum(airspeed, f.outcome["airspeed"], out=airspeed, where=flying)
            np.maximum(descent, start - f.state["altitude"], out=descent, where=flying)
            np.maximum(eta, 0.5*(f.state["eta_left_wing"] + f.state["eta_right_wing"]), out=eta, where=flying)
        for i in np.flatnonzero(ended):
            lost_at[i], reason[i] = (k + 1)*world.dt, REASONS[int(world.task["reason"][i])]
    return Fleet(lost_at, reason, margin, airspeed, descent, eta), (met[0], met[1])
