"""Attitude: quaternion of the body axes in the local north-east-down frame, and the 3-2-1 Euler angles.

Source: Stevens, Lewis & Johnson, Aircraft Control and Simulation, 3rd ed., section 1.8 (quaternion kinematics,
direction cosines, conversions); scalar part first, v_body = C(e) v_local.
"""

import math

from icing_env.jit import kernel

# atan(t) = t + t z P(z)/Q(z), z = t^2, |t| <= 0.66: coefficients of S. L. Moshier, Cephes Mathematical Library, atan.c
FAR = 0.66
P4, P3, P2 = -8.750608600031904122785e-1, -1.615753718733365076637e1, -7.500855792314704667340e1
P1, P0 = -1.228866684490136173410e2, -6.485021904942025371773e1
Q4, Q3, Q2 = 2.485846490142306297962e1, 1.650270098316988542046e2, 4.328810604912902668951e2
Q1, Q0 = 4.853903996359136964868e2, 1.945506571482613964425e2


@kernel
def angle_of(y: float, x: float) -> float:
    """`math.atan2(y, x)` within 2 units in the last place; without a call, so that aircraft can be met side by side."""
    small, large = min(abs(x), abs(y)), max(abs(x), abs(y), 1e-300)
    far = small > FAR*large
    t = (small - large if far else small)/(small + large if far else large)
    z = t*t
    series = ((((P4*z + P3)*z + P2)*z + P1)*z + P0)/(((((z + Q4)*z + Q3)*z + Q2)*z + Q1)*z + Q0)
    angle = (0.25*math.pi if far else 0.0) + (t + t*z*series)
    angle = 0.5*math.pi - angle if abs(y) > abs(x) else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@kernel
def direction_cosines(e0: float, e1: float, e2: float, e3: float) -> tuple:
    """Rows x, y, z of the matrix C with v_body = C v_local, nine numbers."""
    xx, yy, zz, ww = e1*e1, e2*e2, e3*e3, e0*e0
    xy, xz, yz = 2.0*e1*e2, 2.0*e1*e3, 2.0*e2*e3
    wx, wy, wz = 2.0*e0*e1, 2.0*e0*e2, 2.0*e0*e3
    return (ww + xx - yy - zz, xy + wz, xz - wy,
            xy - wz, ww - xx + yy - zz, yz + wx,
            xz + wy, yz - wx, ww - xx - yy + zz)


@kernel
def to_body(c: tuple, north: float, east: float, down: float) -> tuple:
    """Components along the body axes of a vector given in the local frame; `c` from `direction_cosines`."""
    return (c[0]*north + c[1]*east + c[2]*down,
            c[3]*north + c[4]*east + c[5]*down,
            c[6]*north + c[7]*east + c[8]*down)


@kernel
def to_local(c: tuple, x: float, y: float, z: float) -> tuple:
    """Components north, east, down of a vector given along the body axes; `c` from `direction_cosines`."""
    return (c[0]*x + c[3]*y + c[6]*z,
            c[1]*x + c[4]*y + c[7]*z,
            c[2]*x + c[5]*y + c[8]*z)


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
