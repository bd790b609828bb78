"""Fly a scenario from start to end and keep what was measured, believed, advised and true.

The record holds measurements and commands only; the truth goes into tables of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers import policies
from controllers.choice import LAWS
from icing_env.atmosphere import density
from icing_env.errors import InputError, nearest
from icing_env.record import COLUMNS, FlightRecord, Geometry, RecordMeta
from icing_env.scenario import Scenario
from icing_env.tasks import REASONS
from icing_env.types import CURRENT_FIELDS, MEASUREMENT_FIELDS, OUTCOME_FIELDS, SURFACES
from icing_env.world import World
from testbed.environments import loop_factory, reveal
from testbed.oracle import quasi_steady, zero_lift_drag
from testbed.piloted import Piloted

COMMANDS = ("elevator", "aileron", "rudder")
SWITCHES = ("boots_wing", "boots_tail", "boots_vtail_struts", "prop_heat")
RATE = {"(10 Hz)": 0.1, "(1 Hz)": 1.0}  # s between samples of the slow channels
TRUTH_STATES = ("gust_u", "gust_v", "gust_w", "gust_p", "gust_q", "gust_r", "lwc", "mvd", "temperature", "boot_cycles",
                *(f"{what}_{surface}" for what in ("eta", "thickness", "ice_mass") for surface in SURFACES))


@dataclass(frozen=True)
class Controller:
    """Who flies: a name, what it is, and what closes the loop."""

    name: str
    description: str
    kind: str  # classical, adaptive, learned, oracle
    law: str | None  # of controllers.choice.LAWS, flies the task; None: the controls stay where the trim put them
    episodes: int = 1_000_000  # most that a comparison flies; fewer for a controller that takes long
    adaptation: bool = False  # between the law and the protection: clean-like flying qualities from the estimate
    estimator: str = "hinf"  # of estimators.observer.choice, or "oracle"
    sense: str = "drag"  # of testbed.sensing.SENSES

    policies: tuple[str, ...] = ()  # of controllers.policies, one for each training seed; they fly instead of the law

    @property
    def members(self) -> tuple[str, ...]:
        """Names that fly under this one: itself, or the policies of its training seeds."""
        return self.policies or (self.name,)


def _learned() -> dict[str, Controller]:
    """The policies that come with the project, those of one configuration under one name."""
    groups: dict[str, tuple[str, ...]] = {}
    for name in policies.policies():
        group = name.rstrip("0123456789").rstrip("_")
        groups[group] = (*groups.get(group, ()), name)
    return {group: Controller(group, f"learned, {len(names)} training seeds", "learned", None, policies=names)
            for group, names in groups.items()}


CONTROLLERS = {name: Controller(name, law.description, law.kind, name, law.episodes) for name, law in LAWS.items()} | {
    "hands_off": Controller("hands_off", "controls held at the trim", "classical", None),
    "adapted": Controller("adapted", "autopilot, adapted by what observer and characteriser find", "adaptive",
                          "autopilot", adaptation=True, sense="characterise"),
    "oracle": Controller("oracle", "autopilot, adapted and protected by one who knows the true ice", "oracle",
                         "autopilot", adaptation=True, estimator="oracle"),
} | _learned()


@dataclass(frozen=True)
class Flight:
    """One flight.

    Attributes:
        record: what was measured and commanded.
        truth: true values by name [samples]; never shown to an estimator or a controller.
        estimate, advisory: what the observer believed and the ice management said, by name [samples].
        reason: why it ended early, "" if it did not.
    """

    record: FlightRecord
    truth: dict[str, NDArray[np.float64]]
    estimate: NDArray[Any]
    advisory: NDArray[Any]
    reason: str


def controller(name: str) -> Controller:
    """The controller of that name, or of one of its training seeds; InputError names the nearest."""
    for group in CONTROLLERS.values():
        if name in group.policies:
            return replace(group, name=name, policies=(name,))
    if name not in CONTROLLERS:
        raise InputError(f"no controller '{name}': {nearest(name, list(CONTROLLERS))}")
    return CONTROLLERS[name]


def make_world(scenario: Scenario, n: int = 1, who: str = "autopilot", protection: bool = True,
               observer: bool = True, threads: int = 1, *, law: str | None = None, shield: str = "surfaces",
               sense: str | None = None, adaptation: bool | None = None, estimator: str | None = None) -> World:
    """World in which a controller flies a scenario, with or without ice management and protection.

    Args:
        scenario, n, threads: as in `World`.
        who: name in CONTROLLERS.
        protection: ice management and envelope protection on.
        observer: estimator in the loop.
        law, sense, adaptation, estimator: instead of the controller's own.
        shield: how limits are kept, by its name in `controllers.choice.PROTECTIONS`.
    """
    pilot = controller(who)
    boots = scenario.ice_protection == "management"
    chosen = estimator or pilot.estimator
    loop = loop_factory(observer=observer, management=protection, protection=protection, boots=boots and protection,
                        law=law or pilot.law or "autopilot", shield=shield, sense=sense or pilot.sense,
                        adaptation=pilot.adaptation if adaptation is None else adaptation, estimator=chosen)
    if pilot.policies and law is None:
        return Piloted(policies.load(pilot.policies[0]), scenario, n, loop, threads=threads)
    world = World(scenario, n, loop, mode="surfaces" if pilot.law is None and law is None else None, threads=threads)
    return reveal(world)


def fly(scenario: Scenario, who: str = "autopilot", seed: int = 0, *, protection: bool = True, observer: bool = True,
        rate: float | None = None, windows: Sequence[tuple[float, float]] | None = None,
        progress: Callable[[int], None] | None = None) -> Flight:
    """Fly one scenario.

    Args:
        scenario: of `icing_env.scenario.load`.
        who: name in CONTROLLERS.
        seed: of everything drawn.
        protection: ice management and envelope protection on.
        observer: estimator in the loop.
        rate: samples kept per second; the step's own (50) if omitted.
        windows: (start, end) [s] of the samples kept; all if omitted. A long flight fits in memory that way.
        progress: called with the number of steps flown, now and then.

    Returns:
        The flight, up to its end or to the step that ended it.

    Raises:
        InputError: unknown controller, or a rate that does not divide that of the step.
    """
    world = make_world(scenario, 1, who, protection, observer)
    keep = _samples(world, rate, windows)
    world.reset(seeds=[seed])
    if world.mode is not None:
        world.action[:] = 0.0
    f = world.fleet
    sources = {"measurement": f.measurement, "command": f.command, "state": f.state, "current": f.current,
               "outcome": f.outcome, "estimate": world.loop.estimate, "advisory": world.loop.advisory}
    kept = {name: np.zeros(int(keep.sum()), array.dtype) for name, array in sources.items()}
    count = 0
    for step in range(world.limit + 1):
        if keep[step]:
            for name, array in sources.items():
                kept[name][count] = array[0]
            count += 1
        if step == world.limit or world.terminated[0]:
            break
        world.step()
        if progress is not None and step % 500 == 0:
            progress(step)
    kept = {name: array[:count] for name, array in kept.items()}
    truth = _truth(kept, world)
    return Flight(_record(kept, world, seed), truth, kept["estimate"], kept["advisory"],
                  REASONS[int(world.task["reason"][0])])


def _samples(world: World, rate: float | None, windows: Sequence[tuple[float, float]] | None) -> NDArray[np.bool_]:
    """Which steps of a flight are kept."""
    steps = np.arange(world.limit + 1)
    keep = steps % _every(rate, world.dt) == 0
    if windows is not None:
        keep &= np.any([(steps*world.dt >= start) & (steps*world.dt <= end) for start, end in windows], axis=0)
    return keep


def _every(rate: float | None, dt: float) -> int:
    every = 1 if rate is None else round(1.0/(rate*dt))
    if every < 1 or (rate is not None and abs(every*dt*rate - 1.0) > 1e-9):
        raise InputError(f"rate must divide {1.0/dt:g} Hz: 50, 25, 10, 5, 2 or 1; got {rate}")
    return every


def _record(kept: dict[str, NDArray[Any]], world: World, seed: int) -> FlightRecord:
    """Measurements and commands as a flight record; slow channels are blank between their samples."""
    time = kept["measurement"]["time"].copy()
    channels = {"time": time}
    for name, _unit, meaning in MEASUREMENT_FIELDS[1:]:
        if name in COLUMNS:
            channels[name] = kept["measurement"][name].astype(np.float64)
            for mark, period in RATE.items():
                if mark in meaning:
                    channels[name][~_sampled(time, period)] = np.nan
    for surface in COMMANDS:
        channels[f"{surface}_command"] = kept["command"][surface].astype(np.float64)
    for switch in SWITCHES:
        channels[switch] = (kept["command"][switch] > 0.5).astype(np.float64)
    p, s = world.clean[0], world.scenario
    meta = RecordMeta(
        aircraft=s.aircraft, flight=s.name, mass=float(p["mass"]), cg=(0.0, 0.0, 0.0),
        inertia=tuple(float(p[f"inertia_{a}"]) for a in ("xx", "yy", "zz", "xz")),  # type: ignore[arg-type]
        sensors=_sensors(p, world.dt), notes=f"simulated: scenario {s.name}, seed {seed}", name=s.name,
        geometry=Geometry(float(p["wing_area"]), float(p["span"]), float(p["chord"])))
    return FlightRecord(channels=channels, meta=meta)


def _sensors(p: Any, dt: float) -> dict[str, Any]:
    """What calibration knows of the instruments, as a record's side file declares it.

    Lags as a slow change shows them: a lag that takes in the newest value once a step is late by dt (1 - g)/g.
    """
    lags = {"alpha": p["vane_lag"], "beta": p["vane_lag"], "airspeed": p["pitot_lag"],
            "filter": 1.0/(2.0*np.pi*p["filter_frequency"])}
    known: dict[str, Any] = {name: {"lag": float(dt/np.expm1(dt/max(lag, 1e-4)))} for name, lag in lags.items()}
    known["thrust"] = {"source": "measured"}  # true, but for noise and a scale (icing_env.sensors)
    known["alpha"]["bending"] = float(p["boom_gain"])
    return known


def _sampled(time: NDArray[np.float64], period: float) -> NDArray[np.bool_]:
    phase = time/period
    return np.abs(phase - np.round(phase)) < 1e-6


def _truth(kept: dict[str, NDArray[Any]], world: World) -> dict[str, NDArray[np.float64]]:
    """True air data, coefficients, ice and gusts by name."""
    out = {"time": kept["measurement"]["time"].copy()}
    out |= {f"true_{name}": kept["outcome"][name].copy() for name, _, _ in OUTCOME_FIELDS}
    out |= {name: kept["current"][name].copy() for name, _, _ in CURRENT_FIELDS if not name.startswith("per_")}
    out |= {name: kept["state"][name].copy() for name in TRUTH_STATES}
    out["density"] = np.array([density(h) for h in kept["state"]["altitude"]])
    out |= quasi_steady(out, world.true[0])
    clean = world.clean[0]
    out["excess_CD_0"] = out["quasi_CD_0"] - zero_lift_drag(clean) - clean["CD_parasite"]
    return out

