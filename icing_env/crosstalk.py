"""What an instrument reads of what it is not meant to: cross-coupling and curvature, all 0 unless something says so.

Errors of gyros that feel loads and other axes, of vanes and pitot that feel the flow, and of accelerometers off the
c.g. or bent (IEEE Std 528-2001: cross-axis sensitivity, g-sensitivity, second-order nonlinearity). The effect
`discrepancy` sets them. Files of instruments leave them out.
"""

from __future__ import annotations

from typing import Any

from icing_env.jit import kernel
from icing_env.types import Field

# What each channel may read of others, of its square, and of rates of rotation ("qdot" is that of q).
CROSSTALK: dict[str, tuple[str, ...]] = {
    "airspeed": ("alpha", "beta", "beta2", "airspeed2"), "alpha": ("airspeed", "q", "alpha2"),
    "beta": ("alpha", "p", "r", "beta2"), "p": ("q", "r", "az", "p2"), "q": ("p", "r", "az", "q2"),
    "r": ("p", "q", "az", "r2"), "phi": ("theta", "phi2"), "theta": ("phi", "theta2"),
    "ax": ("qdot", "alpha", "az", "ax2"), "ay": ("pdot", "rdot", "ax", "az", "ay2"),
    "az": ("q", "qdot", "ax", "az2"),
}  # fmt: skip
CROSSTALK_PARAMETERS: list[Field] = [
    (f"{channel}_of_{of}", "of the channel per unit of the other", f"error of {channel} with {of}")
    for channel, others in CROSSTALK.items() for of in others
]  # fmt: skip


@kernel
def crosstalk(s: Any, m: Any, p: Any) -> None:
    """Add what flow, inertial and acceleration channels read of others: behind the low pass, as they are themselves."""
    V, alpha, beta = s.pitot, s.filtered_alpha, s.filtered_beta
    roll, pitch, yaw = s.filtered_p, s.filtered_q, s.filtered_r
    ax, ay, az = s.filtered_ax, s.filtered_ay, s.filtered_az
    pdot, qdot, rdot = s.filter_rate*(s.p - roll), s.filter_rate*(s.q - pitch), s.filter_rate*(s.r - yaw)
    m.airspeed += (p.airspeed_of_alpha*alpha + p.airspeed_of_beta*beta + p.airspeed_of_beta2*beta*beta
                   + p.airspeed_of_airspeed2*V*V)
    m.alpha += p.alpha_of_airspeed*V + p.alpha_of_q*pitch + p.alpha_of_alpha2*alpha*alpha
    m.beta += p.beta_of_alpha*alpha + p.beta_of_p*roll + p.beta_of_r*yaw + p.beta_of_beta2*beta*beta
    m.p += p.p_of_q*pitch + p.p_of_r*yaw + p.p_of_az*az + p.p_of_p2*roll*roll
    m.q += p.q_of_p*roll + p.q_of_r*yaw + p.q_of_az*az + p.q_of_q2*pitch*pitch
    m.r += p.r_of_p*roll + p.r_of_q*pitch + p.r_of_az*az + p.r_of_r2*yaw*yaw
    m.ax += p.ax_of_qdot*qdot + p.ax_of_alpha*alpha + p.ax_of_az*az + p.ax_of_ax2*ax*ax
    m.ay += p.ay_of_pdot*pdot + p.ay_of_rdot*rdot + p.ay_of_ax*ax + p.ay_of_az*az + p.ay_of_ay2*ay*ay
    m.az += p.az_of_q*pitch + p.az_of_qdot*qdot + p.az_of_ax*ax + p.az_of_az2*az*az


@kernel
def gyro_crosstalk(m: Any, p: Any, phi: float, theta: float) -> None:
    """The same of bank and pitch [rad]."""
    m.phi += p.phi_of_theta*theta + p.phi_of_phi2*phi*phi
    m.theta += p.theta_of_phi*phi + p.theta_of_theta2*theta*theta
