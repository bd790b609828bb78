"""Damping in pitch (Cm_q) differs from the model by a factor."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values, multiply


def apply(p: NDArray, values: Values) -> None:
    multiply(p, "Cm_q", 1.0 + values["change"])


EFFECT = Effect(
    name="pitch_damping",
    component="aerodynamics",
    enters_at=("pitching_moment",),
    description="Damping in pitch (Cm_q) differs from the model by a factor",
    source="method-to-method scatter of the founding paper, 9 to 17 %",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.15, low=-0.6, high=0.6),
    ),
    apply=apply,
)
