"""Evaluate a control-law adaptation of your own: gains that follow the dynamic pressure left to an iced wing."""

import sys

import numpy as np

from controllers.choice import LAWS, Choice
from controllers.laws.autopilot import default_gains, init  # noqa: F401  what the law starts from
from controllers.laws.autopilot import step as fly


def step(memory, command, measurement, estimate, target, advisory, airframe, gains, dt):
    """The autopilot with surface gains raised by what the observer says the elevator has lost, at most by half."""
    own = np.repeat(gains, len(command))
    lost = np.clip(estimate["Cm_elevator"]/airframe["Cm_elevator"], 0.67, 1.0)
    own["K_theta"], own["K_q"] = own["K_theta"]/lost, own["K_q"]/lost
    fly(memory, command, measurement, estimate, target, advisory, airframe, own, dt)


if __name__ == "__main__":
    LAWS["mine"] = Choice(__name__, "the autopilot, its gains over the elevator power left", "adaptive")
    from testbed.comparison.compare import compare  # after the law has its name
    from testbed.comparison.suite import load

    names = ("altitude_rms", "airspeed_rms", "altitude_overshoot", "elevator_activity", "stalled")
    result = compare(load("quick"), ["autopilot", "mine"], int(sys.argv[1]) if len(sys.argv) > 1 else 4)
    for row in result["rows"]:
        told = ((name, row["metrics"][name]["mean"]) for name in names)
        print(f"{row['scenario']:20s} {row['controller']:10s} {'protected' if row['protection'] else 'bare':10s}",
              *(f"{name} {'-' if mean is None else format(mean, '.3g')}" for name, mean in told), sep="  ")
