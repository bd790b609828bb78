"""Ice on the fin: directional stability, rudder power, side force."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values
from icing_env.effects.ice import scale
from icing_env.severity import LATERAL


def apply(p: NDArray, values: Values) -> None:
    for name in LATERAL:
        scale(p, name, 1.0 + p[f"k_{name}_vtail"]*values["eta"])


EFFECT = Effect(
    name="fin_ice",
    component="aerodynamics",
    enters_at=("y_force", "yawing_moment"),
    description="Ice on the fin: directional stability, rudder power, side force",
    source="FlightGear UIUC model, TwinOtter ice files (lateral factors)",
    parameters=(
        Parameter("eta", "1", neutral=0.0, typical=0.1, low=0.0, high=0.25),
    ),
    apply=apply,
)
