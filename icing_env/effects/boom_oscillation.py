"""The nose boom oscillates at 7 Hz and the angle-of-attack vane with it."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["boom_gain"] += values["gain"]


EFFECT = Effect(
    name="boom_oscillation",
    component="sensor",
    enters_at=("sensor:alpha",),
    description="The nose boom oscillates at 7 Hz and the angle-of-attack vane with it",
    source="founding paper: oscillations at 7 Hz",
    parameters=(
        Parameter("gain", "rad s2/m", neutral=0.0, typical=0.001, low=-0.004, high=0.004),
    ),
    apply=apply,
)
