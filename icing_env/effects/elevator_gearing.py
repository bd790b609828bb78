"""The elevator moves more or less than it is told."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["elevator_gearing"] *= 1.0 + values["change"]


EFFECT = Effect(
    name="elevator_gearing",
    component="actuator",
    enters_at=("elevator_path",),
    description="The elevator moves more or less than it is told",
    source="assumed: rigging",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.1, low=-0.5, high=0.5),
    ),
    apply=apply,
)
