"""Shaft powers that drive the model along a record: from what tells them best.

Thrust where recorded, through the propeller's chart; else torque, less what spins a propeller up; else the levers,
through the engines' spool, with a chart between lever and power that is uncertain (`candidates.nuisances`); else what
the recorded axial acceleration asks for beside the model's own drag. That acceleration is then no longer there to be
compared, and nothing that a thrust may do as well can be told.

Nobody measures thrust in ordinary flight tests: it is computed from the torque by a chart of the record's owner, which
no published one of this aircraft is known well enough to contradict. Only where the side file says that thrust was
measured (`sensors.thrust.source`) do torque and the model's chart drive it, and is what they make compared with it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter, savgol_filter

from icing_env.atmosphere import density, pressure
from icing_env.propulsion import power_available
from icing_env.record import FloatArray

SIDES = ("left", "right")
SPIN = 1.0  # s, over which a line through the propeller's speed tells how it changes, and quadratics how a power does
EXPLAINS = 0.5  # of what recorded thrust has beside recorded power, that spinning up has to explain (assumed)
Powers = dict[str, FloatArray]


def powers(row: NDArray, values: Mapping[str, FloatArray], altitude: FloatArray, dt: float, notes: list[str],
           measured: bool = False) -> tuple[str, Powers]:  # fmt: skip
    """Powers left and right (W) at every sample, and where they come from: "torque", "thrust", "throttle", "balance".

    Args:
        row: one PARAMETERS row.
        values: channels by name (N,).
        altitude: m (N,).
        dt: s.
        notes: gets what was assumed.
        measured: whether thrust, where recorded, was measured and not computed.
    """
    p = row[0]
    per_power = thrust_per_power(p, values["airspeed"], values["alpha"])
    torque, thrust = (all(f"{name}_{s}" in values for s in SIDES) for name in ("torque", "thrust"))
    if torque and (measured or not thrust):
        return "torque", _shaft_powers(p, values, per_power, dt, notes)
    if thrust:
        found = {f"power_{s}": values[f"thrust_{s}"] / per_power for s in SIDES}
        notes.append(_of_the_chart(found, _shaft_powers(p, values, per_power, dt, [])) if torque
                     else "torque not recorded: power from the recorded thrust")
        return "thrust", found
    if all(f"throttle_{s}" in values for s in SIDES):
        notes.append("thrust and torque not recorded: power from the levers, through the published chart and spool")
        full = np.array([power_available(pressure(float(h)), p) for h in altitude])
        return "throttle", {f"power_{s}": _spooled(full * np.clip(values[f"throttle_{s}"], 0.0, 1.0), p, dt)
                            for s in SIDES}  # fmt: skip
    notes.append("thrust, torque and levers not recorded: the power that the axial acceleration asks for")
    return "balance", {f"power_{s}": 0.5 * _balancing(p, values, altitude) / per_power for s in SIDES}


def as_engines_move(power: FloatArray, dt: float) -> FloatArray:
    """A power [W] (N,) by local quadratics over a second: what comes of thrust has the noise of airspeed in it.

    That noise would else go with what the airspeed reads, as if the reading depended on the power. No shaft power
    changes faster (spools take a second).
    """
    length = 2 * max(1, round(0.5 * SPIN / dt)) + 1
    return np.asarray(savgol_filter(power, length, 2)) if length <= len(power) else power


def _of_the_chart(by_thrust: Powers, by_torque: Powers) -> str:
    """How recorded thrust compares with what the published chart makes of the torque."""
    share = sum(np.mean(v) for v in by_thrust.values()) / sum(np.mean(v) for v in by_torque.values())
    return f"power from the recorded thrust, taken as computed: {share:.2f} of what the published chart makes of torque"


def _shaft_powers(p: NDArray, values: Mapping[str, FloatArray], per_power: FloatArray, dt: float,
                  notes: list[str]) -> Powers:  # fmt: skip
    """Torque times speed, less J omega domega/dt of propellers that change their speed, where thrust tells J."""
    n = len(per_power)
    speed = [turning(p, values, s, n) for s in SIDES]
    shaft = [values[f"torque_{s}"] * omega for s, omega in zip(SIDES, speed, strict=True)]
    spun = [_spinning_up(omega, dt) for omega in speed]
    inertia = 0.0
    if all(f"thrust_{s}" in values for s in SIDES) and any(change.any() for change in spun):
        thrust = np.concatenate([values[f"thrust_{s}"] for s in SIDES])
        inertia = spin_inertia(thrust, np.concatenate(shaft), np.concatenate(spun), np.tile(per_power, len(SIDES)))
    if inertia > 0.0:
        notes.append(f"propellers change their speed: each takes up power as {inertia:.0f} kg m2, by recorded thrust")
    return {f"power_{s}": own - inertia * change for s, own, change in zip(SIDES, shaft, spun, strict=True)}


def turning(p: NDArray, values: Mapping[str, FloatArray], side: str, n: int) -> FloatArray:
    """Speed of rotation of a propeller, rad/s (n,): as recorded, else the governed one."""
    return np.asarray(values.get(f"rpm_{side}", np.full(n, float(p["propeller_rpm"]))) * math.pi / 30.0)


def _spinning_up(omega: FloatArray, dt: float) -> FloatArray:
    """Power that a propeller of 1 kg m2 takes up as its speed [rad/s] changes, W (N,)."""
    length = 2 * max(1, round(0.5 * SPIN / dt)) + 1
    if length > len(omega) or not np.ptp(omega):
        return np.zeros(len(omega))
    return np.asarray(omega * savgol_filter(omega, length, 1, deriv=1, delta=dt))


def spin_inertia(thrust: FloatArray, shaft: FloatArray, spun: FloatArray, per_power: FloatArray) -> float:
    """Moment of inertia of a propeller with what turns with it, kg m2: thrust = k (shaft - J spun) per_power + c.

    Zero where that explains less than EXPLAINS of what k and c leave of the thrust.

    Args:
        thrust, shaft: recorded, N and W (N,).
        spun: power that 1 kg m2 takes up, W (N,).
        per_power: of the propeller's chart, N/W (N,).
    """
    columns = np.column_stack([shaft * per_power, np.ones(len(shaft)), spun * per_power])
    without, all_of_it = (np.linalg.lstsq(columns[:, :c], thrust, rcond=None)[0] for c in (2, 3))
    left, least = (float(np.sum((thrust - columns[:, : len(w)] @ w) ** 2)) for w in (without, all_of_it))
    inertia = -float(all_of_it[2] / all_of_it[0])
    return inertia if inertia > 0.0 and left - least > EXPLAINS * left else 0.0


def thrust_per_power(p: NDArray, airspeed: FloatArray, alpha: FloatArray) -> FloatArray:
    """What a watt of shaft power pulls with, N/W (icing_env.propulsion), at a recorded airspeed [m/s] and alpha (N,).

    The propellers meet the part of it along the body's axis; what sideslip takes off that is left out.
    """
    forward = airspeed * np.cos(alpha)
    return np.asarray(p["propeller_efficiency"] / np.sqrt(forward**2 + p["propeller_static_speed"] ** 2))


def _spooled(wanted: FloatArray, p: NDArray, dt: float) -> FloatArray:
    """Powers behind the engines' spool, settled at the start (N,)."""
    share = 1.0 - math.exp(-dt / float(p["spool_time"]))
    return np.asarray(lfilter([share], [1.0, share - 1.0], wanted, zi=[(1.0 - share) * wanted[0]])[0])


def _balancing(p: NDArray, values: Mapping[str, FloatArray], altitude: FloatArray) -> FloatArray:
    """Thrust of both engines that the axial acceleration asks for beside the model's attached flow (N,)."""
    rho = np.array([density(float(h)) for h in altitude])
    qs = 0.5 * rho * values["airspeed"] ** 2 * p["wing_area"]
    alpha = values["alpha"]
    axial = qs * (p["CX_0"] + p["CX_alpha"] * alpha + p["CX_alpha2"] * alpha**2)
    return np.asarray(np.maximum(p["mass"] * values["ax"] - axial, 0.0))
