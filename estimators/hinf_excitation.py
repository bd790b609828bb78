"""How much of what the aircraft does lately was caused by its control surfaces: the gate of the moment channels.

share = E_surfaces/(E_surfaces + E_motion + floor), energies of the angular accelerations that surfaces and motion
(incidence, rates) cause on the clean aircraft, departures from their slow means over a window, recursive. It is 0
hands off in turbulence, about 0.5 in a doublet. The idea of an excitation measure beside the estimates is Melody's
(thesis, Illinois, 2004) and Dong and Ai's (J. Control Sci. Eng. 2014/396532); this form of it is the project's own.
"""

from __future__ import annotations

from typing import Any

from icing_env.jit import kernel


@kernel
def activity(ob: Any, slot: int, weight: float, signal: float) -> float:
    """Square of a signal's departure from its own slow mean (a first-order low pass, weight = dt/window)."""
    ob["mean"][slot] += weight * (signal - ob["mean"][slot])
    return float((signal - ob["mean"][slot]) ** 2)


@kernel
def excite(ob: Any, m: Any, af: Any, window: float, dt: float) -> None:
    """Recursive energies of the moments that the surfaces cause, of those that the motion causes, and of alpha.

    Moments as angular accelerations of the clean aircraft. The first sample (not seated) sets the means.
    """
    row = ob["row"]
    weight = min(1.0, dt / window) if ob["seated"] > 0.0 else 1.0
    elevator = activity(ob, 0, weight, row[8] * af["Cm_elevator"])
    pitching = activity(ob, 1, weight, row[6] * af["Cm_alpha"] + row[7] * af["Cm_q"])
    surfaces = activity(ob, 2, weight, row[18] * af["Cl_aileron"] + row[19] * af["Cl_rudder"])
    surfaces += activity(ob, 3, weight, row[24] * af["Cn_aileron"] + row[25] * af["Cn_rudder"])
    motion = activity(ob, 4, weight, row[15] * af["Cl_beta"] + row[16] * af["Cl_p"] + row[17] * af["Cl_r"])
    motion += activity(ob, 5, weight, row[21] * af["Cn_beta"] + row[22] * af["Cn_p"] + row[23] * af["Cn_r"])
    alpha = activity(ob, 6, weight, m["alpha"])
    energy = ob["energy"]
    energy[0] += weight * (elevator - energy[0])
    energy[1] += weight * (pitching - energy[1])
    energy[2] += weight * (surfaces - energy[2])
    energy[3] += weight * (motion - energy[3])
    energy[4] += weight * (alpha - energy[4])


@kernel
def gate(share: float, low: float, high: float) -> float:
    """0 below `low`, 1 above `high`, linear between; always 1 where high = 0."""
    return 1.0 if high <= 0.0 else min(1.0, max(0.0, (share - low) / (high - low)))


@kernel
def shares(ob: Any, tn: Any, af: Any) -> tuple[float, float, float]:
    """Excitation shares (longitudinal, lateral) and the liveliness of alpha (0..1), from the energies."""
    energy = ob["energy"]
    floor = tn["control_floor"]
    elevator_noise = ob["row"][5] * af["Cm_elevator"] * floor
    aileron_noise = ob["row"][14] * af["Cl_aileron"] * floor
    longitudinal = energy[0] / (energy[0] + energy[1] + elevator_noise * elevator_noise)
    lateral = energy[2] / (energy[2] + energy[3] + aileron_noise * aileron_noise)
    return longitudinal, lateral, energy[4] / (energy[4] + tn["alpha_floor"] * tn["alpha_floor"])
