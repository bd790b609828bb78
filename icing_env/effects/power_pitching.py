"""Pitching moment of the slipstream."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["Cm_CT"] += values["Cm_CT"]


EFFECT = Effect(
    name="power_pitching",
    component="aerodynamics",
    enters_at=("pitching_moment",),
    description="Pitching moment of the slipstream",
    source="FlightGear dhc6jsb.xml: CmT up to 0.35 per thrust coefficient",
    parameters=(
        Parameter("Cm_CT", "1", neutral=0.0, typical=0.15, low=-0.4, high=0.6),
    ),
    apply=apply,
)
