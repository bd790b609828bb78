"""How fast the testbed is, beside a peer in the same run: `icing benchmark speed`.

Medians over many short chunks, since machines are noisy; all figures are of one thread. The peer is JSBSim's DHC6 as a
Gym environment steps it: 4 property writes, 2 runs of 10 ms, 15 property reads.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from estimators import hinf
from icing_env import scenario as scenarios
from icing_env.env import TwinOtterEnv
from icing_env.jit import bound
from icing_env.loop import LoopFactory, NoLoop
from icing_env.vector_env import TwinOtterVectorEnv
from icing_env.world import World
from testbed.environments import loop_factory

BATCHES = (64, 1024, 16384)
CHUNKS = 15
SECONDS = 0.04  # of a chunk
JSBSIM_WRITES = ("fcs/elevator-cmd-norm", "fcs/aileron-cmd-norm", "fcs/rudder-cmd-norm", "fcs/throttle-cmd-norm")
JSBSIM_READS = (
    "velocities/vt-fps", "aero/alpha-rad", "aero/beta-rad", "velocities/p-rad_sec", "velocities/q-rad_sec",
    "velocities/r-rad_sec", "attitude/phi-rad", "attitude/theta-rad", "attitude/psi-rad",
    "accelerations/n-pilot-x-norm",
    "accelerations/n-pilot-y-norm", "accelerations/n-pilot-z-norm", "position/h-sl-ft",
    "propulsion/engine/thrust-lbs", "aero/qbar-psf",
)  # fmt: skip


def measured() -> scenarios.Scenario:
    """The scenario that is timed: turbulence of 1 m/s and a stratiform icing cloud, all instruments."""
    return scenarios.load("clear_air", weather="stratiform", task={"kind": "hold"}, duration=1e6,
                          parameters={"turbulence_sigma_w": 1.0})


def microseconds(step: Callable[[], Any], per_call: int = 1) -> float:
    """Median time of a call [us], divided by `per_call`."""
    step()
    start = time.perf_counter()
    step()
    calls = max(1, int(SECONDS/max(time.perf_counter() - start, 1e-7)))
    chunks = []
    for _ in range(CHUNKS):
        start = time.perf_counter()
        for _ in range(calls):
            step()
        chunks.append((time.perf_counter() - start)/calls)
    return 1e6*statistics.median(chunks)/per_call


def env_step(loop: LoopFactory) -> float:
    """One `env.step` of the single environment [us]."""
    env = TwinOtterEnv(measured(), loop=loop)
    env.reset(seed=0)
    action = np.zeros(env.action_space.shape or (), np.float32)
    return microseconds(lambda: env.step(action))


def batch_rate(n: int, loop: LoopFactory) -> float:
    """Environment steps per second of a vector environment of `n` aircraft."""
    env = TwinOtterVectorEnv(n, measured(), loop=loop)
    env.reset(seed=0)
    action = np.zeros(env.action_space.shape or (), np.float32)
    return 1e6/microseconds(lambda: env.step(action), n)


def hinf_update(n: int) -> float:
    """One update of the two-axis observer [us per aircraft]."""
    world = World(measured(), n, loop_factory())
    world.reset(seeds=range(n))
    loop: Any = world.loop
    update = bound(hinf.step, loop.observer, loop.estimate, world.fleet.measurement, loop.airframe, loop.tuning, 0.02)
    for _ in range(5):
        world.fleet.step()
        update()
    return microseconds(update, n)


def jsbsim_step() -> float | None:
    """One step of JSBSim's DHC6 as a Gym environment makes it [us]; None where JSBSim is not installed."""
    if importlib.util.find_spec("jsbsim") is None:
        return None
    os.environ.setdefault("JSBSIM_DEBUG", "0")  # else it greets on standard output
    import jsbsim

    fdm = jsbsim.FGFDMExec(jsbsim.get_default_root_dir())
    fdm.set_debug_level(0)
    fdm.load_model("DHC6")
    fdm.set_dt(0.01)
    fdm["ic/h-sl-ft"], fdm["ic/vc-kts"], fdm["ic/theta-deg"] = 7000.0, 130.0, 2.0
    fdm.run_ic()
    fdm["propulsion/set-running"] = -1

    def step() -> list[float]:
        for name in JSBSIM_WRITES:
            fdm[name] = 0.01
        fdm.run()
        fdm.run()
        return [fdm[name] for name in JSBSIM_READS]

    return microseconds(step)


def measure(progress: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Every figure of `icing benchmark speed`, in the form of the interface."""
    progress("one aircraft")
    fleet = World(measured())
    fleet.reset(seeds=[0])
    observed = loop_factory()
    out: dict[str, Any] = {
        "physics_step_us": microseconds(fleet.fleet.step), "env_step_us": env_step(NoLoop),
        "env_step_observed_us": env_step(observed), "batch_env_steps_per_s": {}, "batch_observed_env_steps_per_s": {},
    }
    progress("JSBSim")
    before = jsbsim_step()
    for n in BATCHES:
        progress(f"{n} aircraft")
        out["batch_env_steps_per_s"][str(n)] = batch_rate(n, NoLoop)
        out["batch_observed_env_steps_per_s"][str(n)] = batch_rate(n, observed)
    out["threads"] = 1
    out["hinf_update_us"] = {"single": hinf_update(1), "batch": hinf_update(1024)}
    progress("JSBSim again")
    after = jsbsim_step()
    peer = None if before is None or after is None else 0.5*(before + after)  # beside the batches in time
    out["peers"] = {"jsbsim_gym_like_step_us": peer}
    out["ratios"] = ratios(out, peer)
    out["machine"] = f"{platform.machine()}, {platform.python_implementation()} {platform.python_version()}"
    return out


def ratios(figures: dict[str, Any], peer: float | None) -> dict[str, float | None]:
    """Our rate over JSBSim's."""
    if peer is None:
        return dict.fromkeys(("single_vs_jsbsim", "single_observed_vs_jsbsim", "batch_1024_vs_jsbsim",
                              "batch_1024_observed_vs_jsbsim"))
    return {
        "single_vs_jsbsim": peer/figures["env_step_us"],
        "single_observed_vs_jsbsim": peer/figures["env_step_observed_us"],
        "batch_1024_vs_jsbsim": 1e-6*peer*figures["batch_env_steps_per_s"]["1024"],
        "batch_1024_observed_vs_jsbsim": 1e-6*peer*figures["batch_observed_env_steps_per_s"]["1024"],
    }
