"""The aircraft's own numbers, so much of the model's: derivatives, mass, thrust line, slipstream; and offsets.

Published derivatives are off by some 5 % in any aircraft, no airframe is quite symmetric, and a calibration leaves
channels and surfaces off by something; a diagnosis fits all of it beside the effects that it looks for. Like
`discrepancy` this belongs to no library: it explains nothing.
"""

from numpy.typing import NDArray

from icing_env.effects.effect import Effect, Parameter, Values
from icing_env.types import DERIVATIVE_NAMES

NUMBERS = (*DERIVATIVE_NAMES, "mass", "engine_arm_z", "CZ_CT", "Cm_elevator_CT", "Cm_alphadot")
OFFSETS = {"bias_airspeed": "m/s", "bias_alpha": "rad", "bias_beta": "rad", "bias_phi": "rad",
           "bias_theta": "rad", "bias_p": "rad/s", "bias_q": "rad/s", "bias_r": "rad/s",
           "bias_ax": "m/s2", "bias_ay": "m/s2", "bias_az": "m/s2", "CY_0": "1", "Cl_0": "1", "Cn_0": "1",
           **{f"{surface}_{of}": unit for surface in ("elevator", "aileron", "rudder")
              for of, unit in (("offset", "rad"), ("gearing", "1"))}}  # fmt: skip


def apply(p: NDArray, values: Values) -> None:
    for name in NUMBERS:
        p[name] *= 1.0 + values[name]
    for name in OFFSETS:
        p[name] += values[name]


EFFECT = Effect(
    name="derivatives",
    component="aerodynamics",
    enters_at=("x_force", "y_force", "z_force", "rolling_moment", "pitching_moment", "yawing_moment", "mass"),
    description="Derivatives, mass, thrust line and slipstream, by what part of the model's; offsets",
    source="docs/model.md, section 20",
    parameters=(*(Parameter(name, "1", neutral=0.0, typical=0.0, low=-0.9 if name == "mass" else -10.0, high=10.0)
                  for name in NUMBERS),
                *(Parameter(name, unit, neutral=0.0, typical=0.0, low=-10.0, high=10.0)
                  for name, unit in OFFSETS.items())),
    apply=apply,
)
