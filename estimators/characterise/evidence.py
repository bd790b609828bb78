"""Evidence of ice, sample by sample: normal equations of lift, pitch and roll, and shifts against the clean aircraft.

The equations are those of equation error (Klein & Morelli, Aircraft System Identification, section 5.1), in relative
form: unknowns are the relative departures d of each derivative from its clean value, regressors the clean
contributions, so that every unknown is of the size of the icing severity. Both sides pass the same two-stage low
pass, the rate's derivative is taken inside it, and old samples fade with a time constant, so that the sums serve one
window as well as a flight without end.

Two known paths are taken out of the pitching moment before it is regressed, or turbulence would bias it (docs/
characterisation.md shows by how much): the gust that the vane shows reaches the tail l_t/V later, and so does the
downwash (Etkin & Reid, Dynamics of Flight, 3rd ed., section 5.5). The gust's angle is what the vane shows less the
incidence that gyros and accelerometers integrate to; only its change over l_t/V is needed, which does not drift.

Shifts: what the clean derivatives leave of CX, CZ, Cm, Cl, Cn and of the elevator's hinge moment (trim included), and
the share of its clean thrust that each propeller lacks for its shaft power, averaged over a shorter time.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.observer.rows import GAS_CONSTANT, GRAVITY, flap_forces, readable
from icing_env.jit import block, entry, kernel

LATEST = 64  # samples of the ring that delays the gust: l_t/V is 0.1 to 0.2 s, at up to 200 Hz
LIFT, PITCH, ROLL = 0, 1, 2
SIZES = (4, 4, 6)  # unknowns: CL and Cm _0 _alpha _q _elevator, Cl _0 _beta _p _r _aileron _rudder
WIDEST = 6
STRIDE = 1 + WIDEST  # target and regressors of one equation among the filtered signals
SHIFTS = ("CX", "CZ", "Cm", "Cl", "Cn", "propeller_left", "propeller_right", "hinge")
RATE = 12.0  # rad/s of each stage of the low pass: above the short period, below boom and vane noise (assumed)
GUST_TIME = 2.0  # s: slower changes of the gust's angle are drift of the integrated incidence (assumed)

EVIDENCE = np.dtype([
    ("seated", "f8"),  # 0: the next readable sample starts the filters
    ("age", "f8"),  # s of readable samples
    ("turned", "f8"),  # rad, incidence integrated from gyros and accelerometers
    ("ring", "f8", (LATEST,)), ("at", "i8"),  # the gust's angle, latest samples
    ("downwash", "f8"),  # rad, incidence whose downwash is at the tail
    ("gust_mean", "f8"), ("gust_energy", "f8"),  # slow part and energy of the rest, (m/s)^2
    ("signal", "f8", (3*STRIDE + 2,)), ("first", "f8", (3*STRIDE + 2,)), ("second", "f8", (3*STRIDE + 2,)),
    ("matrix", "f8", (3, WIDEST, WIDEST)), ("vector", "f8", (3, WIDEST)), ("square", "f8", (3,)),
    ("weight", "f8"),  # s of samples in the sums
    ("shift", "f8", (8,)), ("shift_weight", "f8"),  # means; s of samples in them
    ("alpha", "f8"), ("airspeed", "f8"), ("temperature", "f8"),  # means of the same memory
    ("moved", "f8", (3,)), ("moved_mean", "f8", (3,)),  # energy of elevator, aileron, rudder about their means, rad2
])  # fmt: skip


@kernel
def gust_at_tail(ev: Any, m: Any, k: Any, dt: float) -> float:
    """Gust angle at the tail less that at the wing [rad], and the gust's energy into the memory."""
    v, alpha = m["airspeed"], m["alpha"]
    st, ct = math.sin(m["theta"]), math.cos(m["theta"])
    ca, sa = math.cos(alpha), math.sin(alpha)
    fx, fz = m["ax"] - GRAVITY*st, m["az"] + GRAVITY*ct*math.cos(m["phi"])
    rate = m["q"] - math.tan(m["beta"])*(m["p"]*ca + m["r"]*sa) + (fz*ca - fx*sa)/v
    ev["turned"] += rate*dt
    gust = alpha - ev["turned"]
    seated = ev["seated"] > 0.0
    if not seated:
        ev["gust_mean"], ev["downwash"] = gust, alpha
        for i in range(LATEST):
            ev["ring"][i] = gust
    ev["at"] = (ev["at"] + 1) % LATEST
    ev["ring"][ev["at"]] = gust
    late = min(k["tail_arm"]/(v*dt), LATEST - 2.0)
    whole = int(late)
    newer, older = ev["ring"][(ev["at"] - whole) % LATEST], ev["ring"][(ev["at"] - whole - 1) % LATEST]
    ev["gust_mean"] += (1.0 - math.exp(-dt/GUST_TIME))*(gust - ev["gust_mean"])
    ev["downwash"] += (1.0 - math.exp(-dt*v/k["tail_arm"]))*(alpha - ev["downwash"])
    return float(newer + (late - whole)*(older - newer) - gust)


