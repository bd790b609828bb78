"""The angle-of-attack vane is out of scale (upwash not corrected)."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["scale_alpha"] += values["change"]


EFFECT = Effect(
    name="alpha_scale",
    component="sensor",
    enters_at=("sensor:alpha",),
    description="The angle-of-attack vane is out of scale (upwash not corrected)",
    source="founding paper, Fig. 20: scale factor of alpha",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=0.1, low=-0.4, high=0.4),
    ),
    apply=apply,
)
