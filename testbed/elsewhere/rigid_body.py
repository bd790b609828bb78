"""Rigid-body motion over a flat earth: body velocities, body rates, attitude quaternion (body to north-east-down)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.aircraft import GRAVITY


def quaternion(phi: NDArray, theta: NDArray, psi: NDArray) -> NDArray:
    """Unit quaternion (4, n) of the Euler angles in rad."""
    cf, sf = np.cos(phi / 2), np.sin(phi / 2)
    ct, st = np.cos(theta / 2), np.sin(theta / 2)
    cp, sp = np.cos(psi / 2), np.sin(psi / 2)
    return np.stack([cf * ct * cp + sf * st * sp, sf * ct * cp - cf * st * sp,
                     cf * st * cp + sf * ct * sp, cf * ct * sp - sf * st * cp])


def euler(e: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """phi, theta, psi in rad of the quaternion (4, n)."""
    phi = np.arctan2(2 * (e[0] * e[1] + e[2] * e[3]), 1 - 2 * (e[1] ** 2 + e[2] ** 2))
    theta = np.arcsin(np.clip(2 * (e[0] * e[2] - e[3] * e[1]), -1, 1))
    psi = np.arctan2(2 * (e[0] * e[3] + e[1] * e[2]), 1 - 2 * (e[2] ** 2 + e[3] ** 2))
    return phi, theta, psi


def rotation(e: NDArray) -> NDArray:
    """Direction cosines (3, 3, n): north-east-down vector = rotation times body vector."""
    w, x, y, z = e
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def cross(a: NDArray, b: NDArray) -> NDArray:
    """Vector product of (3, n) arrays."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def angular_acceleration(moment: NDArray, rates: NDArray, inertia: NDArray) -> NDArray:
    """Body angular acceleration (3, n) in rad/s2 for inertia (xx, yy, zz, xz), xz = + integral of x z dm."""
    p, q, r = rates
    xx, yy, zz, xz = inertia
    roll = moment[0] - (zz - yy) * q * r + xz * p * q
    yaw = moment[2] - (yy - xx) * p * q - xz * q * r
    pitch = moment[1] - (xx - zz) * p * r - xz * (p * p - r * r)
    det = xx * zz - xz * xz
    return np.stack([(zz * roll + xz * yaw) / det, pitch / yy, (xz * roll + xx * yaw) / det])


def motion(velocity: NDArray, rates: NDArray, e: NDArray, specific_force: NDArray, turn: NDArray,
           matrix: NDArray) -> NDArray:
    """Time derivatives of velocity, rates, quaternion and position, stacked (13, n)."""
    w, x, y, z = e
    p, q, r = rates
    acceleration = specific_force + GRAVITY * matrix[2] - cross(rates, velocity)
    spin = 0.5 * np.stack([-x * p - y * q - z * r, w * p + y * r - z * q, w * q + z * p - x * r, w * r + x * q - y * p])
    return np.concatenate([acceleration, turn, spin, np.einsum("ijn,jn->in", matrix, velocity)])
