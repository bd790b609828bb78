"""Library effects of the propulsion (numbers 14, 20, 22, 24 of the list in docs/elsewhere.md)."""

from __future__ import annotations

import numpy as np

from testbed.elsewhere.effects.registry import known
from testbed.elsewhere.hooks import Flow, Hooks
from testbed.elsewhere.propulsion import DIAMETER, RPM


@known("Propwash on tail / power pitching", 14, ("pitching_moment",), "propulsion", (0.12, 0.40), "1", either_sign=True)
def power_pitch(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Cm changes by `size` times the thrust coefficient."""

    def coefficients(f: Flow) -> None:
        f.C[4] += f.on * size * f.CT

    return Hooks({"Cm_CT": size}, coefficients=coefficients)


@known("Thrust scale", 20, ("propulsion",), "propulsion", (0.10, 0.25), "1", either_sign=True)
def scale(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """True thrust is 1 + `size` times what the deck says."""

    def thrust(f: Flow) -> None:
        f.thrust = f.thrust * (1.0 + f.on * size)

    return Hooks({"factor": 1.0 + size}, thrust=thrust)


@known("Asymmetric thrust", 22, ("propulsion",), "propulsion", (0.12, 0.30), "1", either_sign=True, other_form=True)
def asymmetric(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Blade angles differ: right thrust loses, left gains, `size` times (V / 65)^2 of itself."""

    def thrust(f: Flow) -> None:
        part = f.on * 0.5 * size * (f.speed / 65.0) ** 2
        f.thrust = f.thrust * np.stack([1.0 + part, 1.0 - part])

    return Hooks({"split_at_65": size}, thrust=thrust)


@known("Prop ice/efficiency", 24, ("propulsion",), "propulsion", (0.3, 0.8), "1")
def propeller(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Efficiency falls with advance ratio: thrust times 1 - `size` (J - 0.45) above J = 0.45."""

    def thrust(f: Flow) -> None:
        advance = f.speed / (RPM / 60.0 * DIAMETER)
        f.thrust = f.thrust * (1.0 - f.on * size * np.maximum(advance - 0.45, 0.0))

    return Hooks({"slope": size}, thrust=thrust)