@kernel
def equations(ev: Any, m: Any, k: Any, arrival: float) -> tuple[float, float]:
    """Unfiltered targets and regressors of lift, pitch and roll into `signal`; returns qbar S and thrust [N]."""
    v, alpha, q = m["airspeed"], m["alpha"], m["q"]
    force = 0.5*m["pressure"]/(GAS_CONSTANT*m["temperature"])*v*v*k["wing_area"]
    thrust = m["thrust_left"] + m["thrust_right"]
    ct = thrust/force - k["CT_reference"]
    half_chord, half_span = 0.5*k["chord"]/v, 0.5*k["span"]/v
    s = ev["signal"]
    flap_lift, flap_drag = flap_forces(m["flap"], alpha, k)
    extra = -flap_lift*math.cos(alpha) - flap_drag*math.sin(alpha) + k["CZ_CT"]*ct
    s[1], s[2], s[3], s[4] = 0.1, k["CZ_alpha"]*alpha, k["CZ_q"]*half_chord*q, k["CZ_elevator"]*m["elevator"]
    s[0] = k["mass"]*m["az"]/force - extra - k["CZ_0"] - s[2] - s[3] - s[4]
    yy, xx, zz, xz = k["inertia_yy"], k["inertia_xx"], k["inertia_zz"], k["inertia_xz"]
    pitch, o = force*k["chord"]/yy, STRIDE
    known = k["Cm_0"] + k["Cm_alpha_tail"]*arrival + k["Cm_flap"]*m["flap"]
    known += 0.5*k["Cm_alphadot"]*k["chord"]/k["tail_arm"]*(alpha - ev["downwash"]) - k["Cm_alphadot"]*half_chord*q
    s[o + 1], s[o + 2], s[o + 3] = 0.05*pitch, pitch*k["Cm_alpha"]*alpha, pitch*k["Cm_q"]*half_chord*q
    s[o + 4] = pitch*k["Cm_elevator"]*m["elevator"]*(1.0 + k["Cm_elevator_CT"]*ct)
    s[o] = -pitch*known - k["engine_arm_z"]*thrust/yy - s[o + 2] - s[o + 3] - s[o + 4]
    s[o] -= ((zz - xx)*m["p"]*m["r"] + xz*(m["r"]*m["r"] - m["p"]*m["p"]))/yy
    roll, o = force*k["span"]/xx, 2*STRIDE
    s[o + 1], s[o + 2], s[o + 3] = 0.005*roll, roll*k["Cl_beta"]*m["beta"], roll*k["Cl_p"]*half_span*m["p"]
    s[o + 4], s[o + 5] = roll*k["Cl_r"]*half_span*m["r"], roll*k["Cl_aileron"]*m["aileron"]
    s[o + 6] = roll*k["Cl_rudder"]*m["rudder"]
    s[o] = -s[o + 2] - s[o + 3] - s[o + 4] - s[o + 5] - s[o + 6] - (xz*m["p"]*q - (zz - yy)*q*m["r"])/xx
    s[3*STRIDE], s[3*STRIDE + 1] = q, m["p"] - xz/xx*m["r"]
    return force, thrust


@block
def add_normal(ev: Any, which: int, target: float, size: int, fade: float, dt: float) -> None:
    """Add one filtered row to the normal equations of one channel."""
    row, o = ev["second"], which*STRIDE + 1
    for i in range(size):
        ev["vector"][which, i] = fade*ev["vector"][which, i] + dt*row[o + i]*target
        for j in range(size):
            ev["matrix"][which, i, j] = fade*ev["matrix"][which, i, j] + dt*row[o + i]*row[o + j]
    ev["square"][which] = fade*ev["square"][which] + dt*target*target


@kernel
def lacking(thrust: float, torque: float, rpm: float, v: float, k: Any) -> float:
    """Share of its clean thrust that a propeller lacks for its shaft power; 0 where torque is not measured."""
    power = torque*rpm*(2.0*math.pi/60.0)
    if power <= 1e4:
        return 0.0
    return float(1.0 - thrust*math.sqrt(v*v + k["propeller_static_speed"]**2)/(k["propeller_efficiency"]*power))


