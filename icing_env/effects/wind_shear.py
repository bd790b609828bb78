"""North wind that changes with altitude."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["wind_north_shear"] += values["gradient"]


EFFECT = Effect(
    name="wind_shear",
    component="environment",
    enters_at=("wind",),
    description="North wind that changes with altitude",
    source="assumed: 0.02 1/s",
    parameters=(
        Parameter("gradient", "1/s", neutral=0.0, typical=0.02, low=-0.1, high=0.1),
    ),
    apply=apply,
)
