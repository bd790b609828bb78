"""The vertical gyro reads a constant pitch too much."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["bias_theta"] += values["offset"]


EFFECT = Effect(
    name="pitch_attitude_bias",
    component="sensor",
    enters_at=("sensor:theta",),
    description="The vertical gyro reads a constant pitch too much",
    source="assumed",
    parameters=(
        Parameter("offset", "rad", neutral=0.0, typical=0.009, low=-0.07, high=0.07),
    ),
    apply=apply,
)
