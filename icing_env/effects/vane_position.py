"""The correction of the vanes to the c.g. uses a wrong boom length."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["vane_position_error"] += values["error"]


EFFECT = Effect(
    name="vane_position",
    component="sensor",
    enters_at=("sensor:alpha", "sensor:beta"),
    description="The correction of the vanes to the c.g. uses a wrong boom length",
    source="assumed",
    parameters=(
        Parameter("error", "m", neutral=0.0, typical=1.0, low=-5.0, high=5.0),
    ),
    apply=apply,
)
