"""Lift-curve slope (CZ_alpha) differs from the model by a factor."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values, multiply


def apply(p: NDArray, values: Values) -> None:
    multiply(p, "CZ_alpha", 1.0 + values["change"])


EFFECT = Effect(
    name="lift_slope",
    component="aerodynamics",
    enters_at=("z_force",),
    description="Lift-curve slope (CZ_alpha) differs from the model by a factor",
    source="Ranaudo et al. 1986 and the founding paper: -10 to -30 % in ice",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.12, low=-0.6, high=0.6),
    ),
    apply=apply,
)
