"""The angle-of-attack vane reads a constant too much."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["bias_alpha"] += values["offset"]


EFFECT = Effect(
    name="alpha_bias",
    component="sensor",
    enters_at=("sensor:alpha",),
    description="The angle-of-attack vane reads a constant too much",
    source="founding paper: biases of the data compatibility step",
    parameters=(
        Parameter("offset", "rad", neutral=0.0, typical=0.009, low=-0.07, high=0.07),
    ),
    apply=apply,
)
