"""The elevator moves no faster than a fraction of its nominal rate."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["elevator_rate"] *= 1.0 - values["reduction"]


EFFECT = Effect(
    name="elevator_rate_limit",
    component="actuator",
    enters_at=("elevator_path",),
    description="The elevator moves no faster than a fraction of its nominal rate",
    source="assumed",
    parameters=(
        Parameter("reduction", "1", neutral=0.0, typical=0.8, low=0.0, high=0.98),
    ),
    apply=apply,
)
