"""Library effects of unsteady and elastic air loads, and of wind (11, 18, 45 of the list in docs/elsewhere.md)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.aircraft import CHORD
from testbed.elsewhere.effects.registry import known
from testbed.elsewhere.hooks import GROUPS, Flow, Hooks

TAIL_ARM = 24.75 * 0.3048  # m, JSBSim aircraft/DHC6


@known("Downwash lag (Cmα̇)", 11, ("pitching_moment",), "aerodynamics", (1.0, 2.2), "1", other_form=True)
def downwash(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Downwash reaches the tail through a first-order lag of l_t/V; Cmα̇ of -8 times `size`, taken out of Cmq."""
    quasi = 8.0 * size

    def coefficients(f: Flow) -> None:
        lag = TAIL_ARM / f.speed
        slope = quasi * CHORD / (2.0 * f.speed) / lag
        lagged = f.x[f.downwash][0]
        f.C[4] += f.on * (slope * (lagged - f.alpha) + quasi * f.relative[1] * CHORD / (2.0 * f.speed))

    def memory(f: Flow, own: NDArray) -> NDArray:
        return (f.alpha - own) * f.speed / TAIL_ARM

    hooks = Hooks({"Cm_alphadot": -quasi}, coefficients=None, memory=memory, states=1)

    def with_slot(f: Flow) -> None:
        f.downwash = hooks.slot
        coefficients(f)

    hooks.coefficients = with_slot
    return hooks


@known("Aeroelastic (q̄-dependent effectiveness)", 18, ("pitching_moment",), "aerodynamics", (0.12, 0.30), "1",
       other_form=True)
def aeroelastic(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Elevator power falls linearly with dynamic pressure, by `size` at 2500 Pa; the tail's Cmα by a third of that."""

    def coefficients(f: Flow) -> None:
        lost = f.on * size * f.qbar / 2500.0
        f.C[4] -= lost * f.d["Cmde"] * f.surfaces[0] + lost / 3.0 * f.d["Cma"] * f.alpha

    return Hooks({"loss_at_2500_Pa": size}, coefficients=coefficients)


@known("Steady wind, shear, up/downdraft, discrete gust", 45, ("wind",), "environment", (2.0, 4.5), "m/s",
       either_sign=True, other_form=True)
def gust(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Two sech^2 up- or downdraughts a record, of opposite sign, at times of their own in each record."""
    first, gap = np.tile(rng.uniform(6.0, 16.0, n), GROUPS), rng.uniform(10.0, 16.0)
    width = rng.uniform(0.9, 2.0)

    def wind(f: Flow) -> None:
        for sign, at in ((1.0, first), (-0.8, first + gap)):
            f.wind += f.matrix[2] * (-f.on * sign * size / np.cosh((f.t - at) / width) ** 2)

    return Hooks({"peak_up": size, "width_s": width, "first_s": first[:n].tolist(), "gap_s": gap}, wind=wind)
