"""The normal accelerometer reads a constant too much."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["bias_az"] += values["offset"]


EFFECT = Effect(
    name="normal_accelerometer_bias",
    component="sensor",
    enters_at=("sensor:az",),
    description="The normal accelerometer reads a constant too much",
    source="assumed: 0.03 g",
    parameters=(
        Parameter("offset", "m/s2", neutral=0.0, typical=0.3, low=-2.0, high=2.0),
    ),
    apply=apply,
)
