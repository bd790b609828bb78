"""The aircraft is heavier or lighter than believed."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["mass"] *= 1.0 + values["change"]


EFFECT = Effect(
    name="mass_error",
    component="mass",
    enters_at=("mass",),
    description="The aircraft is heavier or lighter than believed",
    source="assumed: fuel and load",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=0.05, low=-0.2, high=0.2),
    ),
    apply=apply,
)
