"""An effect of your own, outside the package: bugs on the leading edge, fewer lift and more drag."""

import numpy as np

from icing_env import aircraft, effects
from icing_env.effects import Effect, Parameter
from icing_env.trim import trim


def apply(p: np.ndarray, values: dict[str, float]) -> None:
    """One unit of bugs costs 5 % of lift slope and 40 drag counts."""
    p["CZ_alpha"] *= 1.0 - 0.05*np.asarray(values["amount"])
    p["CD_parasite"] += 0.004*np.asarray(values["amount"])


effects.LIBRARY["bugs"] = Effect(
    name="bugs", component="aerodynamics", enters_at=("z_force", "x_force"), description="Insects on the leading edge",
    source="assumed", parameters=(Parameter("amount", "1", neutral=0.0, typical=1.0, low=0.0, high=3.0),), apply=apply)

clean = aircraft.load("twin_otter")
for amount in (0.0, 1.0, 3.0):
    steady = trim(effects.with_effects(clean, {"bugs": {"amount": amount}}), airspeed=60.0)
    print(f"bugs {amount:.0f}: alpha {np.degrees(steady.alpha):.2f} deg, throttle {steady.throttle:.2f}")
