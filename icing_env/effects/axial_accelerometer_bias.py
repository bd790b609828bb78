"""The axial accelerometer reads a constant too much."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["bias_ax"] += values["offset"]


EFFECT = Effect(
    name="axial_accelerometer_bias",
    component="sensor",
    enters_at=("sensor:ax",),
    description="The axial accelerometer reads a constant too much",
    source="assumed: 0.01 g",
    parameters=(
        Parameter("offset", "m/s2", neutral=0.0, typical=0.1, low=-1.0, high=1.0),
    ),
    apply=apply,
)
