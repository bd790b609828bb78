"""The iced aircraft: the clean coefficients changed by the severity eta of each surface.

C_iced = (1 + sum over surfaces of k_{C,surface} eta_surface) C, Bragg's form as used by the Smart Icing Systems project
and the FlightGear/UIUC model (uiuc_ice.cpp); no factor falls below `ice_factor_floor`. The sums of the k over the
surfaces are those of the UIUC TwinOtterAllIce file; configs/ice/dhc6.toml gives their split.

Drag is split by the paper's measured shares: wing and horizontal tail change CX_0 (body axis), the bluff parts add
drag along the air stream, CD_parasite. The two half wings have their own severity, hence their own lift slope, axial
coefficient and stall angle. Stall comes earlier by k_alpha_stall e(eta) with the saturation
    e = eta for eta <= 0.1, else 0.3 - 0.3297 exp(-5 eta)          (SIS nonlinear model, uiuc_iced_nonlin.cpp).
With every eta zero, each value is bit for bit the clean one.
"""

from __future__ import annotations

import math
from typing import Any

from icing_env.jit import kernel
from icing_env.types import Field

LONGITUDINAL = (
    "CX_0", "CX_alpha", "CX_alpha2", "CZ_0", "CZ_alpha", "CZ_q", "CZ_elevator",
    "Cm_0", "Cm_alpha", "Cm_q", "Cm_elevator",
)  # fmt: skip
LATERAL = (
    "CY_beta", "CY_p", "CY_r", "CY_rudder", "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder",
    "Cn_beta", "Cn_p", "Cn_r", "Cn_aileron", "Cn_rudder",
)  # fmt: skip
BLUFF = ("vtail", "struts", "propeller", "other")

SEVERITY_PARAMETERS: list[Field] = [
    *((f"k_{c}_{s}", "1", f"relative change of {c} per eta, {s}") for c in LONGITUDINAL for s in ("wing", "htail")),
    *((f"k_{c}_{s}", "1", f"relative change of {c} per eta, {s}") for c in LATERAL for s in ("wing", "vtail")),
    *((f"k_CD_parasite_{s}", "1", f"drag coefficient added per eta of {s}") for s in BLUFF),
    ("k_alpha_stall_wing", "rad", "fall of a half wing's stall angle per saturated eta"),
    ("k_alpha_tail_stall_htail", "1", "relative change of the tail's stall angle per saturated eta"),
    ("k_efficiency_propeller", "1", "relative change of propeller efficiency per eta of the propeller"),
    ("ice_factor_floor", "1", "smallest factor by which ice multiplies a coefficient"),
]


@kernel
def saturated(eta: float) -> float:
    """Severity as it acts on the stall: linear to 0.1, then towards 0.3 (SIS, correction of November 2002)."""
    return eta if eta <= 0.1 else 0.3 - 0.3297 * math.exp(-5.0 * eta)


@kernel
def factor(k1: float, eta1: float, k2: float, eta2: float, floor: float) -> float:
    """Factor 1 + k1 eta1 + k2 eta2, at least `floor`."""
    return max(1.0 + (k1 * eta1 + k2 * eta2), floor)


@kernel
def iced_pitch(p: Any, c: Any, wing: float, tail: float) -> None:
    """Pitch-plane coefficients but for those that differ between the half wings."""
    low = p.ice_factor_floor
    c.CX_alpha = p.CX_alpha * factor(p.k_CX_alpha_wing, wing, p.k_CX_alpha_htail, tail, low)
    c.CX_alpha2 = p.CX_alpha2 * factor(p.k_CX_alpha2_wing, wing, p.k_CX_alpha2_htail, tail, low)
    c.CZ_0 = p.CZ_0 * factor(p.k_CZ_0_wing, wing, p.k_CZ_0_htail, tail, low)
    c.CZ_q = p.CZ_q * factor(p.k_CZ_q_wing, wing, p.k_CZ_q_htail, tail, low)
    c.CZ_elevator = p.CZ_elevator * factor(p.k_CZ_elevator_wing, wing, p.k_CZ_elevator_htail, tail, low)
    c.Cm_0 = p.Cm_0 * factor(p.k_Cm_0_wing, wing, p.k_Cm_0_htail, tail, low)
    c.Cm_alpha = p.Cm_alpha * factor(p.k_Cm_alpha_wing, wing, p.k_Cm_alpha_htail, tail, low)
    c.Cm_q = p.Cm_q * factor(p.k_Cm_q_wing, wing, p.k_Cm_q_htail, tail, low)
    c.Cm_elevator = p.Cm_elevator * factor(p.k_Cm_elevator_wing, wing, p.k_Cm_elevator_htail, tail, low)


