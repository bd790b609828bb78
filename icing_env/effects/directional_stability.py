"""Directional stability (Cn_beta) differs from the model by a factor."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values, multiply


def apply(p: NDArray, values: Values) -> None:
    multiply(p, "Cn_beta", 1.0 + values["change"])


EFFECT = Effect(
    name="directional_stability",
    component="aerodynamics",
    enters_at=("yawing_moment",),
    description="Directional stability (Cn_beta) differs from the model by a factor",
    source="Ratvasky & Ranaudo AIAA-93-0398: up to -20 %",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.2, low=-0.6, high=0.6),
    ),
    apply=apply,
)
