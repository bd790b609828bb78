"""Function 3, its limits: what may still be flown with what is known now (`controllers.protection` keeps them).

The severity of the worse half wing, with as much of its standard error as `doubt` says, decides. All that follows is
1-g flight at the highest angle of attack allowed (Anderson, Aircraft Performance and Design, sections 5.4 and 5.9):

* alpha_limit = alpha_stall (less with flap) - shift severity - margin - gusts, gusts = k sigma(alpha), the fluctuation
  of alpha that was measured, sigma_w/V with what the controls add (Merret, Hossain & Bragg, AIAA 2002-0814, put their
  protection into atmospheric disturbance; a margin of a standard deviation of the gusts is assumed)
* CL_max = CL at the iced stall angle, slope lost with severity or, where the elevator has shown more, as estimated;
  V_s = sqrt(2 m g/(rho S CL_max)), airspeed_limit = factor V_s
* bank_limit = acos(1/n_max), n_max = (V/(factor V_s))^2
* load_factor_limit = lift at alpha_limit over weight, at most the limit load, which at high speed lowers alpha_limit
* pitch_limit = alpha_limit + the climb angle that full power would sustain at this airspeed
* flap_limit: `controllers.ice_management.upsets`

Margins for doubt and gusts belong to ice: a clean aircraft in clear air keeps its clean limits whatever the weather.
"""

from __future__ import annotations

import math
from typing import Any

from controllers.kernels import air_density, airspeed_of, airspeed_rate, clip
from icing_env.atmosphere import G0
from icing_env.jit import kernel


@kernel
def follow(slow: float, value: float, dt: float, time: float) -> float:
    """`slow` one step nearer to `value` by a first-order lag; it stays where `value` is no number."""
    return slow + (value - slow)*min(dt/time, 1.0) if math.isfinite(value) else slow


@kernel
def wing_severity(a: Any, g: Any) -> float:
    """Severity 0..1 of the worse half wing, of what the aircraft as a whole and its half wings are believed to have."""
    parts = max(a.severity_left_wing, a.severity_right_wing)/g.eta_severe
    return clip(max(a.severity, parts), 0.0, 1.0)


@kernel
def iced_share(a: Any, severity: float, g: Any) -> float:
    """How far margins for ice apply: 0 while a clean aircraft is believed, 1 from twice the detection threshold on."""
    return max(a.ice_detected, clip((severity - g.clear_severity)/(2.0*g.detect_severity - g.clear_severity), 0.0, 1.0))


@kernel
def doubt(a: Any, g: Any) -> float:
    """Standard error of the severity, from its confidence (`sense.assess`), at most that of knowing nothing."""
    confidence = clip(a.confidence, 1e-3, 1.0)
    return min(g.confidence_half*math.sqrt(1.0/confidence - 1.0), g.doubt_max)


@kernel
def watch(a: Any, m: Any, frame: Any, g: Any, dt: float) -> None:
    """Slow part and fluctuation of alpha; climb angle that full power would sustain here."""
    a.alpha_slow = follow(a.alpha_slow, m.alpha, dt, g.alpha_slow_time)
    away = m.alpha - a.alpha_slow
    a.alpha_energy = follow(a.alpha_energy, min(away*away, 0.01), dt, g.gust_time)
    sine = math.sin(m.theta - m.alpha*math.cos(m.phi))
    thrust = max(m.thrust_left + m.thrust_right, 0.0)
    lever = clip(0.5*(m.throttle_left + m.throttle_right), g.lever_known, 1.0)
    spare = airspeed_rate(m, G0)/G0 + sine + thrust*(1.0/lever - 1.0)/(frame.mass*G0)
    a.climb_spare = follow(a.climb_spare, clip(spare, -0.5, 0.5), dt, g.climb_time)


@kernel
def lost_slope(a: Any, severity: float, e: Any, frame: Any, g: Any) -> float:
    """Share of the lift slope lost: with the severity, or on an iced aircraft what the elevator has shown if more."""
    loss = g.derivative_loss_severe*severity
    if a.ice_detected == 1.0 and e.health == 1.0 and e.excitation_longitudinal >= g.excitation_high:
        shown = 1.0 - (e.CL_alpha + g.doubt_share*e.CL_alpha_std)/(frame.CX_0 - frame.CZ_alpha)
        if math.isfinite(shown):
            loss = max(loss, min(shown, g.derivative_loss_max))
    return loss


@kernel
def limit_envelope(a: Any, m: Any, e: Any, frame: Any, g: Any, dt: float) -> None:
    """Limits of angle of attack, airspeed, bank, load and pitch for what is known of ice, mass, density and gusts."""
    watch(a, m, frame, g, dt)
    known = wing_severity(a, g)
    iced = iced_share(a, known, g)
    severity = min(known + g.doubt_share*doubt(a, g)*iced, 1.0)
    flap = clip(m.flap, 0.0, g.flap_full)
    stall = frame.alpha_stall + g.alpha_flap*flap - g.alpha_shift*severity
    gusts = min(g.gust_share*math.sqrt(a.alpha_energy), g.gust_max)*iced
    margin = g.alpha_margin_clean + (g.alpha_margin - g.alpha_margin_clean)*iced
    a.alpha_limit = stall - margin - gusts - g.alpha_unload*a.roll_upset
    kept = 1.0 - lost_slope(a, severity, e, frame, g)
    flap_lift = g.CL_max_flap*flap
    lift = max(flap_lift - frame.CZ_0 - kept*frame.CZ_alpha*stall, 0.1)
    density, speed = air_density(m), airspeed_of(m)
    weight = 2.0*frame.mass*G0/(density*frame.wing_area)
    loaded = (g.load_max*weight/(speed*speed) - flap_lift + frame.CZ_0)/-frame.CZ_alpha
    a.alpha_limit = min(a.alpha_limit, max(loaded, 0.0))
    stall_speed = math.sqrt(weight/lift)
    a.airspeed_limit = stall_speed*(g.stall_factor_clean + (g.stall_factor_iced - g.stall_factor_clean)*iced)
    level = stall_speed*(g.bank_factor_clean + (g.bank_factor_iced - g.bank_factor_clean)*iced)
    ratio = max(m.airspeed, 1.0)/level
    bank = clip(math.acos(1.0/max(ratio*ratio, 1.0)), g.bank_min, g.bank_max)
    a.bank_limit = bank + (g.bank_min - bank)*a.roll_upset
    allowed = flap_lift - frame.CZ_0 - kept*frame.CZ_alpha*a.alpha_limit
    a.load_factor_limit = clip(allowed*speed*speed/weight, 0.0, g.load_max)
    a.pitch_limit = a.alpha_limit + a.climb_spare
