"""The pitch-rate gyro reads a constant too much."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["bias_q"] += values["offset"]


EFFECT = Effect(
    name="pitch_gyro_bias",
    component="sensor",
    enters_at=("sensor:q",),
    description="The pitch-rate gyro reads a constant too much",
    source="assumed: 0.3 deg/s",
    parameters=(
        Parameter("offset", "rad/s", neutral=0.0, typical=0.005, low=-0.035, high=0.035),
    ),
    apply=apply,
)
