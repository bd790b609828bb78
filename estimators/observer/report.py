"""From an observer's memory to the row of estimates that everyone downstream reads."""

from __future__ import annotations

from typing import Any

from estimators.observer.rows import clean_zero_lift_drag
from icing_env.jit import kernel


@kernel
def follow_drag(ob: Any, af: Any, tn: Any, dt: float) -> None:
    """Excess drag: CD_0 above the clean aircraft's, behind a low pass for decisions."""
    excess = ob["theta"][0] - clean_zero_lift_drag(af)
    ob["excess_drag"] += min(1.0, dt / tn["drag_smoothing"]) * (excess - ob["excess_drag"])


@kernel
def report(ob: Any, est: Any, longitudinal: float, lateral: float) -> None:
    """Write estimates, standard errors, excess drag and excitation; health is 1. Order: PARAMETER_NAMES."""
    th, sd = ob["theta"], ob["deviation"]
    est["CD_0"], est["CL_0"], est["CL_alpha"] = th[0], th[1], th[2]
    est["CL_elevator"], est["Cm_0"], est["Cm_alpha"] = th[4], th[5], th[6]
    est["Cm_q"], est["Cm_elevator"], est["CY_0"] = th[7], th[8], th[9]
    est["CY_beta"], est["CY_r"], est["CY_rudder"] = th[10], th[12], th[13]
    est["Cl_0"], est["Cl_beta"], est["Cl_p"] = th[14], th[15], th[16]
    est["Cl_r"], est["Cl_aileron"], est["Cl_rudder"] = th[17], th[18], th[19]
    est["Cn_0"], est["Cn_beta"], est["Cn_p"] = th[20], th[21], th[22]
    est["Cn_r"], est["Cn_aileron"], est["Cn_rudder"] = th[23], th[24], th[25]
    est["CD_0_std"], est["CL_0_std"] = sd[0], sd[1]
    est["CL_alpha_std"], est["CL_elevator_std"] = sd[2], sd[4]
    est["Cm_0_std"], est["Cm_alpha_std"] = sd[5], sd[6]
    est["Cm_q_std"], est["Cm_elevator_std"] = sd[7], sd[8]
    est["CY_0_std"], est["CY_beta_std"] = sd[9], sd[10]
    est["CY_r_std"], est["CY_rudder_std"] = sd[12], sd[13]
    est["Cl_0_std"], est["Cl_beta_std"] = sd[14], sd[15]
    est["Cl_p_std"], est["Cl_r_std"] = sd[16], sd[17]
    est["Cl_aileron_std"], est["Cl_rudder_std"] = sd[18], sd[19]
    est["Cn_0_std"], est["Cn_beta_std"] = sd[20], sd[21]
    est["Cn_p_std"], est["Cn_r_std"] = sd[22], sd[23]
    est["Cn_aileron_std"], est["Cn_rudder_std"] = sd[24], sd[25]
    est["excess_drag"] = ob["excess_drag"]
    est["excitation_longitudinal"], est["excitation_lateral"] = longitudinal, lateral
    est["health"] = 1.0
