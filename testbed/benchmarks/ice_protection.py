"""Function 2 in figures: ice carried, inflations and energy, against boots and heat simply on while ice is detected.

`python -m testbed.benchmarks.ice_protection` prints the table of docs/controllers.md: the same encounters of twenty
minutes, by seed, under three ways of operating the same boots and heat, and with none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from icing_env import scenario
from icing_env.types import SURFACES
from icing_env.world import World
from testbed.flight import make_world

FloatArray = NDArray[np.float64]
BOOTED = ("left_wing", "right_wing", "htail", "vtail", "struts")
SWITCHES = ("boots_wing", "boots_tail", "boots_vtail_struts", "prop_heat")
FIRST_SEED = 52_000_000


def managed(world: World) -> None:
    """The ice management's own switches."""
    del world


def while_detected(world: World) -> None:
    """Boots held on (they cycle) and heat on while ice is detected in cold air."""
    f, a = world.fleet, world.loop.advisory
    tuning = world.loop.management_tuning  # type: ignore[attr-defined]
    cold = f.measurement["temperature"] < tuning["boots_temperature"]
    for name in SWITCHES:
        f.command[name] = a["ice_detected"]*cold


def never(world: World) -> None:
    """Nothing is switched on."""
    for name in SWITCHES:
        world.fleet.command[name] = 0.0


WAYS: dict[str, tuple[Callable[[World], None], bool, str]] = {  # switches, whose hand, how ice is sensed
    "none": (never, False, "drag"),
    "on while detected": (while_detected, False, "drag"),
    "managed, drag sensed": (managed, True, "drag"),
    "managed, characterised": (managed, True, "characterise"),
}


def fly(name: str, way: str, n: int, duration: float = 1200.0) -> dict[str, float]:
    """Means over `n` encounters of a scenario: eta of the wing and the propellers, ice mass, inflations, energy."""
    switch, boots, sense = WAYS[way]
    world = make_world(scenario.load(name, duration=duration), n, sense=sense)
    world.loop.boots = boots  # type: ignore[attr-defined]
    world.reset(seeds=[FIRST_SEED + i for i in range(n)])
    state, sums, count = world.fleet.state, np.zeros((4, n)), 0
    for step in range(world.limit):
        if not boots:
            switch(world)
        world.step()
        if step % 50 == 0:
            sums += [0.5*(state["eta_left_wing"] + state["eta_right_wing"]), state["eta_htail"],
                     state["eta_propeller"], sum(state[f"ice_mass_{s}"] for s in SURFACES)]
            count += 1
    wing, tail, propeller, mass = sums/count
    return {"eta_wing": float(wing.mean()), "eta_tail": float(tail.mean()), "eta_propeller": float(propeller.mean()),
            "ice_mass": float(mass.mean()), "inflations": float(state["boot_cycles"].mean()),
            "heat_energy": float(state["heat_energy"].mean()), "ended": float(world.terminated.mean())}


def study(n: int = 16, names: tuple[str, ...] = ("stratiform", "cumuliform")
          ) -> Iterator[tuple[str, str, dict[str, float]]]:  # fmt: skip
    """Every way in every scenario."""
    for name in names:
        for way in WAYS:
            yield name, way, fly(name, way, n)


if __name__ == "__main__":
    print("scenario, way: wing eta, tail eta, propeller eta, ice kg, inflations, heat kJ, ended early")
    for name, way, x in study():
        print(f"{name}, {way}: {x['eta_wing']:.4f}, {x['eta_tail']:.4f}, {x['eta_propeller']:.4f}, "
              f"{x['ice_mass']:.1f}, {x['inflations']:.1f}, {x['heat_energy']/1e3:.0f}, {x['ended']:.2f}", flush=True)
