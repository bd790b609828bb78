"""Side force of sideslip (CY_beta) differs from the model by a factor."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values, multiply


def apply(p: NDArray, values: Values) -> None:
    multiply(p, "CY_beta", 1.0 + values["change"])


EFFECT = Effect(
    name="side_force",
    component="aerodynamics",
    enters_at=("y_force",),
    description="Side force of sideslip (CY_beta) differs from the model by a factor",
    source="flight records against the published model: +40 %",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=0.3, low=-0.6, high=0.6),
    ),
    apply=apply,
)
