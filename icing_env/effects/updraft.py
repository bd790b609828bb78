"""Steadily rising air."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["wind_down"] -= values["speed"]


EFFECT = Effect(
    name="updraft",
    component="environment",
    enters_at=("wind",),
    description="Steadily rising air",
    source="assumed: 1 m/s",
    parameters=(
        Parameter("speed", "m/s", neutral=0.0, typical=1.0, low=-5.0, high=5.0),
    ),
    apply=apply,
)
