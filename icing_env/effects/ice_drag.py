"""Drag of ice on unprotected parts, along the air stream; it may grow with the angle of attack."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["CD_parasite"] += values["delta_CD_0"]
    p["CD_alpha2"] += values["growth"]


EFFECT = Effect(
    name="ice_drag",
    component="aerodynamics",
    enters_at=("x_force",),
    description="Drag of ice on unprotected parts, along the air stream",
    source="founding paper: delta CD0 0.02 to 0.03; that it grows: Bragg, Broeren & Blumenthal, Progress in Aerospace "
           "Sciences 41, 2005, 323-362; by how much: assumed",
    parameters=(
        Parameter("delta_CD_0", "1", neutral=0.0, typical=0.015, low=-0.01, high=0.06),
        Parameter("growth", "1/rad2", neutral=0.0, typical=0.0, low=0.0, high=6.0),
    ),
    apply=apply,
)
