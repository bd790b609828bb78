"""Whether what the aircraft does lately is of its controls' making: the gate of what the observer learns.

share = S/(S + w G + floor). S: energy of the angular rate that a channel's surfaces cause behind the observer's
filter. G: that of the rate that gusts cause, from the gust's incidence, which kinematics tell without any derivative:
what a vane shows less what gyros and accelerometers say it should. floor: surfaces that move by less than sensor noise
and an autopilot's trimming. Energies are of departures from slow means over a window, all recursive. On the simulator
0.1 to 0.3 on autopilot in turbulence of sigma_w 1 to 4 m/s, 0.8 to 0.9 in doublets in calm air (0.6 to 0.8 at
sigma_w = 2 m/s), and 0 hands off; 0.7 to 0.85 in the longitudinal flight records.

For the forces the question is only whether the incidence moves by more than its noise: share = A/(A + floor), A the
energy of alpha (or beta) behind the filter.

The idea of an excitation measure beside the estimates is Melody's (thesis, Illinois, 2004) and Dong and Ai's
(J. Control Sci. Eng. 2014/396532); this form of it is the project's own.
"""

from __future__ import annotations

from typing import Any

from icing_env.jit import entry, kernel

ATTACK = 8.0  # how much faster than it falls an energy rises: a doublet is seen within a second (assumed)
ELEVATOR, ROLLING, YAWING, GUST_ALPHA, GUST_BETA, ALPHA, BETA = range(7)


@kernel
def activity(ob: Any, slot: int, weight: float, signal: float) -> None:
    """Slow mean of a signal and energy of its departures from it: low passes, weight = dt/window, faster upwards."""
    ob["mean"][slot] += weight * (signal - ob["mean"][slot])
    change = (signal - ob["mean"][slot]) ** 2 - ob["energy"][slot]
    ob["energy"][slot] += min(1.0, ATTACK * weight) * change if change > 0.0 else weight * change


@kernel
def excite(ob: Any, af: Any, window: float, dt: float) -> None:
    """Take in one sample, after the filters. The first sample (not seated) sets the means.

    The ratio of a filtered regressor to that of the channel's bias is the regressor's variable, smoothed.
    """
    seated = ob["seated"] > 0.0
    f = ob["filtered"] if seated else ob["row"]
    weight = min(1.0, dt / window) if seated else 1.0
    activity(ob, ELEVATOR, weight, af["Cm_elevator"] * f[8] / f[5])
    activity(ob, ROLLING, weight, (af["Cl_aileron"] * f[18] + af["Cl_rudder"] * f[19]) / f[14])
    activity(ob, YAWING, weight, (af["Cn_aileron"] * f[24] + af["Cn_rudder"] * f[25]) / f[20])
    activity(ob, ALPHA, weight, f[2] / f[1])
    activity(ob, BETA, weight, f[10] / f[9])
    activity(ob, GUST_ALPHA, weight, ob["y"][1] - ob["zeta"][1] - ob["felt_filtered"][1] if seated else 0.0)
    activity(ob, GUST_BETA, weight, ob["y"][3] - ob["zeta"][3] - ob["felt_filtered"][2] if seated else 0.0)


@kernel
def share(wanted: float, gust: float, floor: float) -> float:
    """wanted/(wanted + gust + floor)."""
    return wanted / (wanted + gust + floor)


@kernel
def shares(ob: Any, tn: Any, af: Any) -> tuple[float, float, float, float]:
    """Shares of pitch, of roll and yaw together, of lift and of side force, each 0..1. Moments as coefficients."""
    energy, w = ob["energy"], tn["gust_weight"]
    floor, still = tn["control_floor"] * tn["control_floor"], tn["incidence_floor"] * tn["incidence_floor"]
    pitch = share(energy[ELEVATOR], w * energy[GUST_ALPHA] * af["Cm_alpha"] ** 2, floor * af["Cm_elevator"] ** 2)
    gust = w * energy[GUST_BETA] * (af["Cl_beta"] ** 2 + af["Cn_beta"] ** 2)
    floor *= af["Cl_aileron"] ** 2 + af["Cn_rudder"] ** 2
    turn = share(energy[ROLLING] + energy[YAWING], gust, floor)
    return pitch, turn, share(energy[ALPHA], 0.0, still), share(energy[BETA], 0.0, still)


@kernel
def gate(share: float, low: float, high: float) -> float:
    """0 below `low`, 1 above `high`, linear between; always 1 where high = 0."""
    return 1.0 if high <= 0.0 else min(1.0, max(0.0, (share - low) / (high - low)))


@kernel
def hearing(
    tn: Any, excited: tuple[float, float, float, float], whole: float
) -> tuple[float, float, float, float, float, float]:
    """How much of `whole` each of the six channels takes in, as far as it is excited; drag always takes in all.

    excited: shares of pitch, of turn, of lift and of side force.
    """
    low, high = tn["share_low"], tn["share_high"]
    pitch, turn, lift, side = excited
    turning = whole * gate(turn, low, high)
    lifting, pitching = whole * gate(lift, low, high), whole * gate(pitch, low, high)
    return whole, lifting, pitching, whole * gate(side, low, high), turning, turning


@entry
def heard(memory: Any, tuning: Any, airframe: Any, out: Any) -> None:
    """How much each of the six channels took in of every sample of a run, into `out` (N, 6).

    memory: N rows with the field `energy`; tuning, airframe: one row each.
    """
    for k in range(len(memory)):
        whole = hearing(tuning[0], shares(memory[k], tuning[0], airframe[0]), 1.0)
        for c in range(6):
            out[k, c] = whole[c]
