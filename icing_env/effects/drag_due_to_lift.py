"""Leading-edge suction is lost or gained: drag that grows with angle of attack."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["CX_alpha2"] *= 1.0 + values["change"]


EFFECT = Effect(
    name="drag_due_to_lift",
    component="aerodynamics",
    enters_at=("x_force",),
    description="Leading-edge suction is lost or gained: drag that grows with angle of attack",
    source="assumed: roughness of ice on the leading edge",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.2, low=-0.6, high=0.6),
    ),
    apply=apply,
)
