"""Changes of elevator, aileron and rudder with which an iced aircraft answers as the clean one does.

* pitch: alpha_dot = -L_alpha alpha + z q - L_e delta, q_dot = M_alpha alpha + M_q q + M_e delta. Two gains on alpha and
  q place the frequency and the damping of the clean short period: K B = tr A_clean - tr A and
  K adj(A) B = det A_clean - det A (characteristic polynomial of a rank-one change; Franklin, Powell & Emami-Naeini,
  Feedback Control of Dynamic Systems, section 7.5)
* roll and yaw: the 2x2 matrix of aileron and rudder inverted, so that rolling and yawing moment per beta, p, r and per
  control are the clean ones (dynamic inversion: Stevens, Lewis & Johnson, 3rd ed., section 5.8)
* K (I + tau A_closed) in place of K makes good the lag tau of actuators and instruments: what is seen through a
  first-order lag is x, when x + tau x_dot is sent

L_alpha = q S CL_alpha/(m V), M_alpha = q S c Cm_alpha/Iyy and so on (Etkin & Reid, Dynamics of Flight, 3rd ed.,
section 4.9). Derivatives are quasi-steady equivalents: what an identifier without a downwash lag finds.
"""

from __future__ import annotations

from typing import Any

from controllers.kernels import air_density, airspeed_of, clip
from icing_env.jit import kernel


@kernel
def quasi_inertia(frame: Any, density: float) -> float:
    """Share by which the downwash lag makes the pitching inertia seem smaller (`testbed.oracle.quasi_steady`)."""
    mass: float = density*frame.wing_area*frame.chord*frame.chord*frame.tail_arm
    return 1.0 + frame.Cm_alphadot*mass/(4.0*frame.inertia_yy)


@kernel
def quasi_pitch(frame: Any, density: float) -> tuple[float, float]:
    """Cm_alpha and Cm_q of the clean aircraft with the downwash lag in them: what identifiers find."""
    lag = frame.Cm_alphadot*density*frame.wing_area*frame.chord/(4.0*frame.mass)
    inertia = quasi_inertia(frame, density)
    return (frame.Cm_alpha + lag*frame.CZ_alpha)/inertia, (frame.Cm_q + lag*frame.CZ_q)/inertia


@kernel
def change_elevator(b: Any, m: Any, frame: Any, asked: float, alpha: float, q: float, tau: float) -> float:
    """Change of the elevator [rad].

    Args:
        b: record with the share of its clean value that each derivative keeps: CL_alpha, Cm_alpha, Cm_q, Cm_elevator.
        m: MEASUREMENT record.
        frame: PARAMETERS record of the clean aircraft.
        asked, alpha, q: departures of command and state from their slow means [rad, rad/s].
        tau: lag in the loop [s].
    """
    v, density = airspeed_of(m), air_density(m)
    half = 0.5*frame.chord/v
    force = 0.5*density*v*frame.wing_area/frame.mass  # q S/(m V)
    moment = 0.5*density*v*v*frame.wing_area*frame.chord/frame.inertia_yy
    cm_alpha, cm_q = quasi_pitch(frame, density)
    cm_elevator = frame.Cm_elevator/quasi_inertia(frame, density)
    l_clean, z = force*(frame.CX_0 - frame.CZ_alpha), 1.0 + force*half*frame.CZ_q
    ma_clean, mq_clean, me_clean = moment*cm_alpha, moment*half*cm_q, moment*cm_elevator
    la, ma, mq, me = l_clean*b.CL_alpha, ma_clean*b.Cm_alpha, mq_clean*b.Cm_q, me_clean*b.Cm_elevator
    le = -force*frame.CZ_elevator*b.Cm_elevator  # the tail's lift keeps the share that its moment keeps
    trace = mq_clean - l_clean - (mq - la)
    determinant = (la*mq + z*ma) - (l_clean*mq_clean + z*ma_clean)
    # K B = trace, K adj(A) B = determinant, with B = (-le, me)
    first, second = -(mq*le + z*me), ma*le - la*me
    size = -le*second - me*first
    k_alpha, k_q = (trace*second - me*determinant)/size, (-le*determinant - first*trace)/size
    # A + B K, for the lag
    aa, aq, qa, qq = -la - le*k_alpha, z - le*k_q, ma + me*k_alpha, mq + me*k_q
    by_alpha = k_alpha + tau*(k_alpha*aa + k_q*qa)
    by_q = k_q + tau*(k_alpha*aq + k_q*qq)
    return (1.0/b.Cm_elevator - 1.0)*asked + by_alpha*alpha + by_q*q


