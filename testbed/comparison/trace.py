"""A batch of episodes flown to the end, with what scoring needs of them ten times a second.

The truth in here is for scores alone; observer and controllers have had their turn when it is read.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from icing_env.atmosphere import G0, GAS_CONSTANT
from icing_env.tasks import REASONS
from icing_env.types import SURFACES
from icing_env.world import World
from testbed.comparison.modal import modal
from testbed.oracle import quasi_steady

FloatArray = NDArray[np.float64]
COEFFICIENTS = ("CX_0", "CX_alpha", "CX_alpha2", "CZ_0", "CZ_alpha", "CZ_q", "CZ_elevator", "Cm_alpha", "Cm_q",
                "Cm_elevator", "CD_parasite", "mass")  # fmt: skip
SAMPLES = {
    "outcome": ("alpha", "airspeed", "load_factor"),
    "measurement": ("phi", "pressure", "temperature"),
    "current": ("alpha_stall_left", "alpha_stall_right", "efficiency", *COEFFICIENTS),
    "state": ("flap", "boot_cycles", "heat_energy", *(f"ice_mass_{s}" for s in SURFACES)),
    "advisory": ("severity", "ice_detected", "intervention", "intervention_aileron"),
    "task": ("altitude_error", "airspeed_error", "heading_error"),
    "command": ("elevator", "aileron", "rudder"),
}
INTERVAL = 0.1  # s


@dataclass(frozen=True)
class Trace:
    """What `n` episodes went through.

    Attributes:
        time: [samples], s.
        values: channels by name [samples, n]; `command_` before those of the command.
        alive: [samples, n], False after an episode's end.
        reason: why each ended early, "" if it did not [n].
        stepped: the task asked for steps of altitude and heading.
        modal: of `testbed.comparison.modal` [n].
    """

    time: FloatArray
    values: dict[str, FloatArray]
    alive: NDArray[np.bool_]
    reason: tuple[str, ...]
    stepped: bool = False
    modal: dict[str, FloatArray] = field(default_factory=dict)

    def __getitem__(self, name: str) -> FloatArray:
        return self.values[name]


def trace(world: World, seeds: list[int]) -> Trace:
    """Fly the world's scenario to its end, one episode per seed, and derive the truth about ice."""
    world.reset(seeds=seeds)
    if world.mode is not None:
        world.action[:] = 0.0
    every = round(INTERVAL/world.dt)
    samples = world.limit//every + 1
    f = world.fleet
    sources = {"outcome": f.outcome, "measurement": f.measurement, "current": f.current, "state": f.state,
               "advisory": world.loop.advisory, "task": world.task, "command": f.command}
    kept = {(kind, name): np.zeros((samples, world.n)) for kind, names in SAMPLES.items() for name in names}
    alive = np.zeros((samples, world.n), bool)
    ended = np.zeros(world.n, bool)
    reason = np.zeros(world.n, int)
    for step in range(world.limit + 1):
        if step % every == 0:
            for (kind, name), array in kept.items():
                array[step//every] = sources[kind][name]
            alive[step//every] = ~ended
        if step == world.limit or ended.all():
            break
        world.step()
        new = world.terminated & ~ended
        if new.any():
            reason[new] = world.task["reason"][new]
            ended |= new
    flown = step//every + 1
    values = {f"command_{name}" if kind == "command" else name: array[:flown] for (kind, name), array in kept.items()}
    return Trace(np.arange(flown, dtype=np.float64)*INTERVAL, values | _ice(values, world), alive[:flown],
                 tuple(REASONS[k] for k in reason), world.scenario.task.kind == "steps", modal(world, ~ended))


def rms(values: FloatArray, t: Trace, i: int) -> float:
    """Root mean square while the flight lasts."""
    return float(np.sqrt(np.mean(values[t.alive[:, i]]**2)))


def _ice(values: dict[str, FloatArray], world: World) -> dict[str, FloatArray]:
    """Excess drag, shares of lift slope, elevator power and thrust lost, margin to stall, ice mass [samples, n]."""
    clean, true = world.clean[0], world.fleet.parameters
    truth = {name: values[name] for name in COEFFICIENTS} | {"density": np.ones_like(values["mass"])}
    now = quasi_steady(truth, clean)
    basis = {name: np.full(1, clean[name]) for name in COEFFICIENTS} | {"density": np.ones(1)}
    before = quasi_steady(basis, clean)
    stall = (np.minimum(values["alpha_stall_left"], values["alpha_stall_right"])
             + true["alpha_stall_flap"]*values["flap"])
    lift = -(values["CZ_0"] + values["CZ_alpha"]*stall) + true["CL_flap"]*values["flap"]
    density = values["pressure"]/(GAS_CONSTANT*values["temperature"])
    return {
        "bank": values["phi"],
        # the 1-g stall at the onset of separation, quasi-steady lift (Anderson, Aircraft Performance and Design, 2.9)
        "stall_speed": np.sqrt(2.0*values["mass"]*G0/(density*true["wing_area"]*np.maximum(lift, 0.1))),
        "excess_drag": now["quasi_CD_0"] - before["quasi_CD_0"],
        "slope_lost": 1.0 - now["quasi_CL_alpha"]/before["quasi_CL_alpha"],
        "elevator_lost": 1.0 - values["Cm_elevator"]/clean["Cm_elevator"],
        "thrust_lost": 1.0 - values["efficiency"],
        "alpha_margin": stall - values["alpha"],
        "ice_mass": sum((values[f"ice_mass_{s}"] for s in SURFACES), np.zeros_like(values["alpha"])),
    }
