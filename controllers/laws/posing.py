"""The programmes that model-predictive control poses in one step: memory, models, numbers (`controllers.laws.mpc`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.ice_management.clean_answer import quasi_pitch
from controllers.kernels import air_density, airspeed_of, alpha_rate
from controllers.laws.augment import pitch_power, roll_power
from controllers.laws.autopilot import AUTOPILOT_FIELDS, damp_yaw
from controllers.laws.autopilot import engage as engage_autopilot
from controllers.laws.guidance import command_bank, guide, surface_scale, turn_pitch_rate
from controllers.laws.l1 import OWN_FIELDS as DISTURBANCE_FIELDS
from controllers.laws.l1 import OWN_GAINS as DISTURBANCE_GAINS
from controllers.laws.l1 import adapt, clean_pitch, clean_roll, start_adapting
from icing_env.atmosphere import G0
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

GOOD = ("elevator", "aileron", "rudder", "throttle_left", "throttle_right", "flap")
OWN_FIELDS: list[Field] = [
    ("alpha_drift", "rad/s", "rate of the angle of attack beyond the pitch rate, filtered"),
    *((f"good_{name}", "rad or 0..1", f"last good command: {name}") for name in GOOD),
    ("failed_pitch", "s", "time since the pitch programme was last solved"),
    ("failed_bank", "s", "time since the bank programme was last solved"),
    ("fallbacks", "1", "steps so far on the last good command or on the PID"),
]
OWN_GAINS: list[Field] = [
    *DISTURBANCE_GAINS,
    ("drift_bandwidth", "rad/s", "bandwidth of the drift of the angle of attack"),
    ("lag", "s", "lag of actuator and instruments in the model"),
    ("weight_pitch", "1/rad2", "of the pitch error squared"),
    ("weight_q", "s2/rad2", "of the pitch-rate error squared"),
    ("weight_elevator", "1/rad2", "of the change of the elevator command squared"),
    ("weight_bank", "1/rad2", "of the bank error squared"),
    ("weight_p", "s2/rad2", "of the roll rate squared"),
    ("weight_aileron", "1/rad2", "of the change of the aileron command squared"),
    ("weight_slack", "1/rad2", "of the excess over a soft limit squared"),
    ("weight_excess", "1/rad", "of the excess over a soft limit"),
    ("elevator_rate", "rad/s", "largest rate of the elevator"),
    ("aileron_rate", "rad/s", "largest rate of the aileron"),
    ("hold_time", "s", "time that the last good command stands before the PID takes over"),
    ("airspeed_grid", "m/s", "step of the airspeeds at which models are made"),
    ("density_grid", "kg/m3", "the same for densities"),
]
MPC = structured([*OWN_FIELDS, *DISTURBANCE_FIELDS, *AUTOPILOT_FIELDS])  # own first: see `controllers.laws.l1`
PITCH, BANK = (2, 1, 0), (1, 0, 1)  # which state is the attitude, the rate, the limited one
# columns of what one step works on: is the row sound; numbers of both programmes; PID, answers
SOUND, Q_PITCH, Q_BANK, ROOM, MODEL_PITCH, MODEL_BANK, ANSWER = 0, 1, 8, 14, 20, 40, 52
COLUMNS = ANSWER + 2


@kernel
def sound(m: Any, t: Any, adv: Any) -> bool:
    """True where everything that the law looks at is finite."""
    seen = m.airspeed + m.alpha + m.beta + m.p + m.q + m.r + m.phi + m.theta + m.psi + m.ax + m.ay + m.az
    held = m.elevator + m.aileron + m.rudder + m.flap + m.altitude + m.pressure + m.temperature
    asked = t.theta + t.altitude + t.climb_rate + t.throttle + t.airspeed + t.phi + t.heading + t.flap
    limits = adv.alpha_limit + adv.bank_limit + adv.airspeed_limit + adv.flap_limit + adv.pitch_limit + adv.climb_spare
    return math.isfinite(seen + held + asked + limits)


@kernel
def keep(a: Any, c: Any) -> None:
    """Remember the command as good."""
    a.good_elevator, a.good_aileron, a.good_rudder, a.good_flap = c.elevator, c.aileron, c.rudder, c.flap
    a.good_throttle_left, a.good_throttle_right = c.throttle_left, c.throttle_right


@kernel
def stand(a: Any, c: Any) -> None:
    """Let the last good command stand."""
    a.fallbacks += 1.0
    if a.engaged == 1.0:
        c.elevator, c.aileron, c.rudder, c.flap = a.good_elevator, a.good_aileron, a.good_rudder, a.good_flap
        c.throttle_left, c.throttle_right = a.good_throttle_left, a.good_throttle_right


@kernel
def on_grid(m: Any, g: Any) -> tuple[float, float]:
    """Airspeed and density of the nearest point of the grid: so that plans can be kept, and rows share them."""
    v = max(g.airspeed_grid*math.floor(airspeed_of(m)/g.airspeed_grid + 0.5), 15.0)
    return v, g.density_grid*max(math.floor(air_density(m)/g.density_grid + 0.5), 1.0)


@kernel
def model_pitch(w: Any, m: Any, f: Any, g: Any) -> None:
    """Matrices of alpha, q, theta, elevator at the airspeed of the grid (Etkin & Reid, 3rd ed., section 4.9)."""
    v, density = on_grid(m, g)
    cm_alpha, cm_q = quasi_pitch(f, density)
    force = 0.5*density*v*f.wing_area/f.mass
    moment = 0.5*density*v*v*f.wing_area*f.chord/f.inertia_yy
    j = MODEL_PITCH
    w[j:j + 20] = 0.0
    w[j], w[j + 1], w[j + 3] = -force*(f.CX_0 - f.CZ_alpha), 1.0, force*f.CZ_elevator
    w[j + 4], w[j + 5], w[j + 7] = moment*cm_alpha, 0.5*moment*f.chord/v*cm_q, moment*f.Cm_elevator
    w[j + 9], w[j + 15], w[j + 19] = 1.0, -1.0/g.lag, 1.0/g.lag


@kernel
def model_bank(w: Any, m: Any, f: Any, g: Any) -> None:
    """Matrices of p, phi, aileron at the airspeed of the grid."""
    v, density = on_grid(m, g)
    moment = 0.5*density*v*v*f.wing_area*f.span/f.inertia_xx
    j = MODEL_BANK
    w[j:j + 12] = 0.0
    w[j], w[j + 2] = 0.5*moment*f.span/v*f.Cl_p, moment*f.Cl_aileron
    w[j + 3], w[j + 8], w[j + 11] = 1.0, -1.0/g.lag, 1.0/g.lag


@kernel
def pose(w: Any, a: Any, m: Any, adv: Any, f: Any, g: Any, theta: float) -> None:
    """What both programmes depend on: present rates, errors, last command, room up to the limits."""
    level, j = turn_pitch_rate(m), Q_PITCH
    w[j], w[j + 2], w[j + 3] = m.q - level + a.alpha_drift, m.q - level, 0.0
    w[j + 1] = clean_pitch(m, f) + pitch_power(m, f)*f.Cm_elevator*(a.elevator_adaptive + a.sigma_pitch_start)
    w[j + 4], w[j + 5], w[j + 6] = m.theta - theta, m.q - level, a.good_elevator - m.elevator
    j = Q_BANK
    w[j] = clean_roll(m, f) + roll_power(m, f)*f.Cl_aileron*(a.aileron_adaptive + a.sigma_roll_start)
    w[j + 1], w[j + 2] = m.p, 0.0
    w[j + 3], w[j + 4], w[j + 5] = m.phi - a.bank_command, m.p, a.good_aileron - m.aileron
    w[ROOM], w[ROOM + 1] = m.elevator, m.aileron
    w[ROOM + 2] = adv.alpha_limit - g.alpha_margin - m.alpha
    w[ROOM + 3], w[ROOM + 4] = adv.bank_limit + m.phi, adv.bank_limit - m.phi
    model_pitch(w, m, f, g)
    model_bank(w, m, f, g)


@entry
def prepare(work: NDArray[np.float64], memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any],
            target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any],
            dt: float) -> None:
    """Outer loops, disturbances and yaw damper of every row; the programmes' numbers into `work` [rows, COLUMNS]."""
    for i in range(len(command)):
        w, a, c, m, t, adv = work[i], memory[i], command[i], measurement[i], target[i], advisory[i]
        f = airframe[i if len(airframe) > 1 else 0]
        g = gains[i if len(gains) > 1 else 0]
        w[SOUND] = 1.0 if sound(m, t, adv) else 0.0
        if w[SOUND] == 0.0:
            stand(a, c)
            continue
        if a.engaged == 0.0:
            engage_autopilot(a, m, t, g)
            start_adapting(a, m, f, g)
            a.good_elevator, a.good_aileron = m.elevator, m.aileron
        else:
            adapt(a, m, f, g, dt)
        drift = alpha_rate(m, G0) - m.q + turn_pitch_rate(m)
        a.alpha_drift += (1.0 - math.exp(-g.drift_bandwidth*dt))*(drift - a.alpha_drift)
        scale = surface_scale(m, g)
        theta = guide(a, c, m, t, adv, g, scale, dt)
        damp_yaw(a, c, m, g, scale, dt)
        command_bank(a, m, t, adv, g, dt)
        pose(w, a, m, adv, f, g, theta)
        w[ROOM + 5] = theta
