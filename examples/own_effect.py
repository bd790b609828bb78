"""An effect of your own, outside the package: `icing diagnose flown.csv --effects-from examples/own_effect.py`."""

import numpy as np

from icing_env.effects import Effect, Parameter, own


def apply(p: np.ndarray, values: dict) -> None:
    """A camera under the left wing: drag, 5 m to the left of the centre line and 1 m below the c.g."""
    p["CD_parasite"] += np.asarray(values["drag"])
    p["Cn_0"] -= np.asarray(values["drag"])*5.0/p["span"]
    p["Cm_0"] -= np.asarray(values["drag"])*1.0/p["chord"]


EFFECT = Effect(
    name="wing_camera", component="aerodynamics", enters_at=("x_force", "yawing_moment", "pitching_moment"),
    description="A camera in its fairing under the left wing", source="assumed", apply=apply,
    parameters=(Parameter("drag", "1", neutral=0.0, typical=0.006, low=0.0, high=0.03),))

if __name__ == "__main__":  # the same in Python: register it, then fly it or diagnose with it
    from icing_env import scenario
    from testbed.flight import fly

    own.register(EFFECT)
    for drag in (0.0, 0.006, 0.02):
        flown = fly(scenario.load("clear_air", duration=20.0, effects={"wing_camera": {"drag": drag}}), observer=False)
        rudder, throttle = (float(np.nanmean(flown.record[name])) for name in ("rudder", "throttle_left"))
        print(f"drag {drag:.3f}: rudder {np.degrees(rudder):+.2f} deg, throttle {throttle:.2f}")
