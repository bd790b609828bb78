"""Another share of the pitch damping comes from the delay of the downwash (Cm_alphadot); the sum stays."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    p["Cm_alphadot"] += values["change"]


EFFECT = Effect(
    name="downwash_lag",
    component="aerodynamics",
    enters_at=("pitching_moment",),
    description="Another share of the pitch damping comes from the delay of the downwash (Cm_alphadot); the sum stays",
    source="Etkin & Reid, Dynamics of Flight, section 5.5",
    parameters=(
        Parameter("change", "1", neutral=0.0, typical=-4.0, low=-12.0, high=8.0),
    ),
    apply=apply,
)
