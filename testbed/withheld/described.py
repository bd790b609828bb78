"""What a description of something unknown adds to the generator's coefficients: an answer's terms, docs/model.md 9.

Terms of which the generator has a number of its own (moment by ailerons, side force by them, and the like) use that.
"""

from __future__ import annotations

from typing import Any

from testbed.withheld.compiled import compiled

# Neutral at 0.
DESCRIBED = (
    *(f"{c}_{of}" for c in ("CX", "CY", "CZ", "Cl", "Cm", "Cn") for of in ("airspeed", "time")),
    "CX_elevator", "CX_beta2", "CX_rudder2", "CZ_alpha2", "CZ_alpha3", "CZ_alpha_q", "CZ_alpha_CT",
    "Cm_alpha2", "Cm_alpha3", "Cm_elevator2", "Cm_elevator3", "Cm_alpha_elevator", "Cm_q3", "Cm_airspeed2",
    "Cm_elevator_airspeed", "Cm_r", "Cm_alpha_CT", "Cm_theta",
    "CY_alpha_beta", "CY_beta3", "CY_alpha_p", "CY_beta_CT", "CY_betadot",
    "Cl_alpha_beta", "Cl_beta3", "Cl_p3", "Cl_aileron3", "Cl_airspeed2", "Cl_q", "Cl_alpha_r",
    "Cl_aileron_airspeed", "Cl_CT", "Cl_beta_CT", "Cl_betadot", "Cl_phi",
    "Cn_alpha_beta", "Cn_beta3", "Cn_r3", "Cn_rudder3", "Cn_airspeed2", "Cn_alpha", "Cn_q", "Cn_alpha_p", "Cn_alpha_r",
    "Cn_alpha_rudder", "Cn_rudder_airspeed", "Cn_CT", "Cn_alpha_CT", "Cn_beta_CT")  # fmt: skip
# Of the generator's own, those that describe as well; products with alpha count it there from CENTRE rad.
OWN = ("CZ_beta2", "CZ_alphadot", "Cm_aileron", "Cm_beta2", "Cm_p", "CY_aileron", "Cn_betadot", "Cn_alpha_aileron")
CENTRED, CENTRE = {"Cm_alpha_q": "Cm_q", "CY_alpha_rudder": "CY_rudder", "Cl_alpha_p": "Cl_p"}, 0.03


@compiled
def described(p: Any, t: float, V: float, a: float, b: float, ph: float, qh: float, rh: float, de: float, da: float,
              dr: float, ct: float, bdot: float, bank: float, nose: float) -> tuple[float, ...]:  # fmt: skip
    """CX, CY, CZ, Cl, Cm, Cn.

    Args:
        p: numbers of the airframe. t: s. V: m/s. a, b: flow angles, rad. ph, qh, rh: normalised rates.
        de, da, dr: surfaces, rad. ct: thrust coefficient less its reference. bdot: normalised rate of b.
        bank, nose: sin(phi) cos(theta), sin(theta).
    """
    cx = p.CX_elevator * de + p.CX_airspeed * V + p.CX_time * t + p.CX_beta2 * b * b + p.CX_rudder2 * dr * dr
    cy = p.CY_alpha_beta * a * b + p.CY_beta3 * b**3 + p.CY_airspeed * V + p.CY_time * t + p.CY_alpha_p * a * ph
    cy += p.CY_beta_CT * b * ct + p.CY_betadot * bdot
    cz = p.CZ_alpha2 * a * a + p.CZ_alpha3 * a**3 + p.CZ_airspeed * V + p.CZ_time * t
    cz += p.CZ_alpha_q * a * qh + p.CZ_alpha_CT * a * ct
    cl = p.Cl_beta3 * b**3 + p.Cl_p3 * ph**3 + p.Cl_aileron3 * da**3 + p.Cl_q * qh + p.Cl_alpha_r * a * rh
    cl += p.Cl_alpha_beta * a * b + p.Cl_airspeed * V + p.Cl_airspeed2 * V * V + p.Cl_time * t + p.Cl_phi * bank
    cl += p.Cl_aileron_airspeed * da * V + p.Cl_CT * ct + p.Cl_beta_CT * b * ct + p.Cl_betadot * bdot
    cm = p.Cm_alpha2 * a * a + p.Cm_alpha_elevator * a * de + p.Cm_airspeed * V + p.Cm_airspeed2 * V * V
    cm += p.Cm_alpha3 * a**3 + p.Cm_elevator2 * de * de + p.Cm_elevator3 * de**3 + p.Cm_q3 * qh**3 + p.Cm_time * t
    cm += p.Cm_elevator_airspeed * de * V + p.Cm_r * rh + p.Cm_alpha_CT * a * ct + p.Cm_theta * nose
    cn = p.Cn_beta3 * b**3 + p.Cn_r3 * rh**3 + p.Cn_rudder3 * dr**3 + p.Cn_alpha * a + p.Cn_q * qh
    cn += p.Cn_alpha_beta * a * b + p.Cn_airspeed * V + p.Cn_airspeed2 * V * V + p.Cn_time * t
    cn += a * (p.Cn_alpha_p * ph + p.Cn_alpha_r * rh + p.Cn_alpha_rudder * dr + p.Cn_alpha_CT * ct)
    cn += p.Cn_rudder_airspeed * dr * V + p.Cn_CT * ct + p.Cn_beta_CT * b * ct
    return cx, cy, cz, cl, cm, cn
