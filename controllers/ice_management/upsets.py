"""Function 3, tail and roll: flap that an iced tailplane may carry, tailplane stall, roll upset, what the crew is told.

Tailplane stall (NASA tailplane icing programme): flap raises the downwash, the iced tailplane separates in down-load
and the elevator is drawn down. Signs: the tail's angle near its iced limit, or an elevator hinge moment that attached
flow does not explain. Told as `tail_stall`; answered with less flap and stick back, power left where it is.

Roll upset (Roselawn, NTSB/AAR-96/01): one outer wing separates behind a ridge and draws its aileron up. Signs: an
aileron hinge moment that attached flow does not explain, or a roll acceleration beyond what aileron, rates and
sideslip give while the half wings are unlike. Told as `roll_upset`; answered with unloading, power and aileron.

* tail angle = alpha (1 - downwash_slope) - downwash_flap flap + tail_incidence + q l_t/V (docs/model.md)
* hinge moment H = q S_c c_c (Ch_delta delta + Ch_alpha alpha_t + Ch_stall share) (Etkin & Reid section 2.8), solved for
  the separated share
"""

from __future__ import annotations

import math
from typing import Any

from controllers.ice_management.limits import follow
from controllers.kernels import air_density, airspeed_of, clip
from icing_env.jit import kernel


@kernel
def tail_limit(eta: float, frame: Any, g: Any) -> float:
    """Tail angle, negative lift, at which the tailplane separates with this severity on it [rad, positive]."""
    held = eta if eta <= 0.1 else 0.3 - 0.3297*math.exp(-5.0*eta)  # SIS saturation, as icing_env.severity
    return frame.alpha_tail_stall*max(1.0 - g.tail_stall_loss*held, 0.3)


@kernel
def tail_angle(alpha: float, flap: float, q: float, speed: float, frame: Any) -> float:
    """Angle of attack at the tailplane [rad] in steady downwash."""
    return (alpha*(1.0 - frame.downwash_slope) - frame.downwash_flap*flap + frame.tail_incidence
            + q*frame.tail_arm/speed)


@kernel
def sense_tail(a: Any, m: Any, frame: Any, g: Any, dt: float) -> None:
    """Separated share of the tailplane by its elevator's hinge moment; the flag, with hysteresis."""
    speed = airspeed_of(m)
    angle = tail_angle(m.alpha, m.flap, m.q, speed, frame)
    pressure = 0.5*air_density(m)*speed*speed*frame.hinge_elevator_volume
    share = (m.hinge_moment_elevator/pressure - frame.hinge_elevator_delta*m.elevator
             - frame.hinge_elevator_alpha*angle)/frame.hinge_elevator_stall
    a.tail_share = follow(a.tail_share, clip(share, -1.0, 1.0), dt, g.upset_time)
    slow = tail_angle(a.alpha_slow, m.flap, 0.0, speed, frame)
    near = a.ice_detected == 1.0 and -slow > tail_limit(a.severity_htail, frame, g) - g.tail_near
    if a.tail_share > g.upset_share or near:
        a.tail_stall = 1.0
    elif not near and a.tail_share < 0.5*g.upset_share:
        a.tail_stall = 0.0


@kernel
def limit_flap(a: Any, m: Any, e: Any, frame: Any, g: Any) -> None:
    """Flap limit: what leaves the iced tailplane its margin; less while it stalls, until the ice is gone."""
    suspected = a.severity > g.tail_severity
    if e.health == 1.0 and e.excitation_longitudinal >= g.excitation_high:
        suspected = suspected or e.Cm_elevator/frame.Cm_elevator < 1.0 - g.tail_loss
    if a.ice_detected == 0.0 and a.tail_stall == 0.0:
        a.flap_limit = g.flap_full
        return
    reach = (tail_angle(g.tail_alpha, 0.0, 0.0, 1.0, frame) + tail_limit(a.severity_htail, frame, g) - g.tail_margin)
    allowed = clip(reach/frame.downwash_flap, 0.0, g.flap_full)
    if suspected:
        allowed = min(allowed, g.flap_tail_ice)
    if a.tail_stall == 1.0:
        allowed = min(allowed, max(m.flap - g.flap_step, 0.0))
    a.flap_limit = min(a.flap_limit, allowed)


@kernel
def roll_by_controls(m: Any, frame: Any) -> float:
    """Roll acceleration [rad/s2] that rates, sideslip and controls give the clean aircraft."""
    speed = airspeed_of(m)
    pressure = 0.5*air_density(m)*speed*speed*frame.wing_area*frame.span/frame.inertia_xx
    scale = 0.5*frame.span/speed
    return pressure*(frame.Cl_beta*m.beta + scale*(frame.Cl_p*m.p + frame.Cl_r*m.r)
                     + frame.Cl_aileron*m.aileron + frame.Cl_rudder*m.rudder)


@kernel
def sense_roll(a: Any, m: Any, frame: Any, g: Any, dt: float) -> None:
    """Roll upset: by the aileron's hinge moment, or by roll beyond what controls give with unlike half wings."""
    speed = airspeed_of(m)
    pressure = 0.5*air_density(m)*speed*speed*frame.hinge_aileron_volume
    share = (m.hinge_moment_aileron/pressure - frame.hinge_aileron_delta*m.aileron)/frame.hinge_aileron_stall
    a.wing_share = follow(a.wing_share, clip(share, -1.0, 1.0), dt, g.upset_time)
    # both sides behind the same lag: the difference is the acceleration that controls do not give
    given = (m.p - a.roll_slow)/g.upset_time
    a.roll_slow = follow(a.roll_slow, m.p, dt, g.upset_time)
    a.roll_model = follow(a.roll_model, clip(roll_by_controls(m, frame), -50.0, 50.0), dt, g.upset_time)
    unlike = abs(a.severity_left_wing - a.severity_right_wing) > g.roll_unlike
    strange = abs(given - a.roll_model) if unlike else 0.0
    if abs(a.wing_share) > g.upset_share or strange > g.roll_strange:
        a.roll_upset = 1.0
    elif abs(a.wing_share) < 0.5*g.upset_share and strange < 0.5*g.roll_strange:
        a.roll_upset = 0.0


@kernel
def sense_upsets(a: Any, m: Any, frame: Any, g: Any, dt: float) -> None:
    """Both flags; an aircraft whose hinges nobody has described (volume 0) has none."""
    if frame.hinge_elevator_volume > 0.0:
        sense_tail(a, m, frame, g, dt)
    if frame.hinge_aileron_volume > 0.0:
        sense_roll(a, m, frame, g, dt)
