"""What is to be flown, how well it was flown, and when it is over.

Tasks: hold (altitude, airspeed, heading), climb (at a rate), holding_pattern (racetrack of one-minute legs and
standard-rate turns, 14 CFR 91 practice), approach (3 deg glide path, slowing, flap in three steps), doublets (hold
between test inputs), steps (of altitude and heading, for settling and overshoot). References go to the autopilot's
TARGET; errors, asked less measured, go to the observation; reward terms and the end of an episode use the truth, which
no observation holds.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

TASKS = ("hold", "climb", "holding_pattern", "approach", "doublets", "steps")
REASONS = ("", "ground", "structure", "upset")  # why an episode was terminated
REWARD_TERMS = ("alive", "altitude", "airspeed", "heading", "climb_rate", "smoothness", "envelope", "terminal")

TASK_FIELDS: list[Field] = [
    ("kind", "1", "index in TASKS"),
    ("start_altitude", "m", "altitude at the start"),
    ("start_airspeed", "m/s", "airspeed at the start"),
    ("start_heading", "rad", "heading at the start"),
    ("climb", "m/s", "rate of climb asked for (climb), of descent on the glide path (approach, negative)"),
    ("slow_to", "m/s", "airspeed at the end of the approach"),
    ("full_flap", "rad", "flap at the end of the approach"),
    ("leg_time", "s", "straight leg of the holding pattern; a turn takes as long"),
    ("altitude_error", "m", "asked less measured"),
    ("climb_rate_error", "m/s", "asked less measured"),
    ("airspeed_error", "m/s", "asked less measured"),
    ("heading_error", "rad", "asked less measured, -pi..pi"),
    ("bank_error", "rad", "asked less measured"),
    *((f"reward_{term}", "1", f"reward term {term}, weight included") for term in REWARD_TERMS),
    ("reward", "1", "their sum"),
    ("elevator_before", "rad", "elevator command a step ago"),
    ("aileron_before", "rad", "aileron command a step ago"),
    ("rudder_before", "rad", "rudder command a step ago"),
    ("steps", "1", "steps flown in this episode"),
    ("limit", "1", "steps after which its time is over"),
    ("truncated", "0/1", "its time is over"),
    ("reason", "1", "index in REASONS; not 0 terminates the episode"),
]
TASK = structured(TASK_FIELDS)
WEIGHTS = np.dtype([(term, "f8") for term in REWARD_TERMS])

# The task "steps": altitude steps up at the first time, heading at the second and back at the third.
STEP_TIMES, ALTITUDE_STEP, HEADING_STEP = (10.0, 50.0, 85.0), 30.0, math.radians(20.0)  # s, m, rad; assumed

# Ends of an episode. Load factors: limit +3.8/-1.52 (FlightGear dhc6-base.xml) times 1.5 (14 CFR 23.303); airspeed:
# 1.25 x Vne 170 kt; attitudes: assumed, beyond recovery by any controller here.
ULTIMATE_LOAD, ULTIMATE_NEGATIVE_LOAD, AIRSPEED_MAX = 5.7, -2.28, 109.0
PHI_MAX, THETA_MAX, ALPHA_MAX = math.radians(120.0), math.radians(75.0), math.radians(45.0)


@kernel
def wrapped(angle: float) -> float:
    """The same angle within -pi..pi."""
    return angle - 2.0*math.pi*math.floor(angle/(2.0*math.pi) + 0.5)


@kernel
def square(error: float, scale: float) -> float:
    """Penalty 0..-1: the squared error in units of `scale`, at most 1."""
    ratio = error/scale
    return -min(ratio*ratio, 1.0)


@kernel
def refer(k: Any, g: Any, time: float) -> None:
    """Write the references of the moment into the autopilot's target `g`."""
    g.speed_mode, g.roll_mode, g.pitch_mode = 1.0, 1.0, 1.0
    g.altitude, g.airspeed, g.heading = k.start_altitude, k.start_airspeed, k.start_heading
    g.climb_rate, g.phi, g.flap = 0.0, 0.0, 0.0
    if k.kind == 1.0:
        g.pitch_mode, g.climb_rate = 2.0, k.climb
        g.altitude = k.start_altitude + k.climb*time
    elif k.kind == 2.0:
        lap = time/k.leg_time - 4.0*math.floor(time/(4.0*k.leg_time))
        g.heading = k.start_heading + math.pi*(min(max(lap - 1.0, 0.0), 1.0) + max(lap - 3.0, 0.0))
    elif k.kind == 3.0:
        share = min(time/60.0, 1.0)
        g.pitch_mode, g.climb_rate = 2.0, k.climb
        g.altitude = k.start_altitude + k.climb*time
        g.airspeed = k.start_airspeed + share*(k.slow_to - k.start_airspeed)
        g.flap = k.full_flap*min(math.floor(time/20.0) + 1.0, 3.0)/3.0
    elif k.kind == 5.0:
        if time >= STEP_TIMES[0]:
            g.altitude = k.start_altitude + ALTITUDE_STEP
        if STEP_TIMES[1] <= time < STEP_TIMES[2]:
            g.heading = k.start_heading + HEADING_STEP


