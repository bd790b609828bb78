"""Both propellers give another thrust than the chart."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["thrust_factor_left"] *= 1.0 + values["change"]
    p["thrust_factor_right"] *= 1.0 + values["change"]


EFFECT = Effect(
    name="thrust_loss",
    component="propulsion",
    enters_at=("propulsion",),
    description="Both propellers give another thrust than the chart",
    source="assumed: ice on the blades, worn engines",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.1, low=-0.5, high=0.3),
    ),
    apply=apply,
)
