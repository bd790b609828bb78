"""Ice on the tailplane: stability, elevator power, earlier tailplane stall."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values
from icing_env.effects.ice import saturated, scale
from icing_env.severity import LONGITUDINAL


def apply(p: NDArray, values: Values) -> None:
    for name in LONGITUDINAL:
        scale(p, name, 1.0 + p[f"k_{name}_htail"]*values["eta"])
    p["alpha_tail_stall"] *= 1.0 + p["k_alpha_tail_stall_htail"]*saturated(values["eta"])


EFFECT = Effect(
    name="tail_ice",
    component="aerodynamics",
    enters_at=("pitching_moment", "z_force"),
    description="Ice on the tailplane: stability, elevator power, earlier tailplane stall",
    source="FlightGear UIUC model, TwinOtter ice files (tail share)",
    parameters=(
        Parameter("eta", "1", neutral=0.0, typical=0.1, low=0.0, high=0.25),
    ),
    apply=apply,
)
