"""The environments with everything in them: what the registered ids make."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from icing_env.env import TwinOtterEnv
from icing_env.jit import compile_beside
from icing_env.loop import LoopFactory, NoLoop
from icing_env.vector_env import TwinOtterVectorEnv
from icing_env.world import World
from testbed.closed_loop import ClosedLoop

PARTS = ("observer", "management", "protection", "boots")  # each on or off
CHOICES = ("estimator", "law", "shield", "sense", "adaptation")  # which of each


def loop_factory(**options: Any) -> LoopFactory:
    """What closes the loop; options are those of `testbed.closed_loop.ClosedLoop`."""

    def make_loop(n: int, clean: NDArray, dt: float) -> ClosedLoop:
        return ClosedLoop(n, clean, dt, **options)

    return make_loop


def reveal(world: World) -> World:
    """Show the truth to a loop whose estimator is the oracle; others never see it. Returns the world."""
    if isinstance(world.loop, ClosedLoop):
        world.loop.reveal(world.fleet)
    return world


def _loop(options: dict[str, Any]) -> LoopFactory:
    parts = {name: options.pop(name, True) for name in PARTS}
    chosen = {name: options.pop(name) for name in CHOICES if name in options}
    bare = options.get("mode", "surfaces") == "surfaces" and options.get("axes", "all") == "all"
    return NoLoop if bare and not any(parts.values()) else loop_factory(**parts, **chosen)


def make(**options: Any) -> TwinOtterEnv:
    """One aircraft. Options: those of `TwinOtterEnv`, and those of `testbed.closed_loop.ClosedLoop`."""
    compile_beside("testbed.environments")
    env = TwinOtterEnv(loop=_loop(options), **options)
    reveal(env.world)
    return env


def make_vector(num_envs: int = 1, **options: Any) -> TwinOtterVectorEnv:
    """Many aircraft. Options: those of `TwinOtterVectorEnv` and of `testbed.closed_loop.ClosedLoop`."""
    compile_beside("testbed.environments")
    envs = TwinOtterVectorEnv(num_envs, loop=_loop(options), **options)
    reveal(envs.world)
    return envs


if __name__ == "__main__":  # see `icing_env.jit.compile_beside`
    make().reset(seed=0)
