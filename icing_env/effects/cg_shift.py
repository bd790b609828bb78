"""The c.g. lies forward (+) or aft of where it is believed."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["cg_shift_x"] += values["forward"]


EFFECT = Effect(
    name="cg_shift",
    component="mass",
    enters_at=("mass", "pitching_moment"),
    description="The c.g. lies forward (+) or aft of where it is believed",
    source="assumed: up to 15 % of the chord",
    parameters=(
        Parameter("forward", "m", neutral=0.0, typical=-0.1, low=-0.3, high=0.3),
    ),
    apply=apply,
)
