"""Boots that work and boots that do not: pre-iced fleets inflate twice, and the characteriser says what it saw."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.characterise import online
from estimators.characterise.clean import clean_from
from estimators.characterise.features import features
from estimators.characterise.model import PARTS
from icing_env.accretion import glaze_of
from icing_env.types import SURFACES
from testbed.characterisation.dataset import SEEDS, TURBULENCE
from testbed.characterisation.flights import CALM, SET, make_world

FloatArray = NDArray[np.float64]
FIRST, SECOND = SET + 70.0, SET + 70.0 + 180.0  # s: inflations; a doublet set is flown before and after each
END = SECOND + 60.0
BOOTED = PARTS[:3]


def fly(n: int, turbulence: str, character: online.Character, seed: int, own: bool = True,
        threads: int = 2) -> tuple[NDArray[np.bool_], NDArray[np.void]]:
    """Which boots had failed [n, 3], and the SEVERITY rows at the end; a quarter of the fleet has nothing failed."""
    starts = (2.0, SET + 20.0, FIRST + 5.0, SECOND - 50.0, SECOND + 5.0)
    world = make_world(n, END, starts, threads)
    world.reset(seeds=[seed*1_000_000 + i for i in range(n)])
    rng = np.random.Generator(np.random.Philox(key=np.array([seed, 3], np.uint64)))
    fleet, clean = world.fleet, clean_from(world.clean)
    broken = np.arange(n)[:, None] % 4 == np.arange(3)[None]
    for i, part in enumerate(BOOTED):
        fleet.parameters[f"boot_failed_{part}"] = broken[:, i]
    fleet.parameters["turbulence_sigma_w"] = 0.5*CALM
    memory, severity = online.init(n)
    eta = rng.uniform(0.06, 0.14, n)[:, None]*rng.uniform(0.8, 1.2, (n, len(SURFACES)))
    for step in range(round(END/world.dt)):
        now = step*world.dt
        if step == round(SET/world.dt):
            values = features(memory.evidence, world.loop.estimate, clean)
            memory, severity = online.init(n)
            if own:
                online.refer(memory, values)
            for k, surface in enumerate(SURFACES):
                if surface != "propeller":
                    thickness, _mass = glaze_of(eta[:, k], fleet.parameters, surface)
                    fleet.state[f"eta_{surface}"], fleet.state[f"thickness_{surface}"] = eta[:, k], thickness
            fleet.parameters["turbulence_sigma_w"] = TURBULENCE[turbulence]
        shot = any(at <= now < at + 2.0 for at in (FIRST, SECOND))
        for boot in ("boots_wing", "boots_tail"):
            fleet.command[boot] = float(shot)
        world.step()
        online.step(memory, severity, world.loop.estimate, fleet.measurement, fleet.command, clean, character, world.dt)
    return broken, severity


def evaluate(character: online.Character, n: int, turbulence: str = "light", threads: int = 2) -> dict[str, Any]:
    """Shares of failed and of working boots that are told as such, and of those left unclear."""
    broken, severity = fly(n, turbulence, character, SEEDS["test_detection"] + 30, threads=threads)
    p = np.stack([severity[f"p_failed_{part}"] for part in BOOTED], axis=1)
    return {"boots": int(broken.size), "failed_recognised": float((p[broken] > 0.5).mean()),
            "working_recognised": float((p[~broken] < 0.05).mean()), "false_failures": float((p[~broken] > 0.5).mean())}
