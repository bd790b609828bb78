"""The elevator stands off its command by a constant angle."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["elevator_offset"] += values["angle"]


EFFECT = Effect(
    name="elevator_offset",
    component="actuator",
    enters_at=("elevator_path",),
    description="The elevator stands off its command by a constant angle",
    source="assumed: rigging, trim tab",
    parameters=(
        Parameter("angle", "rad", neutral=0.0, typical=0.017, low=-0.07, high=0.07),
    ),
    apply=apply,
)
