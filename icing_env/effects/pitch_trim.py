"""Constant pitching moment (tailplane or flap rigging)."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["Cm_0"] += values["delta_Cm_0"]


EFFECT = Effect(
    name="pitch_trim",
    component="aerodynamics",
    enters_at=("pitching_moment",),
    description="Constant pitching moment (tailplane or flap rigging)",
    source="assumed",
    parameters=(
        Parameter("delta_Cm_0", "1", neutral=0.0, typical=0.03, low=-0.1, high=0.1),
    ),
    apply=apply,
)
