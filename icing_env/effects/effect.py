"""What an effect is: a few physical parameters, neutral by default, that change numbers of an aircraft.

`apply` receives a PARAMETERS array (one row per aircraft) and the effect's parameters (numbers, or one per row) and
changes the array in place. Neutral parameters leave every bit as it was. The compiled plant never knows of effects:
a step costs the same with none and with sixty. A phenomenon with memory has its state and its neutral number in the
plant (a lag of zero, a gain of zero) and its effect sets that number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from icing_env.discrepancy import CHANGES_OF
from icing_env.types import MEASUREMENT_FIELDS

Component = Literal["aerodynamics", "propulsion", "mass", "actuator", "sensor", "environment"]
# Where a diagnosis sees an effect enter: forces and moments, engines, mass, the way to each surface, instruments, air.
ENTERS_AT = (
    "x_force", "y_force", "z_force", "rolling_moment", "pitching_moment", "yawing_moment", "propulsion", "mass",
    "elevator_path", "aileron_path", "rudder_path", "wind", *(f"sensor:{name}" for name, _, _ in MEASUREMENT_FIELDS),
)  # fmt: skip
Values = Mapping[str, float | NDArray[np.float64]]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect, with the range in which it is searched for and randomised."""

    name: str
    unit: str
    neutral: float
    typical: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Effect:
    """A difference between an aircraft and its model.

    Attributes:
        name: as on the command line and in a diagnosis.
        component: where in the aircraft it lives.
        enters_at: of ENTERS_AT, the components of a diagnosis.
        description, source: for people.
        parameters: its numbers.
        apply: changes a PARAMETERS array in place.
    """

    name: str
    component: Component
    enters_at: tuple[str, ...]
    description: str
    source: str
    parameters: tuple[Parameter, ...]
    apply: Callable[[NDArray, Values], None]

    def neutral(self) -> dict[str, float]:
        """Values that change nothing."""
        return {p.name: p.neutral for p in self.parameters}

    def typical(self) -> dict[str, float]:
        """Values of a size met in practice."""
        return {p.name: p.typical for p in self.parameters}


def multiply(p: NDArray, derivative: str, factor: float | NDArray[np.float64]) -> None:
    """Multiply a derivative of a PARAMETERS array by a factor, alike in every condition."""
    for name in (derivative, *CHANGES_OF.get(derivative, ())):
        p[name] *= factor