@kernel
def shifts(ev: Any, m: Any, k: Any, force: float, thrust: float, dt: float, memory: float) -> None:
    """Means of what the clean aircraft leaves unexplained, over `memory` seconds (over all while there are fewer)."""
    v, alpha, seen = m["airspeed"], m["alpha"], ev["second"]
    fade = math.exp(-dt/memory)
    ev["shift_weight"] = fade*ev["shift_weight"] + dt
    w = dt/ev["shift_weight"]
    qb = force*k["span"]
    flap_lift, flap_drag = flap_forces(m["flap"], alpha, k)
    cx = k["CX_0"] + alpha*(k["CX_alpha"] + alpha*k["CX_alpha2"])
    cx += flap_lift*math.sin(alpha) - flap_drag*math.cos(alpha)
    yaw = k["Cn_beta"]*m["beta"] + k["Cn_aileron"]*m["aileron"] + k["Cn_rudder"]*m["rudder"]
    yaw += 0.5*k["span"]/v*(k["Cn_p"]*m["p"] + k["Cn_r"]*m["r"])
    tail = (1.0 - k["downwash_slope"])*alpha + k["tail_incidence"] + m["q"]*k["tail_arm"]/v
    hinge = k["hinge_elevator_delta"]*m["elevator"] + k["hinge_elevator_alpha"]*tail
    qbar = force/k["wing_area"]
    now = (
        (k["mass"]*m["ax"] - thrust)/force - cx,
        seen[0],
        0.05*seen[STRIDE]/max(seen[STRIDE + 1], 1e-6),
        0.005*seen[2*STRIDE]/max(seen[2*STRIDE + 1], 1e-6),
        -yaw - k["engine_arm_y"]*(m["thrust_left"] - m["thrust_right"])/qb,
        lacking(m["thrust_left"], m["torque_left"], m["rpm_left"], v, k),
        lacking(m["thrust_right"], m["torque_right"], m["rpm_right"], v, k),
        m["hinge_moment_elevator"]/(qbar*k["hinge_elevator_volume"]) - hinge,
    )
    for i in range(8):
        ev["shift"][i] += w*(now[i] - ev["shift"][i])
    gust = ev["ring"][ev["at"]] - ev["gust_mean"]
    ev["gust_energy"] += w*((v*gust)**2 - ev["gust_energy"])
    ev["alpha"] += w*(alpha - ev["alpha"])
    ev["airspeed"] += w*(v - ev["airspeed"])
    ev["temperature"] += w*(m["temperature"] - ev["temperature"])


@kernel
def movements(ev: Any, m: Any, dt: float, memory: float) -> None:
    """Energy of the surfaces about their means: what the regressions could learn from."""
    w = 1.0 - math.exp(-dt/memory) if ev["seated"] > 0.0 else 1.0
    positions = (m["elevator"], m["aileron"], m["rudder"])
    for i in range(3):
        ev["moved_mean"][i] += w*(positions[i] - ev["moved_mean"][i])
        ev["moved"][i] += w*((positions[i] - ev["moved_mean"][i])**2 - ev["moved"][i])


@kernel
def take(ev: Any, m: Any, k: Any, dt: float, memory: float, shift_memory: float) -> None:
    """One sample of one aircraft."""
    if not readable(m):
        ev["seated"] = 0.0
        return
    arrival = gust_at_tail(ev, m, k, dt)
    force, thrust = equations(ev, m, k, arrival)
    first, second, signal = ev["first"], ev["second"], ev["signal"]
    gain, seated = 1.0 - math.exp(-RATE*dt), ev["seated"] > 0.0
    last_q, last_p = second[3*STRIDE], second[3*STRIDE + 1]
    for i in range(3*STRIDE + 2):
        if seated:
            first[i] += gain*(signal[i] - first[i])
            second[i] += gain*(first[i] - second[i])
        else:
            first[i] = second[i] = signal[i]
    if seated:
        second[STRIDE] += (second[3*STRIDE] - last_q)/dt
        second[2*STRIDE] += (second[3*STRIDE + 1] - last_p)/dt
        fade = math.exp(-dt/memory)
        for which in range(3):
            add_normal(ev, which, second[which*STRIDE], SIZES[which], fade, dt)
        ev["weight"] = fade*ev["weight"] + dt
        shifts(ev, m, k, force, thrust, dt, shift_memory)
        second[STRIDE] -= (second[3*STRIDE] - last_q)/dt
        second[2*STRIDE] -= (second[3*STRIDE + 1] - last_p)/dt
    movements(ev, m, dt, shift_memory)
    ev["age"] += dt
    ev["seated"] = 1.0


def init(n: int) -> NDArray[np.void]:
    """Memory of `n` aircraft that have seen nothing yet (`EVIDENCE` array)."""
    return np.zeros(n, EVIDENCE)


@entry
def step(evidence: Any, measurement: Any, clean: Any, dt: float, memory: float, shift_memory: float) -> None:
    """Take one sample of every aircraft in, in place.

    Args:
        evidence: EVIDENCE rows.
        measurement: MEASUREMENT rows; one that is not readable (a NaN, no airspeed) is left out.
        clean: CLEAN, one row for all or one per aircraft.
        dt: s since the last sample.
        memory, shift_memory: s after which a sample weighs 1/e in the normal equations and in the shifts.
    """
    for i in range(len(evidence)):
        take(evidence[i], measurement[i], clean[i if len(clean) > 1 else 0], dt, memory, shift_memory)
