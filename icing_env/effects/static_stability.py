"""Static longitudinal stability (Cm_alpha) differs from the model by a factor."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values, multiply


def apply(p: NDArray, values: Values) -> None:
    multiply(p, "Cm_alpha", 1.0 + values["change"])


EFFECT = Effect(
    name="static_stability",
    component="aerodynamics",
    enters_at=("pitching_moment",),
    description="Static longitudinal stability (Cm_alpha) differs from the model by a factor",
    source="Ratvasky & Ranaudo AIAA-93-0398: about -10 % with tail ice",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.12, low=-0.6, high=0.6),
    ),
    apply=apply,
)
