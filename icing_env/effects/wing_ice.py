"""Ice on both half wings: lift slope, drag, damping, aileron power, earlier stall."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values
from icing_env.effects.ice import saturated, scale
from icing_env.severity import LATERAL, LONGITUDINAL


def apply(p: NDArray, values: Values) -> None:
    for name in LONGITUDINAL + LATERAL:
        scale(p, name, 1.0 + p[f"k_{name}_wing"]*values["eta"])
    p["alpha_stall"] -= p["k_alpha_stall_wing"]*saturated(values["eta"])


EFFECT = Effect(
    name="wing_ice",
    component="aerodynamics",
    enters_at=("z_force", "x_force", "pitching_moment", "rolling_moment"),
    description="Ice on both half wings: lift slope, drag, damping, aileron power, earlier stall",
    source="FlightGear UIUC model, TwinOtter ice files (wing share)",
    parameters=(
        Parameter("eta", "1", neutral=0.0, typical=0.07, low=0.0, high=0.25),
    ),
    apply=apply,
)
