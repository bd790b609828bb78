"""The flow vanes lag behind the flow."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["vane_lag"] += values["extra"]


EFFECT = Effect(
    name="vane_lag",
    component="sensor",
    enters_at=("sensor:alpha", "sensor:beta"),
    description="The flow vanes lag behind the flow",
    source="assumed: 0.1 s",
    parameters=(
        Parameter("extra", "s", neutral=0.0, typical=0.1, low=-0.02, high=0.5),
    ),
    apply=apply,
)
