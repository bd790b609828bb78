"""Simulated flights for the characteriser: each aircraft first clean, as its own reference, then with known ice.

Every aircraft is one of a fleet: each derivative drawn within 5 %, mass within 3 % and c.g. within 4 cm of what is
believed, propellers within 2 %, a little rolled and yawed by its rigging. The reference is a doublet set in nearly calm
air; then fuel, speed, ice and turbulence are drawn anew and the sets that are judged follow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.characterise import evidence as evidence_of
from estimators.characterise.clean import clean_from
from estimators.characterise.features import features
from estimators.characterise.tuning import Tuning, load_tuning
from icing_env import aircraft, scenario
from icing_env.types import DERIVATIVE_NAMES, SURFACES
from icing_env.world import World
from testbed.environments import loop_factory
from testbed.oracle import zero_lift_drag

FloatArray = NDArray[np.float64]
SPREAD = 0.05  # of each derivative about its published value: uniform (assumed)
SET = 44.0  # s: one doublet set and its end
SETTLE = 25.0  # s between the reference and the first judged window: speed and trim settle
READINGS = (16.0, 30.0, SET)  # s into a window: after one elevator doublet, after both and the aileron's, at its end
LONG_READINGS = (20.0, 50.0, 120.0)  # s into a window without doublets, as in a flight that goes on
CALM = 0.25  # m/s, largest sigma_w of a reference flight
COLD, ICING = (-20.0, -10.0), (-9.0, -5.0)  # K off standard: ice stays; clouds hold water (both assumed)


@dataclass(frozen=True)
class Plan:
    """What a fleet flies: ice by surface [n, 7], sigma_w [n] m/s, doublets or not, judged windows."""

    eta: FloatArray
    sigma_w: FloatArray
    doublets: bool = True
    windows: int = 1


@dataclass(frozen=True)
class Flown:
    """What it showed.

    Attributes:
        reference: features of the clean window [n, features].
        features: of each judged window at each of READINGS [n, windows, readings, features].
        truth: eta by surface [n, 7] as it was; excess_drag [n] and slope_lost [n], share of CL_alpha.
        sigma_w: [n], m/s.
        good: [n], flights that did not end before their time and stayed below the stall.
    """

    reference: FloatArray
    features: FloatArray
    eta: FloatArray
    excess_drag: FloatArray
    slope_lost: FloatArray
    sigma_w: FloatArray
    good: NDArray[np.bool_]


def fleet_draws(temperature: tuple[float, float] = COLD) -> dict[str, dict[str, float]]:
    """Ranges of what differs between the aircraft of the type, and of the air's temperature off standard [K]."""
    clean = aircraft.load()[0]
    draws = {}
    for name in DERIVATIVE_NAMES:
        low, high = sorted((float(clean[name])*(1.0 - SPREAD), float(clean[name])*(1.0 + SPREAD)))
        draws[name] = {"low": low, "high": high}
    for name, spread in (("mass", 0.03), ("propeller_efficiency", 0.02), ("Cm_alpha_tail", 0.1), ("Cm_alphadot", 0.1)):
        low, high = sorted((float(clean[name])*(1.0 - spread), float(clean[name])*(1.0 + spread)))
        draws[name] = {"low": low, "high": high}
    draws |= {name: {"low": -size, "high": size} for name, size in (("cg_shift_x", 0.04), ("Cl_0", 5e-4),
                                                                     ("Cn_0", 5e-4))}
    draws["temperature_offset"] = {"low": temperature[0], "high": temperature[1]}
    return draws


def make_world(n: int, duration: float, starts: tuple[float, ...], threads: int) -> World:
    """Fleet on autopilot in clear air with doublet sets at `starts`, observed, with nobody managing the ice."""
    flown = scenario.load(
        "clear_air", duration=duration, ice_protection="off", task={"kind": "hold"}, doublets_at=starts,
        randomise={"initial": {"airspeed": {"low": 64.0, "high": 80.0}, "altitude": {"low": 1500.0, "high": 3000.0}},
                   "parameters": fleet_draws()})
    loop = loop_factory(observer=True, management=False, protection=False, boots=False)
    return World(flown, n, loop, mode=None, threads=threads)


