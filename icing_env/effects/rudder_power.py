"""Yaw moment of the rudder (Cn_rudder) differs from the model by a factor."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values, multiply


def apply(p: NDArray, values: Values) -> None:
    multiply(p, "Cn_rudder", 1.0 + values["change"])


EFFECT = Effect(
    name="rudder_power",
    component="aerodynamics",
    enters_at=("yawing_moment",),
    description="Yaw moment of the rudder (Cn_rudder) differs from the model by a factor",
    source="Ratvasky & Ranaudo AIAA-93-0398: -8 %",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-0.1, low=-0.6, high=0.6),
    ),
    apply=apply,
)
