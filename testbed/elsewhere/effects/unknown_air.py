"""Wind effects that are in no list."""

from __future__ import annotations

import numpy as np

from testbed.elsewhere.effects.registry import unknown
from testbed.elsewhere.hooks import GROUPS, Flow, Hooks


@unknown("crosses the wake of another aircraft", ("wind",), "environment", (0.12, 0.35), "rad/s", either_sign=True)
def wake(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """A vortex pair: the air rotates about body x by `size` one way, then the other, with a downwash in between."""
    at, gap = np.tile(rng.uniform(8.0, 28.0, n), GROUPS), rng.uniform(1.2, 2.5)
    core, sink = rng.uniform(0.5, 0.9), rng.uniform(4.0, 8.0)

    def wind(f: Flow) -> None:
        first, second = (np.exp(-(((f.t - at - s * gap / 2) / core) ** 2)) for s in (-1, 1))
        f.spin[0] += f.on * size * (first - second)
        f.wind[2] += f.on * sink * abs(size) * np.exp(-(((f.t - at) / gap) ** 2))

    return Hooks({"rotation": size, "at_s": at[:n].tolist(), "gap_s": gap, "sink_per_rotation": sink}, wind=wind)