@kernel
def turned(frame: Any, roll: float, yaw: float) -> tuple[float, float]:
    """Angular accelerations of roll and yaw per rolling and yawing moment, times Ixx Izz - Ixz^2."""
    return (frame.inertia_zz*roll + frame.inertia_xz*yaw, frame.inertia_xz*roll + frame.inertia_xx*yaw)


@kernel
def change_aileron_rudder(b: Any, m: Any, frame: Any, aileron: float, rudder: float, beta: float, p: float, r: float,
                          tau: float) -> tuple[float, float]:  # fmt: skip
    """Changes of aileron and rudder [rad].

    Args:
        b: record with the shares of Cl_beta, Cl_p, Cl_aileron, Cn_beta, Cn_r, Cn_rudder; Cl_rudder keeps that of
            Cn_rudder (the fin makes both), Cl_r, Cn_p and Cn_aileron do not change with ice (UIUC all-ice factors).
        m: MEASUREMENT record.
        frame: PARAMETERS record of the clean aircraft.
        aileron, rudder, beta, p, r: departures of command and state from their slow means [rad, rad/s].
        tau: lag in the loop [s].
    """
    v, density = airspeed_of(m), air_density(m)
    half = 0.5*frame.span/v
    # where the state will be once the lag is over, on the clean aircraft's own answer
    scale = 0.5*density*v*v*frame.wing_area*frame.span/(
        frame.inertia_xx*frame.inertia_zz - frame.inertia_xz*frame.inertia_xz)
    side = 0.5*density*v*frame.wing_area/frame.mass
    phat, rhat = half*p, half*r
    roll = frame.Cl_beta*beta + frame.Cl_p*phat + frame.Cl_r*rhat
    yaw = frame.Cn_beta*beta + frame.Cn_p*phat + frame.Cn_r*rhat
    p_dot, r_dot = turned(frame, roll, yaw)
    beta += tau*(side*(frame.CY_beta*beta + frame.CY_p*phat + frame.CY_r*rhat) - r + m.alpha*p)
    phat += half*tau*scale*p_dot
    rhat += half*tau*scale*r_dot
    # what rolling and yawing moment lack against the clean aircraft
    a_roll, r_roll = frame.Cl_aileron*b.Cl_aileron, frame.Cl_rudder*b.Cn_rudder
    a_yaw, r_yaw = frame.Cn_aileron, frame.Cn_rudder*b.Cn_rudder
    roll = (frame.Cl_beta*(1.0 - b.Cl_beta)*beta + frame.Cl_p*(1.0 - b.Cl_p)*phat
            + (frame.Cl_aileron - a_roll)*aileron + (frame.Cl_rudder - r_roll)*rudder)
    yaw = (frame.Cn_beta*(1.0 - b.Cn_beta)*beta + frame.Cn_r*(1.0 - b.Cn_r)*rhat
           + (frame.Cn_rudder - r_yaw)*rudder)
    size = a_roll*r_yaw - r_roll*a_yaw
    return (r_yaw*roll - r_roll*yaw)/size, (a_roll*yaw - a_yaw*roll)/size


@kernel
def bounded(change: float, most: float, command: float, low: float, high: float) -> float:
    """Command with a change held within +-`most`, and within the surface's travel where it was so before."""
    wanted = command + clip(change, -most, most)
    return clip(wanted, min(low, command), max(high, command))