@kernel
def climb_rate(m: Any) -> float:
    """Rate of climb [m/s] in the air mass from measured airspeed, flow angles and attitude."""
    sa, sb, st = math.sin(m.alpha), math.sin(m.beta), math.sin(m.theta)
    ca, cb, ct = math.sqrt(1.0 - sa*sa), math.sqrt(1.0 - sb*sb), math.sqrt(1.0 - st*st)  # all within 90 deg
    return m.airspeed*(ca*cb*st - ct*(sb*math.sin(m.phi) + sa*cb*math.cos(m.phi)))


@kernel
def measure_errors(k: Any, g: Any, m: Any) -> None:
    """Errors of the moment: asked less measured."""
    k.altitude_error = g.altitude - m.altitude
    k.climb_rate_error = g.climb_rate - climb_rate(m)
    k.airspeed_error = g.airspeed - m.airspeed
    k.heading_error = wrapped(g.heading - m.psi)
    k.bank_error = g.phi - m.phi


@kernel
def judge(k: Any, w: Any, x: Any, o: Any, c: Any, u: Any, p: Any) -> None:
    """Count of the step, reward terms and the end of the episode, from the truth."""
    margin = min(c.alpha_stall_left, c.alpha_stall_right) + p.alpha_stall_flap*x.flap - o.alpha
    k.reward_alive = w.alive
    k.reward_altitude = w.altitude*square(k.altitude_error, 50.0)
    k.reward_airspeed = w.airspeed*square(k.airspeed_error, 10.0)
    k.reward_heading = w.heading*square(k.heading_error, 0.5)
    k.reward_climb_rate = w.climb_rate*square(k.climb_rate_error, 5.0)
    k.reward_smoothness = w.smoothness*(
        square(u.elevator - k.elevator_before, 0.1) + square(u.aileron - k.aileron_before, 0.1)
        + square(u.rudder - k.rudder_before, 0.1))/3.0
    k.reward_envelope = -w.envelope*min(max(1.0 - margin/0.05, 0.0), 1.0)
    k.elevator_before, k.aileron_before, k.rudder_before = u.elevator, u.aileron, u.rudder
    k.steps += 1.0
    k.truncated = 1.0 if k.steps >= k.limit else 0.0
    k.reason = ending(x, o, p)
    k.reward_terminal = -w.terminal if k.reason > 0.0 else 0.0
    k.reward = (k.reward_alive + k.reward_altitude + k.reward_airspeed + k.reward_heading + k.reward_climb_rate
                + k.reward_smoothness + k.reward_envelope + k.reward_terminal)


@kernel
def ending(x: Any, o: Any, p: Any) -> float:
    """Index in REASONS: ground, structure, upset, or 0 to fly on."""
    if not x.altitude > p.ground_altitude:
        return 1.0
    if not (ULTIMATE_NEGATIVE_LOAD < o.load_factor < ULTIMATE_LOAD and o.airspeed < AIRSPEED_MAX):
        return 2.0
    down = x.e0*x.e0 - x.e1*x.e1 - x.e2*x.e2 + x.e3*x.e3  # cos phi cos theta
    nose = 2.0*(x.e0*x.e2 - x.e1*x.e3)  # sin theta
    if abs(nose) > math.sin(THETA_MAX) or down < math.cos(PHI_MAX)*math.sqrt(max(1.0 - nose*nose, 0.0)):
        return 3.0
    return 3.0 if abs(o.alpha) > ALPHA_MAX else 0.0


@entry
def refer_rows(task: Any, target: Any, measurement: Any) -> None:
    """References and errors of every row for the time it is."""
    for i in range(len(task)):
        refer(task[i], target[i], measurement[i].time)
        measure_errors(task[i], target[i], measurement[i])
