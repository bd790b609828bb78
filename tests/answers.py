"""Flights for the tests of control laws: steps of pitch or bank with perfect instruments, the aircraft changed."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from icing_env import scenario as scenarios
from testbed.flight import make_world

DT = 0.02
STEP = {"pitch": np.radians(3.0), "bank": np.radians(20.0), "hold": 0.0}


def answer(law: str, axis: str, parameters: dict | None = None, *, later: dict | None = None,
           memory: dict | None = None, limits: dict | None = None, seconds: float = 10.0,
           asked: float | None = None) -> dict[str, NDArray]:
    """What an aircraft does when pitch or bank is asked for from 2 s to 6 s.

    Args:
        law: name in `controllers.choice.LAWS`.
        axis: "pitch", "bank", or "hold" for neither.
        parameters: numbers of the true aircraft that differ from those believed.
        later: the same, from 2 s on.
        memory: fields of the law's memory after the first step.
        limits: fields of the advisory.
        asked: size of the step [rad] instead of STEP.

    Returns:
        `theta`, `phi` beyond those at 2 s, `alpha`, `elevator`, `aileron` commanded; a number for each step.
    """
    return _fly(law, axis, *(tuple((d or {}).items()) for d in (parameters, later, memory, limits)), seconds,
                STEP[axis] if asked is None else asked)


@cache
def _fly(law: str, axis: str, parameters: tuple, later: tuple, memory: tuple, limits: tuple, seconds: float,
         asked: float) -> dict[str, NDArray]:
    scenario = scenarios.load("steps_clean").model_copy(update={
        "parameters": {"turbulence_sigma_w": 0.0, **dict(parameters)}, "instruments": "perfect",
        "ice_protection": "off", "task": scenarios.Task(kind="hold")})
    world = make_world(scenario, 1, law, protection=False, observer=False)
    world.reset(seeds=[1])
    m, target = world.fleet.measurement, world.loop.target
    for name, value in limits:
        world.loop.advisory[name] = value
    out: dict[str, list[float]] = {name: [] for name in ("theta", "phi", "alpha", "elevator", "aileron")}
    start = float(m["theta"][0])
    for k in range(round(seconds/DT)):
        now = asked if 2.0 <= k*DT < 6.0 else 0.0
        target["pitch_mode"], target["theta"] = 0.0, start + (now if axis == "pitch" else 0.0)
        target["roll_mode"], target["phi"] = 0.0, now if axis == "bank" else 0.0
        if k*DT == 2.0:
            for name, value in later:
                world.fleet.parameters[name] = value
        world.step()
        if k == 0:
            for name, value in memory:
                world.loop.law[name] = value
        for name in ("theta", "phi", "alpha"):
            out[name].append(float(m[name][0]))
        for name in ("elevator", "aileron"):
            out[name].append(float(world.fleet.command[name][0]))
    flown = {name: np.array(values) for name, values in out.items()}
    flown["theta"] -= start
    return flown


def apart(one: dict[str, NDArray], other: dict[str, NDArray]) -> float:
    """How far two flights are apart in pitch and bank [rad, r.m.s.]."""
    return float(np.sqrt(np.mean((one["theta"] - other["theta"])**2 + (one["phi"] - other["phi"])**2)))
