"""Scalar building blocks that the control laws share."""

from __future__ import annotations

import math
from typing import Any

from icing_env.atmosphere import GAS_CONSTANT
from icing_env.jit import kernel


@kernel
def clip(value: float, low: float, high: float) -> float:
    """`value` held within `low` and `high`; `low` wins where the two cross."""
    return max(min(value, high), low)


@kernel
def wrapped(angle: float) -> float:
    """The same angle [rad] in -pi..pi."""
    return angle - 2.0*math.pi*math.floor(angle/(2.0*math.pi) + 0.5)


@kernel
def positive_part(value: float, width: float) -> float:
    """max(value, 0) with the corner rounded over +-`width`: once differentiable, exactly 0 below -`width`."""
    if value <= -width:
        return 0.0
    if value >= width:
        return value
    return (value + width)*(value + width)/(4.0*width)


@kernel
def integrated(integral: float, rate: float, output: float, low: float, high: float) -> float:
    """Integral one step on (`rate` times the step), held where the output is at a limit and would be driven beyond.

    Anti-windup by conditional integration (Astrom & Hagglund, Advanced PID Control, section 3.5).
    """
    if (output >= high and rate > 0.0) or (output <= low and rate < 0.0):
        return integral
    return clip(integral + rate, low, high)


@kernel
def air_density(m: Any) -> float:
    """Density [kg/m3] of the ideal gas at the measured static pressure and temperature."""
    return max(m.pressure, 1000.0)/(GAS_CONSTANT*max(m.temperature, 150.0))


@kernel
def airspeed_of(m: Any) -> float:
    """Measured true airspeed [m/s], at least 15: a failed or frozen pitot must not divide by zero."""
    return max(m.airspeed, 15.0)


@kernel
def airspeed_rate(m: Any, gravity: float) -> float:
    """Rate of the airspeed [m/s2] in still air: specific force along the air stream, and gravity."""
    sine, cosine = math.sin(m.alpha), math.cos(m.alpha)
    return m.ax*cosine + m.az*sine + gravity*(
        math.cos(m.theta)*math.cos(m.phi)*sine - math.sin(m.theta)*cosine)


@kernel
def alpha_rate(m: Any, gravity: float) -> float:
    """Rate of the angle of attack [rad/s] from rates, specific force and attitude.

    Stevens, Lewis & Johnson, Aircraft Control and Simulation, 3rd ed., section 2.3: the w equation divided by V, with
    small alpha and beta except where they multiply the roll rate.
    """
    normal = m.az*math.cos(m.alpha) - m.ax*math.sin(m.alpha)
    weight = gravity*(math.cos(m.theta)*math.cos(m.phi)*math.cos(m.alpha) + math.sin(m.theta)*math.sin(m.alpha))
    return m.q - m.p*m.beta + (normal + weight)/airspeed_of(m)
