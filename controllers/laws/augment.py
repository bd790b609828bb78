"""What the laws that build on the autopilot share: gains joined, moments per coefficient, when an estimate is trusted.

A trusted estimate changes a share of a clean derivative, bounded and slewed; an estimate that is not leaves the share
where it is. Bounds of +-30 % and the freeze at a standard error of 10 % are those of the adaptation of control laws
proposed with ice management systems (docs/controllers.md, laws).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import air_density, airspeed_of, clip
from controllers.laws.autopilot import OWN_GAINS as AUTOPILOT_GAINS
from controllers.laws.guidance import load_gains
from controllers.parameters import read_parameters
from icing_env.jit import kernel
from icing_env.types import Field

TRUST_FIELDS: list[Field] = [
    ("change_max", "1", "largest change of a derivative that is believed, over the clean value"),
    ("change_ignored", "1", "change that is not followed at all; from twice that on it is followed whole"),
    ("error_max", "1", "largest standard error over the clean value at which an estimate is followed"),
    ("excitation_min", "1", "excitation of the axis below which nothing is followed"),
    ("change_rate", "1/s", "slew rate of a change"),
]


def load_augmented(name: str | Path, own: list[Field]) -> NDArray[Any]:
    """Gains of a law, then of the outer loops and of the autopilot, one row; InputError for a file that does not fit.

    A law's own come first: numba would take a row that merely goes on after the autopilot's for one of those.
    """
    base, extra = load_gains("autopilot", AUTOPILOT_GAINS), read_parameters(name, own)
    row = np.zeros(1, np.dtype([*extra.dtype.descr, *base.dtype.descr]))
    for part in (base, extra):
        for field in part.dtype.names or ():
            row[field] = part[field]
    return row


@kernel
def dynamic_pressure(m: Any) -> float:
    """Dynamic pressure [Pa] from the air data."""
    v = airspeed_of(m)
    return 0.5*air_density(m)*v*v


@kernel
def pitch_power(m: Any, f: Any) -> float:
    """Pitch acceleration [rad/s2] per unit of Cm: qbar S c/Iyy."""
    return dynamic_pressure(m)*f.wing_area*f.chord/f.inertia_yy


@kernel
def roll_power(m: Any, f: Any) -> float:
    """Roll acceleration [rad/s2] per unit of Cl: qbar S b/Ixx."""
    return dynamic_pressure(m)*f.wing_area*f.span/f.inertia_xx


@kernel
def trusted(std: float, clean: float, excitation: float, health: float, g: Any) -> bool:
    """True where an estimate may be followed; False where its error is not a number."""
    return health == 1.0 and excitation >= g.excitation_min and 0.0 < std <= g.error_max*abs(clean)


@kernel
def followed(share: float, value: float, clean: float, trust: bool, g: Any, dt: float) -> float:
    """Share of its clean value that a derivative keeps, one step on: towards the estimate's, slewed, or as it was."""
    if not (trust and math.isfinite(value)):
        return share
    change = value/clean - 1.0
    change *= clip(abs(change)/g.change_ignored - 1.0, 0.0, 1.0)
    slew = g.change_rate*dt
    return share + clip(1.0 + clip(change, -g.change_max, g.change_max) - share, -slew, slew)
