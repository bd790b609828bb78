"""The c.g. lies to the right (+) or left: fuel imbalance."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["cg_shift_y"] += values["right"]


EFFECT = Effect(
    name="lateral_cg",
    component="mass",
    enters_at=("mass", "rolling_moment"),
    description="The c.g. lies to the right (+) or left: fuel imbalance",
    source="assumed",
    parameters=(
        Parameter("right", "m", neutral=0.0, typical=0.1, low=-0.3, high=0.3),
    ),
    apply=apply,
)
