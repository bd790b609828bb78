"""Constant rolling moment (wing or aileron rigging)."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["Cl_0"] += values["delta_Cl_0"]


EFFECT = Effect(
    name="roll_trim",
    component="aerodynamics",
    enters_at=("rolling_moment",),
    description="Constant rolling moment (wing or aileron rigging)",
    source="assumed",
    parameters=(
        Parameter("delta_Cl_0", "1", neutral=0.0, typical=0.004, low=-0.02, high=0.02),
    ),
    apply=apply,
)