class Watch:
    """Evidence beside a world that is flown: gathers at every step, reads when asked, starts anew when told."""

    def __init__(self, world: World, tuning: Tuning) -> None:
        self.world, self.tuning, self.clean = world, tuning, clean_from(world.clean)
        self.evidence = evidence_of.init(world.n)
        self.stalled = np.zeros(world.n, bool)
        self._fresh = world.loop.memory()["observer"].copy()

    def fly(self, seconds: float) -> None:
        """Fly on and gather."""
        world, fleet, tuning = self.world, self.world.fleet, self.tuning
        for _ in range(round(seconds/world.dt)):
            world.step()
            evidence_of.step(self.evidence, fleet.measurement, self.clean, world.dt, tuning.memory,
                             tuning.shift_memory)
            stall = np.minimum(fleet.current["alpha_stall_left"], fleet.current["alpha_stall_right"])
            self.stalled |= (fleet.outcome["alpha"] > stall) | world.terminated

    def read(self) -> FloatArray:
        """Features now."""
        return features(self.evidence, self.world.loop.estimate, self.clean)

    def forget(self) -> None:
        """Observer and evidence begin anew."""
        self.evidence = evidence_of.init(self.world.n)
        self.world.loop.memory()["observer"][:] = self._fresh
        self.stalled[:] = False


def fly(plan: Plan, seed: int, threads: int = 2) -> Flown:
    """Fly a plan; the same seed and plan, the same features."""
    n = len(plan.sigma_w)
    at = READINGS if plan.doublets else LONG_READINGS
    starts = (2.0, *(SET + SETTLE + k*SET + 2.0 for k in range(plan.windows if plan.doublets else 0)))
    world = make_world(n, SET + SETTLE + at[-1]*plan.windows + 1.0, starts, threads)
    world.reset(seeds=[seed*1_000_000 + i for i in range(n)])
    rng = np.random.Generator(np.random.Philox(key=np.array([seed, 77], np.uint64)))
    parameters, state = world.fleet.parameters, world.fleet.state
    parameters["turbulence_sigma_w"] = rng.uniform(0.0, CALM, n)
    watch = Watch(world, load_tuning())
    watch.fly(SET)
    reference = watch.read()
    stray = watch.stalled.copy()
    parameters["mass"] *= rng.uniform(0.98, 1.01, n)
    parameters["turbulence_sigma_w"] = plan.sigma_w
    world.task["start_airspeed"] += rng.uniform(-5.0, 5.0, n)
    for k, surface in enumerate(SURFACES):
        state[f"eta_{surface}"] = plan.eta[:, k]
    watch.fly(SETTLE)
    kept = []
    for _ in range(plan.windows):
        watch.forget()
        readings = []
        for now, before in zip(at, (0.0, *at), strict=False):
            watch.fly(now - before)
            readings.append(watch.read())
        stray |= watch.stalled
        kept.append(np.stack(readings, axis=1))
    drag, lost = truth_of(world)
    eta = np.stack([state[f"eta_{surface}"] for surface in SURFACES], axis=1)
    return Flown(reference, np.stack(kept, axis=1), eta, drag, lost, plan.sigma_w, ~stray)


def truth_of(world: World) -> tuple[FloatArray, FloatArray]:
    """Excess drag at zero lift and lost share of CL_alpha [n], against each aircraft's own clean numbers."""
    now, own = world.fleet.current, world.fleet.parameters
    drag = zero_lift_drag(now) + now["CD_parasite"] - zero_lift_drag(own) - own["CD_parasite"]
    return drag, 1.0 - (now["CX_0"] - now["CZ_alpha"])/(own["CX_0"] - own["CZ_alpha"])
