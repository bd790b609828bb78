"""The air is denser or thinner than pressure and temperature say."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["density_factor"] *= 1.0 + values["change"]


EFFECT = Effect(
    name="air_density",
    component="environment",
    enters_at=("wind",),
    description="The air is denser or thinner than pressure and temperature say",
    source="assumed",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=0.03, low=-0.1, high=0.1),
    ),
    apply=apply,
)
