"""L1 adaptive: the autopilot, and beside it a moment estimated and cancelled that the clean aircraft would not have.

L1 adaptive control with the piecewise-constant adaptation law (Hovakimyan & Cao, L1 Adaptive Control Theory, SIAM 2010,
section 3.3; as an augmentation of a baseline controller in section 6.1), on the pitch and the roll rate, each alone:

* predictor: rate_hat' = F + a (rate_hat - rate) + sigma, F the clean aircraft's angular acceleration at the measured
  flow angles, rates and surfaces
* adaptation, every step: sigma = -(e^(a dt) / Phi) (rate_hat - rate), Phi = (e^(a dt) - 1)/a
* surface = autopilot - C(s) (sigma - sigma at engagement)/(effectiveness of the clean surface), C = w/(s + w)

Within the bandwidth w the aircraft then answers the autopilot as the clean one would; a lack of surface power, of
stability or of damping, and any moment, are one and the same to it. Why L1 and not model-reference adaptation with
projection: the adaptation is as fast as the samples, and C alone sets how much of it reaches the surface, so that its
robustness is that of a linear loop whatever the excitation; gains that are adapted need excitation, which level flight
does not give, and drift in turbulence. What it cannot do: sigma is a sum, it does not say which derivative changed.

The measured surface (not the command) enters F, so the actuator is not taken for ice. The estimate of the observer is
not used. `authority` bounds sigma (a projection onto an interval).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import airspeed_of, clip
from controllers.laws.augment import load_augmented, pitch_power, roll_power
from controllers.laws.autopilot import AUTOPILOT_FIELDS, damp_yaw, engage, hold_bank, hold_pitch
from controllers.laws.guidance import guide, surface_scale
from icing_env.jit import entry, kernel
from icing_env.types import Field, structured

OWN_FIELDS: list[Field] = [
    ("q_predicted", "rad/s", "predictor of the pitch rate"),
    ("p_predicted", "rad/s", "predictor of the roll rate"),
    ("sigma_pitch", "rad", "elevator worth the pitching moment that the clean aircraft would not have"),
    ("sigma_roll", "rad", "aileron worth the rolling moment that the clean aircraft would not have"),
    ("sigma_pitch_start", "rad", "the first at engagement, left to the trim"),
    ("sigma_roll_start", "rad", "the second at engagement"),
    ("elevator_adaptive", "rad", "filtered sigma_pitch: taken off the elevator"),
    ("aileron_adaptive", "rad", "filtered sigma_roll: taken off the aileron"),
]
OWN_GAINS: list[Field] = [
    ("predictor", "1/s", "rate at which the predictors' errors decay"),
    ("bandwidth_pitch", "rad/s", "bandwidth of the elevator's low pass"),
    ("bandwidth_roll", "rad/s", "bandwidth of the aileron's low pass"),
    ("authority", "rad", "largest surface that the adaptation may ask for"),
]
L1 = structured([*OWN_FIELDS, *AUTOPILOT_FIELDS])  # in this order: numba would take the other for an AUTOPILOT row


def default_gains(name: str | Path = "l1") -> NDArray[Any]:
    """Gains of adaptation, outer loops and autopilot, one row. Raises InputError for a file that does not fit."""
    return load_augmented(name, OWN_GAINS)


def init(n: int) -> NDArray[Any]:
    """Memory of `n` aircraft, not yet engaged (L1 rows)."""
    return np.zeros(n, L1)


@kernel
def clean_pitch(m: Any, f: Any) -> float:
    """Pitch acceleration [rad/s2] of the clean aircraft as it flies now (Stevens, Lewis & Johnson, section 1.7)."""
    qhat = 0.5*m.q*f.chord/airspeed_of(m)
    cm = f.Cm_0 + f.Cm_alpha*m.alpha + f.Cm_q*qhat + f.Cm_elevator*m.elevator + f.Cm_flap*m.flap
    inertial = (f.inertia_zz - f.inertia_xx)*m.p*m.r + f.inertia_xz*(m.r*m.r - m.p*m.p)
    return pitch_power(m, f)*cm + inertial/f.inertia_yy


@kernel
def clean_roll(m: Any, f: Any) -> float:
    """Roll acceleration [rad/s2] of the clean aircraft as it flies now; the small part through Ixz is left out."""
    half = 0.5*f.span/airspeed_of(m)
    cl = (f.Cl_beta*m.beta + f.Cl_p*m.p*half + f.Cl_r*m.r*half
          + f.Cl_aileron*m.aileron + f.Cl_rudder*m.rudder)
    return roll_power(m, f)*cl + (f.inertia_yy - f.inertia_zz)*m.q*m.r/f.inertia_xx


@kernel
def start_adapting(a: Any, m: Any, f: Any, g: Any) -> None:
    """Rates as measured, and the disturbance with which the present flight would be steady: that is for the trim."""
    a.q_predicted, a.p_predicted = m.q, m.p
    a.sigma_pitch_start = clip(-clean_pitch(m, f)/(pitch_power(m, f)*f.Cm_elevator), -g.authority, g.authority)
    a.sigma_roll_start = clip(-clean_roll(m, f)/(roll_power(m, f)*f.Cl_aileron), -g.authority, g.authority)
    a.sigma_pitch, a.sigma_roll = a.sigma_pitch_start, a.sigma_roll_start


@kernel
def adapt(a: Any, m: Any, f: Any, g: Any, dt: float) -> None:
    """Both adaptation laws, low passes and predictors."""
    decay = math.exp(-g.predictor*dt)
    spread = (1.0 - decay)/g.predictor
    pitch, roll = pitch_power(m, f)*f.Cm_elevator, roll_power(m, f)*f.Cl_aileron
    error_q, error_p = a.q_predicted - m.q, a.p_predicted - m.p
    limit = g.authority
    a.sigma_pitch = clip(-decay*error_q/(spread*pitch), -limit, limit)
    a.sigma_roll = clip(-decay*error_p/(spread*roll), -limit, limit)
    a.q_predicted = m.q + decay*error_q + spread*(clean_pitch(m, f) + pitch*a.sigma_pitch)
    a.p_predicted = m.p + decay*error_p + spread*(clean_roll(m, f) + roll*a.sigma_roll)
    share_pitch, share_roll = 1.0 - math.exp(-g.bandwidth_pitch*dt), 1.0 - math.exp(-g.bandwidth_roll*dt)
    a.elevator_adaptive += share_pitch*(a.sigma_pitch - a.sigma_pitch_start - a.elevator_adaptive)
    a.aileron_adaptive += share_roll*(a.sigma_roll - a.sigma_roll_start - a.aileron_adaptive)


@entry
def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every aircraft, in place.

    Args:
        memory: L1 rows, one per aircraft; changed.
        command: COMMAND rows; surfaces, power levers and flap are written, ice protection is left alone.
        measurement: MEASUREMENT rows.
        estimate: not used by this law.
        target: TARGET rows.
        advisory: ADVISORY rows.
        airframe: one row for all or one per aircraft, the clean aircraft's size, inertia and moment derivatives.
        gains: one row of `default_gains` for all, or one per aircraft.
        dt: time since the last step [s].
    """
    for i in range(len(command)):
        a, c, m, t, adv = memory[i], command[i], measurement[i], target[i], advisory[i]
        f = airframe[i if len(airframe) > 1 else 0]
        g = gains[i if len(gains) > 1 else 0]
        if a.engaged == 0.0:
            engage(a, m, t, g)
            start_adapting(a, m, f, g)
        else:
            adapt(a, m, f, g, dt)
        scale = surface_scale(m, g)
        theta = guide(a, c, m, t, adv, g, scale, dt)
        hold_pitch(a, c, m, adv, g, theta, scale, dt)
        hold_bank(a, c, m, t, adv, g, scale, dt)
        damp_yaw(a, c, m, g, scale, dt)
        c.elevator = clip(c.elevator - a.elevator_adaptive, g.elevator_min, g.elevator_max)
        c.aileron = clip(c.aileron - a.aileron_adaptive, -g.aileron_max, g.aileron_max)
