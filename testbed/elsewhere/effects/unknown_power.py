"""Propulsion effects that are in no list."""

from __future__ import annotations

import numpy as np

from testbed.elsewhere.effects.registry import unknown
from testbed.elsewhere.hooks import GROUPS, Flow, Hooks


@unknown("slipstream strengthens and swirls about the fin", ("yawing_moment",), "propulsion", (2.5, 6.0), "1")
def slipstream(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Fin and rudder work in air speeded up by thrust: their Cn times 1 + `size` CT, and swirl gives sidewash by CT."""
    swirl = rng.uniform(0.15, 0.35)

    def coefficients(f: Flow) -> None:
        inflow = f.on * size * f.CT
        f.C[5] += inflow * (1.5 * f.d["Cnb"] * f.beta + f.d["Cndr"] * f.surfaces[2])
        f.C[5] += f.on * swirl * f.d["Cnb"] * f.CT
        f.C[1] += inflow * f.d["CYdr"] * f.surfaces[2]

    return Hooks({"per_CT": size, "sidewash_per_CT": swirl}, coefficients=coefficients)


@unknown("propeller governor of one engine hunts", ("propulsion",), "propulsion", (0.10, 0.25), "1")
def hunting(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Right thrust swings by the fraction `size` in a limit cycle that the averaged torque reading does not show."""
    rate, phase = 2 * np.pi * rng.uniform(0.25, 0.5), np.tile(rng.uniform(0, 6.28, n), GROUPS)

    def thrust(f: Flow) -> None:
        swing = np.sin(rate * f.t + phase)
        swing = swing + 0.3 * swing**3
        f.thrust = f.thrust * np.stack([np.ones_like(swing), 1.0 + f.on * size * swing])

    return Hooks({"fraction": size, "rate": rate}, thrust=thrust)
