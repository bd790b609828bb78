"""Moment and lift of the elevator (Cm_elevator, CZ_elevator) differ by one factor."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values, multiply


def apply(p: NDArray, values: Values) -> None:
    multiply(p, "Cm_elevator", 1.0 + values["change"])
    multiply(p, "CZ_elevator", 1.0 + values["change"])


EFFECT = Effect(
    name="elevator_power",
    component="aerodynamics",
    enters_at=("pitching_moment", "z_force"),
    description="Moment and lift of the elevator (Cm_elevator, CZ_elevator) differ by one factor",
    source="tailplane icing programme: -12 % to more than -30 %",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.12, low=-0.6, high=0.6),
    ),
    apply=apply,
)
