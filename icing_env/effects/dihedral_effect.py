"""Roll moment of sideslip (Cl_beta) differs from the model by a factor."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values, multiply


def apply(p: NDArray, values: Values) -> None:
    multiply(p, "Cl_beta", 1.0 + values["change"])


EFFECT = Effect(
    name="dihedral_effect",
    component="aerodynamics",
    enters_at=("rolling_moment",),
    description="Roll moment of sideslip (Cl_beta) differs from the model by a factor",
    source="flight records against the published model: +30 %",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=0.25, low=-0.6, high=0.6),
    ),
    apply=apply,
)
