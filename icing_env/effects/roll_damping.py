"""Damping in roll (Cl_p) differs from the model by a factor."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values, multiply


def apply(p: NDArray, values: Values) -> None:
    multiply(p, "Cl_p", 1.0 + values["change"])


EFFECT = Effect(
    name="roll_damping",
    component="aerodynamics",
    enters_at=("rolling_moment",),
    description="Damping in roll (Cl_p) differs from the model by a factor",
    source="FlightGear UIUC all-ice file: -10 %",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.15, low=-0.6, high=0.6),
    ),
    apply=apply,
)
