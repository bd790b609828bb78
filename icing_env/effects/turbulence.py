"""Dryden turbulence of another intensity."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["turbulence_sigma_w"] += values["sigma_w"]


EFFECT = Effect(
    name="turbulence",
    component="environment",
    enters_at=("wind",),
    description="Dryden turbulence of another intensity",
    source="MIL-F-8785C: light about 1.5 m/s",
    parameters=(
        Parameter("sigma_w", "m/s", neutral=0.0, typical=1.0, low=0.0, high=5.0),
    ),
    apply=apply,
)
