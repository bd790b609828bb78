"""The right propeller gives less thrust than the left."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["thrust_factor_left"] *= 1.0 + 0.5*values["difference"]
    p["thrust_factor_right"] *= 1.0 - 0.5*values["difference"]


EFFECT = Effect(
    name="asymmetric_thrust",
    component="propulsion",
    enters_at=("propulsion", "yawing_moment"),
    description="The right propeller gives less thrust than the left",
    source="assumed",
    parameters=(
        Parameter("difference", "1", neutral=0.0, typical=0.1, low=-0.5, high=0.5),
    ),
    apply=apply,
)
