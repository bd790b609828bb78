"""Moments of inertia differ from the stated ones."""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values


def apply(p: NDArray, values: Values) -> None:
    for axis in ("xx", "yy", "zz"):
        p[f"inertia_{axis}"] *= 1.0 + values[axis]


EFFECT = Effect(
    name="inertia_error",
    component="mass",
    enters_at=("mass",),
    description="Moments of inertia differ from the stated ones",
    source="published sets differ by 30 % in Ixx (UIUC against the flight records)",
    parameters=(
        Parameter("xx", "1", neutral=0.0, typical=0.15, low=-0.4, high=0.4),
        Parameter("yy", "1", neutral=0.0, typical=0.0, low=-0.4, high=0.4),
        Parameter("zz", "1", neutral=0.0, typical=0.0, low=-0.4, high=0.4),
    ),
    apply=apply,
)
