"""The pitot system reads a fraction too much."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["scale_airspeed"] += values["change"]


EFFECT = Effect(
    name="airspeed_scale",
    component="sensor",
    enters_at=("sensor:airspeed",),
    description="The pitot system reads a fraction too much",
    source="assumed: position error, partial blockage",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=0.03, low=-0.2, high=0.2),
    ),
    apply=apply,
)
