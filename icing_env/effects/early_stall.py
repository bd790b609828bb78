"""The wing separates at a smaller angle of attack."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["alpha_stall"] -= values["angle"]


EFFECT = Effect(
    name="early_stall",
    component="aerodynamics",
    enters_at=("z_force", "pitching_moment"),
    description="The wing separates at a smaller angle of attack",
    source="facts of iced aerofoils: 2 to 6 deg",
    parameters=(
        Parameter("angle", "rad", neutral=0.0, typical=0.05, low=-0.03, high=0.15),
    ),
    apply=apply,
)
