"""The elevator follows its command more slowly."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["elevator_lag"] += values["extra"]


EFFECT = Effect(
    name="elevator_lag",
    component="actuator",
    enters_at=("elevator_path",),
    description="The elevator follows its command more slowly",
    source="assumed: cable stretch, servo",
    parameters=(
        Parameter("extra", "s", neutral=0.0, typical=0.1, low=-0.04, high=0.5),
    ),
    apply=apply,
)
