"""More ice on the right half wing than on the left: roll that grows with lift, yaw from drag."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    share = 0.5*p["lift_arm"]*values["eta"]
    p["Cl_0"] += share*p["k_CZ_0_wing"]*p["CZ_0"]
    p["Cl_alpha"] += share*p["k_CZ_alpha_wing"]*p["CZ_alpha"]
    p["Cn_0"] -= share*p["k_CX_0_wing"]*p["CX_0"]


EFFECT = Effect(
    name="asymmetric_ice",
    component="aerodynamics",
    enters_at=("rolling_moment", "yawing_moment"),
    description="More ice on the right half wing than on the left: roll that grows with lift, yaw from drag",
    source="FlightGear UIUC model, uiuc_iced_nonlin.cpp: moments from the difference of the half wings",
    parameters=(
        Parameter("eta", "1", neutral=0.0, typical=0.05, low=-0.15, high=0.15),
    ),
    apply=apply,
)
