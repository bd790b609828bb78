"""Drawn encounters with ice and turbulence: how often an aircraft stalls or departs, protected and not.

An encounter is 120 s of one of eight scenarios from a pre-iced start; in a ninth, `full_stick`, a pilot in stratiform
ice holds the stick nearly full back and to the right for 20 s. Drawn for each, by a generator of its own that
nothing else uses: an excess drag up to 0.06 that sets a severity common to the airframe, and each surface's share of
it; by the scenario: turbulence (sigma_w up to moderate), speed, and hazards of its own (the iced tailplane of the
approach, the iced propellers of the climb, the worse wing of the hold). The seeds of development and those of what is
reported lie apart.

The truth is read for scores alone, ten times a second:

* stalled: beyond the onset of the iced stall of the worse half wing for more than 1 s without a break
* departed: bank beyond 60 deg, or the flight ended in an upset, a structural failure or on the ground
* exceedances: share of the time beyond that onset, below the iced 1-g stall speed, beyond the limit loads or 60 deg
* interventions: share of the time at which the protection moves a surface, a lever or the flap; nuisance without ice
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env import scenario as scenarios
from icing_env.atmosphere import G0, GAS_CONSTANT
from icing_env.scenario import Scenario
from icing_env.types import SURFACES
from icing_env.world import World
from testbed.closed_loop import ClosedLoop
from testbed.comparison.flight_figures import BANK, LIMIT_LOAD, LIMIT_NEGATIVE_LOAD, TOUCHED

FloatArray = NDArray[np.float64]
DURATION = 120.0  # s
SIGMA_W = 3.1  # m/s, moderate: MIL-F-8785C figure 7 at 7500 ft
EXCESS_DRAG = 0.06  # largest excess drag drawn
SHARES = (0.7, 1.3)  # severity of a surface over the common one; assumed
# Excess drag per eta of each surface: UIUC AllIce 6.527 x 0.0488, split as in configs/ice/dhc6.toml.
DRAG = {"left_wing": 0.0382, "right_wing": 0.0382, "htail": 0.0096, "vtail": 0.0127, "struts": 0.051, "other": 0.1688}
SEEDS = {"development": 41_000_000, "report": 73_000_000}  # first seed; each scenario has a million of its own
ONSET_TIME = 1.0  # s
LOOK = 5  # steps between looks: 10 Hz

# The founding flight's first encounter without its minutes of clear air before it, doublets early in the episode, the
# boots in the hands of the ice management.
FLIGHT = {"ice_protection": "management", "events": [], "doublets_at": (10.0, 60.0),
          "cloud": [{"time": 0.0, "lwc": 3.5e-4, "mvd": 1.8e-5, "temperature": 268.15}]}
ENCOUNTERS: dict[str, dict[str, Any]] = {
    "clear_air": {}, "stratiform": {}, "flight_010302f1": FLIGHT, "holding_asymmetric": {}, "approach_tail_ice": {},
    "climb_propeller_ice": {}, "boot_failure": {}, "large_drops": {},
    "full_stick": {"base": "stratiform"},
}
STICK = (50.0, 70.0, -0.35, -0.2)  # s from and to, elevator and aileron [rad]: back and to the right, nearly all of it


class WatchedLoop(ClosedLoop):
    """The closed loop, and in `moved` whose controls the protection changed in this step."""

    pulled = False  # a pilot pulls and rolls for a while, whatever the ice

    def steer(self) -> None:
        """As `ClosedLoop.steer`; in "full_stick" the pilot takes over for a while."""
        super().steer()
        start, end, elevator, aileron = STICK
        if self.pulled:
            held = (self.measurement["time"] >= start) & (self.measurement["time"] < end)
            self._command["elevator"][held], self._command["aileron"][held] = elevator, aileron

    def limit(self) -> None:
        """As `ClosedLoop.limit`."""
        before = self._command.copy()
        super().limit()
        now = self._command
        self.moved = np.zeros(len(now), bool)
        for name in ("elevator", "aileron", "throttle_left", "throttle_right", "flap"):
            self.moved |= np.abs(now[name] - before[name]) > TOUCHED


@dataclass
class Tally:
    """What `n` encounters came to, an element each.

    Attributes:
        stalled, departed: did it.
        beyond, moved, alive: seconds of exceedance, of a control moved by the protection, flown.
        worst: least angle left to the onset of the iced stall [rad].
        when: time of the first stall or departure [s], NaN without.
        drawn: severity of every surface at the start, turbulence and seed, by name.
    """

    stalled: NDArray[np.bool_]
    departed: NDArray[np.bool_]
    beyond: FloatArray
    moved: FloatArray
    alive: FloatArray
    worst: FloatArray
    when: FloatArray
    drawn: dict[str, FloatArray] = field(default_factory=dict)


def encounter(name: str, duration: float = DURATION) -> Scenario:
    """The scenario of an encounter; turbulence is drawn with everything else."""
    changes = dict(ENCOUNTERS[name])
    return scenarios.load(changes.pop("base", name), duration=duration, **changes, randomise={
        "parameters": {"turbulence_sigma_w": {"low": 0.0, "high": SIGMA_W}}})


def world_of(name: str, n: int, duration: float = DURATION, **options: Any) -> World:
    """World of `n` encounters; options of `testbed.closed_loop.ClosedLoop`."""
    world = World(encounter(name, duration), n, lambda n, clean, dt: WatchedLoop(n, clean, dt, **options))
    world.loop.reveal(world.fleet)  # type: ignore[attr-defined]  # only an oracle looks
    world.loop.pulled = name == "full_stick"  # type: ignore[attr-defined]
    return world


def seeds_of(name: str, purpose: str, n: int) -> list[int]:
    """Seeds of `n` encounters, for "development" or for the "report"."""
    first = SEEDS[purpose] + 1_000_000*list(ENCOUNTERS).index(name)
    return list(range(first, first + n))


def severities(scenario: Scenario, seed: int) -> dict[str, float]:
    """Severity of every surface at the start of an encounter; none in clear air.

    The shares are scaled so that all together bring the drawn excess drag. Where the scenario itself draws a surface's
    severity, the larger of the two stands.
    """
    if scenario.name == "clear_air":
        return {}
    rng = np.random.Generator(np.random.Philox(key=np.array([seed, 0xE7C0], np.uint64)))
    drag = rng.uniform(0.0, EXCESS_DRAG)
    shares = rng.uniform(*SHARES, len(DRAG))
    common = drag/float(shares @ np.array(list(DRAG.values())))
    eta = {surface: common*share for surface, share in zip(DRAG, shares, strict=True)}
    for surface, span in scenario.randomise.eta.items():
        eta[surface] = max(eta.get(surface, 0.0), rng.uniform(span.low, span.high))
    return eta


def begin(world: World, seeds: list[int]) -> dict[str, FloatArray]:
    """Begin an encounter for every seed; returns what was drawn, by name."""
    drawn = {name: np.zeros(len(seeds)) for name in SURFACES}
    for i, seed in enumerate(seeds):
        eta = severities(world.scenario, seed)
        world.reset(np.array([i]), [seed], {"eta": eta})
        for surface, value in eta.items():
            drawn[surface][i] = value
    return drawn | {"turbulence": world.fleet.parameters["turbulence_sigma_w"].copy(), "seed": np.array(seeds, float)}


def onset(world: World) -> tuple[FloatArray, FloatArray]:
    """Angle left to the iced stall of the worse half wing [rad], and the 1-g speed at that stall [m/s]."""
    f = world.fleet
    c, p, m = f.current, f.parameters, f.measurement
    stall = np.minimum(c["alpha_stall_left"], c["alpha_stall_right"]) + p["alpha_stall_flap"]*f.state["flap"]
    lift = -(c["CZ_0"] + c["CZ_alpha"]*stall) + p["CL_flap"]*f.state["flap"]
    density = m["pressure"]/(GAS_CONSTANT*m["temperature"])
    speed = np.sqrt(2.0*c["mass"]*G0/(density*p["wing_area"]*np.maximum(lift, 0.1)))
    return stall - f.outcome["alpha"], speed


def fly(world: World, seeds: list[int]) -> Tally:
    """Fly an encounter for every seed, to its end or to that of its time."""
    drawn = begin(world, seeds)
    n, f, interval = len(seeds), world.fleet, LOOK*world.dt
    t = Tally(np.zeros(n, bool), np.zeros(n, bool), np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, np.inf),
              np.full(n, np.nan), drawn)
    run, ended = np.zeros(n), np.zeros(n, bool)
    for step in range(world.limit):
        world.step()
        ended |= world.terminated
        if step % LOOK:
            continue
        left, slow = onset(world)
        load, bank = f.outcome["load_factor"], np.abs(f.measurement["phi"])
        well, flying = ~(t.stalled | t.departed), ~ended
        run = np.where(left < 0.0, run + interval, 0.0)
        t.stalled |= (run > ONSET_TIME) & flying
        t.departed |= ended | (bank > BANK)
        t.when[well & (t.stalled | t.departed)] = step*world.dt
        beyond = ((left < 0.0) | (f.outcome["airspeed"] < slow) | (load > LIMIT_LOAD) | (load < LIMIT_NEGATIVE_LOAD)
                  | (bank > BANK))
        t.beyond += interval*(beyond & flying)
        t.moved += interval*(world.loop.moved & flying)  # type: ignore[attr-defined]
        t.alive += interval*flying
        t.worst = np.where(flying, np.minimum(t.worst, left), t.worst)
        if ended.all():
            break
    return t
