"""The aircraft's own derivatives, mass and thrust line, so much of the model's: numbers that a diagnosis refined.

Published derivatives are off by some 5 % in any aircraft; a diagnosis fits them beside the effects that it looks for.
Like `discrepancy` this belongs to no library: it explains nothing.
"""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values
from icing_env.types import DERIVATIVE_NAMES

NUMBERS = (*DERIVATIVE_NAMES, "mass", "engine_arm_z", "Cm_alphadot")


def apply(p: NDArray, values: Values) -> None:
    for name in NUMBERS:
        p[name] *= 1.0 + values[name]


EFFECT = Effect(
    name="derivatives",
    component="aerodynamics",
    enters_at=("x_force", "y_force", "z_force", "rolling_moment", "pitching_moment", "yawing_moment", "mass"),
    description="Derivatives, mass and thrust line, by what part of the model's they differ from it",
    source="docs/model.md, section 20",
    parameters=tuple(Parameter(name, "1", neutral=0.0, typical=0.0, low=-1.0, high=10.0) for name in NUMBERS),
    apply=apply,
)
