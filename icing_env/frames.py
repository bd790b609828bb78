"""Attitude: quaternion of the body axes in the local north-east-down frame, and the 3-2-1 Euler angles.

Source: Stevens, Lewis & Johnson, Aircraft Control and Simulation, 3rd ed., section 1.8 (quaternion kinematics,
direction cosines, conversions); scalar part first, v_body = C(e) v_local.
"""

import math

from icing_env.jit import kernel


@kernel
def to_body(e0: float, e1: float, e2: float, e3: float, north: float, east: float, down: float) -> tuple:
    """Components along the body axes of a vector given in the local frame."""
    x = (e0*e0 + e1*e1 - e2*e2 - e3*e3)*north + 2.0*(e1*e2 + e0*e3)*east + 2.0*(e1*e3 - e0*e2)*down
    y = 2.0*(e1*e2 - e0*e3)*north + (e0*e0 - e1*e1 + e2*e2 - e3*e3)*east + 2.0*(e2*e3 + e0*e1)*down
    z = 2.0*(e1*e3 + e0*e2)*north + 2.0*(e2*e3 - e0*e1)*east + (e0*e0 - e1*e1 - e2*e2 + e3*e3)*down
    return x, y, z


@kernel
def to_local(e0: float, e1: float, e2: float, e3: float, x: float, y: float, z: float) -> tuple:
    """Components north, east, down of a vector given along the body axes."""
    north = (e0*e0 + e1*e1 - e2*e2 - e3*e3)*x + 2.0*(e1*e2 - e0*e3)*y + 2.0*(e1*e3 + e0*e2)*z
    east = 2.0*(e1*e2 + e0*e3)*x + (e0*e0 - e1*e1 + e2*e2 - e3*e3)*y + 2.0*(e2*e3 - e0*e1)*z
    down = 2.0*(e1*e3 - e0*e2)*x + 2.0*(e2*e3 + e0*e1)*y + (e0*e0 - e1*e1 - e2*e2 + e3*e3)*z
    return north, east, down


@kernel
def euler_angles(e0: float, e1: float, e2: float, e3: float) -> tuple:
    """Bank phi, pitch theta, heading psi [rad] of a unit quaternion."""
    phi = math.atan2(2.0*(e2*e3 + e0*e1), e0*e0 - e1*e1 - e2*e2 + e3*e3)
    theta = math.asin(max(-1.0, min(1.0, 2.0*(e0*e2 - e1*e3))))
    psi = math.atan2(2.0*(e1*e2 + e0*e3), e0*e0 + e1*e1 - e2*e2 - e3*e3)
    return phi, theta, psi


@kernel
def quaternion(phi: float, theta: float, psi: float) -> tuple:
    """Unit quaternion of bank, pitch and heading [rad]."""
    cp, sp = math.cos(0.5*phi), math.sin(0.5*phi)
    ct, st = math.cos(0.5*theta), math.sin(0.5*theta)
    cs, ss = math.cos(0.5*psi), math.sin(0.5*psi)
    return (cp*ct*cs + sp*st*ss, sp*ct*cs - cp*st*ss, cp*st*cs + sp*ct*ss, cp*ct*ss - sp*st*cs)
