"""A pilot flying attitude by hand: sees pitch, bank and airspeed, with a human's delay, muscles and noise.

The precision model of McRuer & Krendel (Mathematical Models of Human Pilot Behavior, AGARDograph 188, 1974) in each of
pitch and bank; Hosman (Pilot's Perception and Control of Aircraft Motions, Delft, 1996) uses the same for the visual
channel. From error e to surface:

* Y = K (T_lead s + 1)/(T_lag s + 1) e^(-delay s) w^2/(s^2 + 2 zeta w s + w^2), and a slow trimming of what is held
* K goes with the root of the dynamic pressure ratio, lead and lag are those for which pilot and clean aircraft
  together are near w_c/s at the crossover: the pilot has learned the clean aircraft, and does not adapt to ice
* remnant: the error is perceived as e (1 + n), n white, of power density pi times `remnant` for e of unit variance
  (Levison, Baron & Kleinman, "A model for human controller remnant", IEEE Trans. Man-Machine Systems 10, 1969:
  -20 dB); counter-based draws, keyed by the air data at engagement

The outer loops of `controllers.laws.guidance`, with less gain, are the flight director that the pilot follows, and the
power levers are set as they say. The feet are on the floor: the rudder stays where it was.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import clip, integrated
from controllers.laws.guidance import GUIDANCE_FIELDS, command_bank, engage_guidance, guide, load_gains, surface_scale
from icing_env.jit import entry, kernel
from icing_env.random import BLOCK, normal4
from icing_env.types import Field, structured

STREAM_REMNANT = np.uint64(64)  # beyond those of icing_env.random
LONGEST = 64  # samples of delay that fit
PILOT_FIELDS: list[Field] = [
    ("key", "1", "of the remnant's draws: a whole number"),
    ("count", "1", "steps since engagement"),
    *((f"{part}_{axis}", "rad", f"{meaning}, {axis}") for axis in ("pitch", "bank") for part, meaning in (
        ("slow", "error behind the lag"),
        ("arm", "deflection of stick and surface beyond trim"),
        ("trim", "surface held by trim"))),
    ("arm_rate_pitch", "rad/s", "rate of the deflection, pitch"),
    ("arm_rate_bank", "rad/s", "the same, bank"),
    *GUIDANCE_FIELDS,
    ("rudder", "rad", "rudder at engagement"),
]
OWN_GAINS: list[Field] = [
    ("director_climb", "1", "climb-rate gains of the flight director over those of the guidance"),
    ("director_altitude", "1", "its altitude gain over that of the guidance"),
    ("director_heading", "1", "its heading gain over that of the guidance"),
    ("delay", "s", "time from seeing to moving"),
    ("arm_frequency", "rad/s", "natural frequency of arm and stick"),
    ("arm_damping", "1", "their damping ratio"),
    ("remnant", "1", "normalised power density of the perception's noise, over pi"),
    ("K_pitch", "1", "elevator per pitch error"),
    ("lead_pitch", "s", "lead in pitch"),
    ("lag_pitch", "s", "lag in pitch"),
    ("K_trim_pitch", "1/s", "elevator trim rate per pitch error"),
    ("K_bank", "1", "aileron per bank error"),
    ("lead_bank", "s", "lead in bank"),
    ("lag_bank", "s", "lag in bank"),
    ("K_trim_bank", "1/s", "aileron trim rate per bank error"),
]
PILOT = np.dtype([*structured(PILOT_FIELDS).descr, ("seen_pitch", "f8", (LONGEST,)), ("seen_bank", "f8", (LONGEST,))])


def default_gains(name: str | Path = "pilot") -> NDArray[Any]:
    """Gains of the outer loops, as a pilot can follow them, and of the pilot, one row.

    Raises InputError for a file that does not fit.
    """
    row = load_gains(name, OWN_GAINS)
    for gain, share in (("K_climb", "climb"), ("K_climb_integral", "climb"), ("K_altitude", "altitude"),
                        ("K_heading", "heading")):  # fmt: skip
        row[gain] *= row[f"director_{share}"]
    return row


def init(n: int) -> NDArray[Any]:
    """Pilots of `n` aircraft, hands not yet on the controls (PILOT rows)."""
    return np.zeros(n, PILOT)


def transfer(gains: NDArray[Any], axis: str, frequency: NDArray[Any]) -> NDArray[np.complex128]:
    """Surface over error at 72 m/s, 2200 m, without trimming and remnant.

    Args:
        gains: a row of `default_gains`.
        axis: "pitch" or "bank".
        frequency: rad/s, any shape.
    """
    g, s = gains.reshape(-1)[0], 1j*np.asarray(frequency)
    lead_lag = (g[f"lead_{axis}"]*s + 1.0)/(g[f"lag_{axis}"]*s + 1.0)
    arm = g["arm_frequency"]**2/(s*s + 2.0*g["arm_damping"]*g["arm_frequency"]*s + g["arm_frequency"]**2)
    return np.asarray(g[f"K_{axis}"]*lead_lag*arm*np.exp(-g["delay"]*s))


@kernel
def engage(a: Any, m: Any, t: Any, g: Any) -> None:
    """Take the controls as they are."""
    engage_guidance(a, m, t, g)
    a.trim_pitch, a.trim_bank, a.rudder = m.elevator, m.aileron, m.rudder
    a.key = math.floor(clip(abs(m.airspeed)*1e6 + abs(m.altitude)*1e3, 0.0, 1e15))


@kernel
def delayed(seen: Any, count: float, error: float, g: Any, dt: float) -> float:
    """Put the error of now into the store, and take out the one of a delay ago."""
    now = int(count) % LONGEST
    seen[now] = error
    back = int(clip(math.floor(g.delay/dt + 0.5), 0.0, LONGEST - 1.0))
    return seen[(now - back) % LONGEST]


@kernel
def equalised(slow: float, error: float, lead: float, lag: float, dt: float) -> tuple[float, float]:
    """Lag state and output of (lead s + 1)/(lag s + 1), one step on."""
    rate = (error - slow)/max(lag, dt)
    return slow + dt*rate, slow + lead*rate


@kernel
def moved(arm: float, rate: float, wanted: float, g: Any, dt: float) -> tuple[float, float]:
    """Arm and stick one step on (semi-implicit Euler)."""
    w = g.arm_frequency
    rate += dt*w*(w*(wanted - arm) - 2.0*g.arm_damping*rate)
    return arm + dt*rate, rate


@kernel
def fly_pitch(a: Any, c: Any, g: Any, error: float, scale: float, dt: float) -> None:
    """Elevator from the pitch error as perceived."""
    late = delayed(a.seen_pitch, a.count, error, g, dt)
    a.slow_pitch, asked = equalised(a.slow_pitch, late, g.lead_pitch, g.lag_pitch, dt)
    a.arm_pitch, a.arm_rate_pitch = moved(a.arm_pitch, a.arm_rate_pitch, scale*g.K_pitch*asked, g, dt)
    wanted = a.trim_pitch + a.arm_pitch
    a.trim_pitch = integrated(a.trim_pitch, scale*g.K_trim_pitch*late*dt, wanted, g.elevator_min, g.elevator_max)
    c.elevator = clip(wanted, g.elevator_min, g.elevator_max)


@kernel
def fly_bank(a: Any, c: Any, g: Any, error: float, scale: float, dt: float) -> None:
    """Aileron from the bank error as perceived."""
    late = delayed(a.seen_bank, a.count, error, g, dt)
    a.slow_bank, asked = equalised(a.slow_bank, late, g.lead_bank, g.lag_bank, dt)
    a.arm_bank, a.arm_rate_bank = moved(a.arm_bank, a.arm_rate_bank, scale*g.K_bank*asked, g, dt)
    wanted = a.trim_bank + a.arm_bank
    a.trim_bank = integrated(a.trim_bank, scale*g.K_trim_bank*late*dt, wanted, -g.aileron_max, g.aileron_max)
    c.aileron = clip(wanted, -g.aileron_max, g.aileron_max)


@entry
def step(memory: NDArray[Any], command: NDArray[Any], measurement: NDArray[Any], estimate: NDArray[Any],
         target: NDArray[Any], advisory: NDArray[Any], airframe: NDArray[Any], gains: NDArray[Any], dt: float) -> None:
    """One step of every pilot, in place.

    Args:
        memory: PILOT rows, one per aircraft; changed.
        command: COMMAND rows; surfaces, power levers and flap are written, ice protection is left alone.
        measurement: MEASUREMENT rows.
        estimate, airframe: not used by this law.
        target: TARGET rows.
        advisory: ADVISORY rows.
        gains: one row of `default_gains` for all, or one per aircraft.
        dt: time since the last step [s]; a delay of more than 63 steps is cut to that.
    """
    for i in range(len(command)):
        a, c, m, t, adv = memory[i], command[i], measurement[i], target[i], advisory[i]
        g = gains[i if len(gains) > 1 else 0]
        if a.engaged == 0.0:
            engage(a, m, t, g)
        scale = math.sqrt(surface_scale(m, g))
        theta = guide(a, c, m, t, adv, g, surface_scale(m, g), dt)
        command_bank(a, m, t, adv, g, dt)
        n_pitch, n_bank, _, _ = normal4(np.uint64(a.key), STREAM_REMNANT, np.uint64(a.count), BLOCK[0])
        size = math.sqrt(math.pi*g.remnant/dt)
        fly_pitch(a, c, g, (m.theta - theta)*(1.0 + size*n_pitch), scale, dt)
        fly_bank(a, c, g, (m.phi - a.bank_command)*(1.0 + size*n_bank), scale, dt)
        c.rudder = clip(a.rudder, -g.rudder_max, g.rudder_max)
        a.count += 1.0
