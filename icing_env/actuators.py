"""Control surfaces: gearing, first-order lag, rate and travel limits, and the hinge moments that can take them away.

The Twin Otter's controls are unboosted cables. Pilot or servo hold a surface against its hinge moment up to a limit;
what is beyond stretches the system and moves the surface. Separation ahead of an aileron (an ice ridge aft of the
boots, Roselawn: NTSB/AAR-96/01) or on the tailplane (flap, push-over: NASA tailplane icing programme) gives such
moments; in ordinary flight they stay below the limit and the surface goes where it is told.

* hinge moment: H = q S_c c_c (Ch_delta delta + Ch_alpha alpha + Ch_stall share) (Etkin & Reid section 2.8)
* float: (H beyond what is held) / stiffness, added to the commanded position
* d(delta)/dt = clip((target - delta)/lag, +-rate)
"""

from __future__ import annotations

from typing import Any

from icing_env.jit import kernel
from icing_env.types import Field

ACTUATOR_PARAMETERS: list[Field] = [
    *(
        (f"{surface}_{quantity}", unit, meaning)
        for surface in ("elevator", "aileron", "rudder")
        for quantity, unit, meaning in (
            ("lag", "s", "time constant"),
            ("rate", "rad/s", "rate limit"),
            ("min", "rad", "travel, lower"),
            ("max", "rad", "travel, upper"),
            ("gearing", "1", "position per command"),
            ("offset", "rad", "position at zero command (rigging)"),
        )
    ),
    ("flap_rate", "rad/s", "flap speed"),
    ("flap_max", "rad", "full flap"),
    *(
        (f"hinge_{surface}_{quantity}", unit, meaning)
        for surface in ("elevator", "aileron")
        for quantity, unit, meaning in (
            ("volume", "m3", "area times chord of the surface"),
            ("delta", "1/rad", "hinge-moment coefficient per deflection"),
            ("alpha", "1/rad", "hinge-moment coefficient per local angle of attack"),
            ("stall", "1", "hinge-moment coefficient of separated flow ahead of the surface"),
            ("hold", "N m", "hinge moment that pilot or servo hold"),
            ("stiffness", "N m/rad", "stiffness of the control system beyond that"),
        )
    ),
]


@kernel
def elevator_hinge_moment(dynamic_pressure: float, alpha_tail: float, tail: float, x: Any, p: Any) -> float:
    """Elevator hinge moment [N m], positive trailing edge down; `tail`: separated share of the tailplane."""
    return dynamic_pressure*p.hinge_elevator_volume*(
        p.hinge_elevator_delta*x.elevator + p.hinge_elevator_alpha*alpha_tail + p.hinge_elevator_stall*tail)


@kernel
def aileron_hinge_moment(dynamic_pressure: float, left: float, right: float, x: Any, p: Any) -> float:
    """Aileron hinge moment [N m], positive rolls left; a separated half wing draws its own aileron up."""
    return dynamic_pressure*p.hinge_aileron_volume*(
        p.hinge_aileron_delta*x.aileron + p.hinge_aileron_stall*(left - right))


@kernel
def floated(hinge_moment: float, hold: float, per_stiffness: float) -> float:
    """Angle [rad] by which a hinge moment moves its surface against the controls: zero while it can be held."""
    return (hinge_moment - min(max(hinge_moment, -hold), hold))*per_stiffness


@kernel
def surface_rate(position: float, target: float, low: float, high: float, per_lag: float, rate: float) -> float:
    """Rate [rad/s] of a surface on its way to a target."""
    return min(max((min(max(target, low), high) - position)*per_lag, -rate), rate)
