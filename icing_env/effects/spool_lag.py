"""The engines follow their levers more slowly."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["spool_time"] += values["extra"]


EFFECT = Effect(
    name="spool_lag",
    component="propulsion",
    enters_at=("propulsion",),
    description="The engines follow their levers more slowly",
    source="assumed",
    parameters=(
        Parameter("extra", "s", neutral=0.0, typical=0.8, low=-0.7, high=4.0),
    ),
    apply=apply,
)
