"""Rigid-body kinematics driven by what gyros and accelerometers read, for many parameter sets in one call.

    u' = r v - q w - g sin(theta) + ax              phi'   = p + tan(theta) (q sin(phi) + r cos(phi))
    v' = p w - r u + g cos(theta) sin(phi) + ay     theta' = q cos(phi) - r sin(phi)
    w' = q u - p v + g cos(theta) cos(phi) + az     psi'   = (q sin(phi) + r cos(phi)) / cos(theta)
with ax .. r the readings less their biases; V, alpha, beta, phi, theta, psi are then read as (1 + lambda) y + b.
Source: Klein & Morelli, Aircraft System Identification (AIAA 2006), chapter 10. Flat earth, still air.
"""

from __future__ import annotations

import math

import numpy as np

from icing_env.atmosphere import G0
from icing_env.jit import entry, kernel
from icing_env.record import FloatArray

INPUTS = ("ax", "ay", "az", "p", "q", "r")
OUTPUTS = ("airspeed", "alpha", "beta", "phi", "theta", "psi")
START = tuple(f"{name}_start" for name in OUTPUTS)
SCALED = ("airspeed", "alpha", "beta")
PARAMETERS = (
    *START,
    *(f"bias_{name}" for name in INPUTS),
    *(f"scale_{name}" for name in SCALED),
    *(f"bias_{name}" for name in OUTPUTS),
)
COUNT = len(PARAMETERS)
_BIAS, _SCALE, _OFFSET = len(START), len(START) + len(INPUTS), len(START) + len(INPUTS) + len(SCALED)
_NONE = 3  # how many of the outputs have a scale factor


@kernel
def rates(
    u: float, v: float, w: float, phi: float, theta: float,
    ax: float, ay: float, az: float, p: float, q: float, r: float,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Rates of u, v, w (m/s2), phi, theta, psi (rad/s)."""
    sine_phi, cosine_phi, sine, cosine = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    turn = q * sine_phi + r * cosine_phi
    return (
        r * v - q * w - G0 * sine + ax,
        p * w - r * u + G0 * cosine * sine_phi + ay,
        q * u - p * v + G0 * cosine * cosine_phi + az,
        p + sine / cosine * turn,
        q * cosine_phi - r * sine_phi,
        turn / cosine,
    )


@entry
def integrate(parameters: FloatArray, inputs: FloatArray, dt: float, out: FloatArray) -> None:
    """Readings of V, alpha, beta, phi, theta, psi along the motion, by Runge-Kutta steps of the fourth order.

    Args:
        parameters: rows of `PARAMETERS` (m, 21): SI, rad.
        inputs: readings of `INPUTS` (N, 6), linear between samples.
        dt: s.
        out: filled with `OUTPUTS` (m, N, 6).
    """
    x, k, a = np.zeros(6), np.zeros((4, 6)), np.zeros(6)
    for m in range(parameters.shape[0]):
        c = parameters[m]
        x[0] = c[0] * math.cos(c[1]) * math.cos(c[2])
        x[1] = c[0] * math.sin(c[2])
        x[2] = c[0] * math.sin(c[1]) * math.cos(c[2])
        x[3], x[4], x[5] = c[3], c[4], c[5]
        k[:] = 0.0  # what a set that flew out of bounds left behind would reach the next through 0 * nan
        for i in range(inputs.shape[0]):
            speed = math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
            out[m, i, 0] = (1.0 + c[_SCALE]) * speed + c[_OFFSET]
            out[m, i, 1] = (1.0 + c[_SCALE + 1]) * math.atan2(x[2], x[0]) + c[_OFFSET + 1]
            out[m, i, 2] = (1.0 + c[_SCALE + 2]) * math.asin(x[1] / speed) + c[_OFFSET + 2]
            for j in range(_NONE, 6):
                out[m, i, j] = x[j] + c[_OFFSET + j]
            if i + 1 == inputs.shape[0]:
                break
            for stage in range(4):
                share = 0.5 * float((stage + 1) // 2)  # of the step: 0, 1/2, 1/2, 1
                for j in range(6):
                    a[j] = (1.0 - share) * inputs[i, j] + share * inputs[i + 1, j] - c[_BIAS + j]
                h, f = share * dt, k[max(stage - 1, 0)]
                k[stage] = rates(
                    x[0] + h * f[0], x[1] + h * f[1], x[2] + h * f[2], x[3] + h * f[3], x[4] + h * f[4],
                    a[0], a[1], a[2], a[3], a[4], a[5],
                )  # fmt: skip
            for j in range(6):
                x[j] += dt / 6.0 * (k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j])


def simulate(parameters: FloatArray, inputs: FloatArray, dt: float) -> FloatArray:
    """`integrate` with its result as a new array (m, N, 6)."""
    out = np.empty((len(parameters), len(inputs), len(OUTPUTS)))
    integrate(np.ascontiguousarray(parameters), np.ascontiguousarray(inputs), dt, out)
    return out