@kernel
def iced_lateral(p: Any, c: Any, wing: float, fin: float) -> None:
    """Roll, yaw and side-force coefficients."""
    low = p.ice_factor_floor
    c.CY_beta = p.CY_beta * factor(p.k_CY_beta_wing, wing, p.k_CY_beta_vtail, fin, low)
    c.CY_p = p.CY_p * factor(p.k_CY_p_wing, wing, p.k_CY_p_vtail, fin, low)
    c.CY_r = p.CY_r * factor(p.k_CY_r_wing, wing, p.k_CY_r_vtail, fin, low)
    c.CY_rudder = p.CY_rudder * factor(p.k_CY_rudder_wing, wing, p.k_CY_rudder_vtail, fin, low)
    c.Cl_beta = p.Cl_beta * factor(p.k_Cl_beta_wing, wing, p.k_Cl_beta_vtail, fin, low)
    c.Cl_p = p.Cl_p * factor(p.k_Cl_p_wing, wing, p.k_Cl_p_vtail, fin, low)
    c.Cl_r = p.Cl_r * factor(p.k_Cl_r_wing, wing, p.k_Cl_r_vtail, fin, low)
    c.Cl_aileron = p.Cl_aileron * factor(p.k_Cl_aileron_wing, wing, p.k_Cl_aileron_vtail, fin, low)
    c.Cl_rudder = p.Cl_rudder * factor(p.k_Cl_rudder_wing, wing, p.k_Cl_rudder_vtail, fin, low)
    c.Cn_beta = p.Cn_beta * factor(p.k_Cn_beta_wing, wing, p.k_Cn_beta_vtail, fin, low)
    c.Cn_p = p.Cn_p * factor(p.k_Cn_p_wing, wing, p.k_Cn_p_vtail, fin, low)
    c.Cn_r = p.Cn_r * factor(p.k_Cn_r_wing, wing, p.k_Cn_r_vtail, fin, low)
    c.Cn_aileron = p.Cn_aileron * factor(p.k_Cn_aileron_wing, wing, p.k_Cn_aileron_vtail, fin, low)
    c.Cn_rudder = p.Cn_rudder * factor(p.k_Cn_rudder_wing, wing, p.k_Cn_rudder_vtail, fin, low)


@kernel
def iced_half_wings(s: Any, p: Any, c: Any) -> None:
    """Lift slope, axial coefficient and stall angle of each half wing; the aircraft's are the means."""
    low, left, right, tail = p.ice_factor_floor, s.eta_left_wing, s.eta_right_wing, s.eta_htail
    c.CZ_alpha_left = p.CZ_alpha * factor(p.k_CZ_alpha_wing, left, p.k_CZ_alpha_htail, tail, low)
    c.CZ_alpha_right = p.CZ_alpha * factor(p.k_CZ_alpha_wing, right, p.k_CZ_alpha_htail, tail, low)
    c.CZ_alpha = 0.5 * (c.CZ_alpha_left + c.CZ_alpha_right)
    c.CX_0_left = p.CX_0 * factor(p.k_CX_0_wing, left, p.k_CX_0_htail, tail, low)
    c.CX_0_right = p.CX_0 * factor(p.k_CX_0_wing, right, p.k_CX_0_htail, tail, low)
    c.CX_0 = 0.5 * (c.CX_0_left + c.CX_0_right)
    c.alpha_stall_left = p.alpha_stall - p.k_alpha_stall_wing * saturated(left)
    c.alpha_stall_right = p.alpha_stall - p.k_alpha_stall_wing * saturated(right)


@kernel
def iced_aircraft(s: Any, p: Any, c: Any) -> None:
    """Fill the coefficients as they are now.

    Args:
        s: STATE record; reads eta_* and ice_mass_*.
        p: SEVERITY_PARAMETERS and the clean DERIVATIVE_NAMES, CD_parasite, alpha_stall, alpha_tail_stall, mass.
        c: CURRENT record, written in every field.
    """
    wing = 0.5 * (s.eta_left_wing + s.eta_right_wing)
    iced_half_wings(s, p, c)
    iced_pitch(p, c, wing, s.eta_htail)
    iced_lateral(p, c, wing, s.eta_vtail)
    c.CD_parasite = p.CD_parasite + (
        p.k_CD_parasite_vtail * s.eta_vtail
        + p.k_CD_parasite_struts * s.eta_struts
        + p.k_CD_parasite_propeller * s.eta_propeller
        + p.k_CD_parasite_other * s.eta_other
    )
    tail = saturated(s.eta_htail)
    c.alpha_tail_stall = p.alpha_tail_stall * factor(p.k_alpha_tail_stall_htail, tail, 0.0, 0.0, p.ice_factor_floor)
    c.efficiency = factor(p.k_efficiency_propeller, s.eta_propeller, 0.0, 0.0, p.ice_factor_floor)
    c.mass = p.mass + (
        (s.ice_mass_left_wing + s.ice_mass_right_wing)
        + (s.ice_mass_htail + s.ice_mass_vtail + s.ice_mass_struts + s.ice_mass_propeller + s.ice_mass_other)
    )
