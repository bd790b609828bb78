"""Turbulence and discrete gusts: the velocity of the air that the aircraft meets, in body axes.

Signs: gust_u, gust_v, gust_w are the velocity of the AIR along the body axes, gust_p, gust_q, gust_r the rotation of
the air, so that the velocity relative to the air is inertial velocity - wind - gust, and likewise for the rates.

Continuous turbulence has the Dryden form of MIL-F-8785C (3.7.2); one-sided spectra in w (rad/s), integral sigma^2:
    Phi_u = 2 sigma_u^2 T_u / pi / (1 + (T_u w)^2),                         T = L / V,
    Phi_v,w = sigma^2 T / pi (1 + 3 (T w)^2) / (1 + (T w)^2)^2,
    Phi_p = sigma_w^2 / (V L_w) 0.8 (pi L_w / 4 b)^(1/3) / (1 + (4 b w / pi V)^2),
    Phi_q = (w/V)^2 / (1 + (4 b w / pi V)^2) Phi_w,   Phi_r the same with 3 b and Phi_v.
Each filter is x1' = -x1/T + sigma sqrt(2/T) n, x2' = (x1 - x2)/T, gust = (sqrt3 x1 + (1 - sqrt3) x2)/sqrt2 for v and w,
gust = x1 for u and p. Both are advanced exactly, with the exact covariance of the noise over dt, so that variance and
correlation are right at any dt. gust_q = -w'/V and gust_r = +v'/V behind the lag of the span (a field w(x) that grows
forward is air that pitches down), by the exact response to v and w that are straight lines over dt.

The tail meets the vertical gust tail_arm / V later. Either that delay or gust_q, never both: they describe the same
variation along the aircraft. The delay is the first-order Pade form (1 - s D/2) / (1 + s D/2), which keeps the variance
and needs no more memory than the last two outputs. Without it and without rotation all of the aircraft meets the gust
at its c.g., as in many simulators.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from icing_env.jit import kernel
from icing_env.random import BLOCK, STREAM_TURBULENCE, STREAM_TURBULENCE_START, Word, normal, normal4, uniform, words4
from icing_env.types import Field

TURBULENCE_PARAMETERS: list[Field] = [
    ("turbulence_sigma_w", "m/s", "intensity: standard deviation of the vertical gust"),
    ("turbulence_tail_delay", "0/1", "1: the tail meets the vertical gust later, which takes the place of gust_q"),
    ("turbulence_rotation", "0/1", "1: the air turns: gust_p, gust_r, and gust_q unless the tail meets gusts later"),
    ("gust_start_time", "s", "time at which the discrete gust begins"),
    ("gust_length", "m", "gradient distance of the discrete gust, from its start to its peak"),
    ("gust_amplitude_u", "m/s", "peak of the discrete gust along body x"),
    ("gust_amplitude_v", "m/s", "peak of the discrete gust along body y"),
    ("gust_amplitude_w", "m/s", "peak of the discrete gust along body z"),
]

FOOT = 0.3048
_SQRT3, _SQRT_HALF = math.sqrt(3.0), math.sqrt(0.5)
_W16, _SHIFT16 = np.uint64(0xFFFF), np.uint64(16)
LOWEST_AIRSPEED = 5.0  # m/s; below it the frozen field would stand still. Assumed


@kernel
def scales(altitude: float) -> tuple[float, float, float]:
    """Scale lengths and intensity ratio of MIL-F-8785C at an altitude (m) above the ground.

    Returns:
        L_u = L_v (m), L_w (m), sigma_u / sigma_w = sigma_v / sigma_w. Below 1000 ft the low-altitude model (not below
        10 ft), above 2000 ft isotropic with 1750 ft, linear in between.
    """
    h = max(altitude / FOOT, 10.0)
    if h < 1000.0:
        base = 0.177 + 0.000823 * h
        return FOOT * h / math.pow(base, 1.2), FOOT * h, math.pow(base, -0.4)
    length = FOOT * (1000.0 + 0.75 * min(h - 1000.0, 1000.0))
    return length, length, 1.0


@kernel
def pair_noise(tau: float) -> tuple[float, float, float, float]:
    """Decay over tau = dt/T and the lower triangular factor of the noise of the state pair (unit variance of x1).

    Returns:
        exp(-tau), l11, l21, l22 with [w1, w2] = [l11 n1, l21 n1 + l22 n2].
    """
    decay = math.exp(-tau)
    square = decay * decay
    l11 = math.sqrt(1.0 - square)
    l21 = (0.5 - square * (tau + 0.5)) / l11
    l22 = math.sqrt(max(0.5 - square * (tau * tau + tau + 0.5) - l21 * l21, 0.0))
    return decay, l11, l21, l22


@kernel
def transverse(x1: float, x2: float) -> float:
    """Gust along y or z of its filter's two states, m/s."""
    return _SQRT_HALF * (_SQRT3 * x1 + (1.0 - _SQRT3) * x2)


@kernel
def lag(y: float, before: float, after: float, tau: float) -> float:
    """First-order lag over tau = dt/T behind an input that goes in a straight line from `before` to `after`."""
    decay = math.exp(-tau)
    gain = (1.0 - decay) / tau
    return decay * y + (gain - decay) * before + (1.0 - gain) * after


@kernel
def stationary_lag(x1: float, x2: float, time: float, time_lag: float, sigma: float, n: float) -> float:
    """Stationary sample of a lag (time constant `time_lag`) behind `transverse(x1, x2)`, given x1 and x2."""
    a, b = 1.0 / time, 1.0 / time_lag
    m1 = sigma * sigma * _SQRT_HALF * 0.5 * (1.0 + _SQRT3) * b / (a + b)
    m2 = (a * m1 + b * sigma * sigma * 0.5 * _SQRT_HALF) / (a + b)
    k1, k2 = 2.0 * (m1 - m2) / (sigma * sigma), (4.0 * m2 - 2.0 * m1) / (sigma * sigma)
    variance = _SQRT_HALF * (_SQRT3 * m1 + (1.0 - _SQRT3) * m2)
    return k1 * x1 + k2 * x2 + math.sqrt(max(variance - k1 * m1 - k2 * m2, 0.0)) * n


@kernel
def roll_time(span: float, airspeed: float) -> float:
    """Time constant (s) of the rolling gust, and of the lag behind w that makes the pitching one."""
    return 4.0 * span / (math.pi * airspeed)


@kernel
def roll_spectrum(sigma: float, length: float, span: float, airspeed: float) -> tuple[float, float]:
    """Standard deviation (rad/s) and time constant (s) of the rolling gust."""
    time = roll_time(span, airspeed)
    density = 0.8 * math.pow(0.25 * math.pi * length / span, 1.0 / 3.0) / (length * airspeed)
    return sigma * math.sqrt(density * 0.5 * math.pi / time), time


@kernel
def discrete_gust(time: float, airspeed: float, p: Any) -> float:
    """Shape of the discrete gust, 0..1: (1 - cos(pi s / H)) / 2 for 0 <= s <= 2 H, 14 CFR 25.341(a)(2)."""
    length = p.gust_length
    s = airspeed * (time - p.gust_start_time)
    if length <= 0.0 or s <= 0.0 or s >= 2.0 * length:
        return 0.0
    return 0.5 * (1.0 - math.cos(math.pi * s / length))


@kernel
def add_discrete(s: Any, p: Any, airspeed: float, dt: float) -> None:
    """Add the discrete gust at the end of the step to gust_u, gust_v, gust_w."""
    if p.gust_amplitude_u != 0.0 or p.gust_amplitude_v != 0.0 or p.gust_amplitude_w != 0.0:
        shape = discrete_gust(float(s.step + 1) * dt, airspeed, p)
        s.gust_u += shape * p.gust_amplitude_u
        s.gust_v += shape * p.gust_amplitude_v
        s.gust_w += shape * p.gust_amplitude_w


@kernel
def stay_level(s: Any) -> None:
    """No rotation of the air."""
    s.dryden_p = s.dryden_q = s.dryden_r = 0.0
    s.gust_p = s.gust_q = s.gust_r = 0.0


@kernel
def calm(s: Any) -> None:
    """No turbulence: states and gusts exactly zero, the tail's gust left to its delay."""
    s.dryden_u = s.dryden_v1 = s.dryden_v2 = s.dryden_w1 = s.dryden_w2 = 0.0
    s.gust_u = s.gust_v = s.gust_w = 0.0
    stay_level(s)


@kernel
def put_translation(s: Any) -> None:
    """Gust velocities of the filter states."""
    s.gust_u = s.dryden_u
    s.gust_v = transverse(s.dryden_v1, s.dryden_v2)
    s.gust_w = transverse(s.dryden_w1, s.dryden_w2)


@kernel
def put_rotation(s: Any, p: Any, airspeed: float) -> None:
    """Gust rotations: the derivative of w and v along the path, by the lags whose states are dryden_q, dryden_r."""
    s.gust_q = -math.pi / (4.0 * p.span) * (transverse(s.dryden_w1, s.dryden_w2) - s.dryden_q)
    if p.turbulence_tail_delay != 0.0:
        s.gust_q = 0.0
    s.gust_r = math.pi / (3.0 * p.span) * (transverse(s.dryden_v1, s.dryden_v2) - s.dryden_r)


@kernel
def uniform16(word: Word) -> float:
    """Uniform deviate in (0, 1) of a 16-bit word."""
    return (float(np.int64(word)) + 0.5) / 65536.0


@kernel
def advance_translation(s: Any, sigma: float, airspeed: float, dt: float) -> None:
    """Advance the filters of u, v, w (one Philox block: 32 bits a noise, 16 for each pair's small second noise)."""
    length_uv, length_w, ratio = scales(s.altitude)
    a, b, c, d = words4(s.seed, STREAM_TURBULENCE, s.step, BLOCK[0])
    v1, v2 = normal(uniform(b)), normal(uniform16(d & _W16))
    w1, w2 = normal(uniform(c)), normal(uniform16(d >> _SHIFT16))
    tau = airspeed * dt / length_uv
    decay, l11, l21, l22 = pair_noise(tau)
    sigma_uv = ratio * sigma
    s.dryden_u = decay * s.dryden_u + sigma_uv * l11 * normal(uniform(a))
    s.dryden_v2 = decay * (s.dryden_v2 + tau * s.dryden_v1) + sigma_uv * (l21 * v1 + l22 * v2)
    s.dryden_v1 = decay * s.dryden_v1 + sigma_uv * l11 * v1
    if length_w != length_uv:
        tau = airspeed * dt / length_w
        decay, l11, l21, l22 = pair_noise(tau)
    s.dryden_w2 = decay * (s.dryden_w2 + tau * s.dryden_w1) + sigma * (l21 * w1 + l22 * w2)
    s.dryden_w1 = decay * s.dryden_w1 + sigma * l11 * w1


@kernel
def advance_roll(s: Any, p: Any, airspeed: float, dt: float) -> None:
    """Advance the rolling gust, after the translation."""
    sigma_p, time_p = roll_spectrum(p.turbulence_sigma_w, scales(s.altitude)[1], p.span, airspeed)
    decay = math.exp(-dt / time_p)
    n = normal(uniform(words4(s.seed, STREAM_TURBULENCE, s.step, BLOCK[1])[0]))
    s.dryden_p = decay * s.dryden_p + sigma_p * math.sqrt(1.0 - decay * decay) * n
    s.gust_p = s.dryden_p


@kernel
def follow_path(s: Any, p: Any, airspeed: float, dt: float, v_before: float, w_before: float) -> None:
    """Advance the lags behind w and v, after the translation; then gust_q, gust_r."""
    time_p = roll_time(p.span, airspeed)
    w_after, v_after = transverse(s.dryden_w1, s.dryden_w2), transverse(s.dryden_v1, s.dryden_v2)
    s.dryden_q = lag(s.dryden_q, w_before, w_after, dt / time_p)
    s.dryden_r = lag(s.dryden_r, v_before, v_after, dt / (0.75 * time_p))
    put_rotation(s, p, airspeed)


@kernel
def reach_tail(s: Any, p: Any, airspeed: float, before: float, dt: float) -> None:
    """The vertical gust at the tail behind its delay; `before`: gust_w at the start of the step."""
    half = 0.5 * (s.gust_w_tail + before)  # the state of the Pade filter, from its last output and input
    s.gust_w_tail = 2.0 * lag(half, before, s.gust_w, 2.0 * airspeed * dt / p.tail_arm) - s.gust_w


@kernel
def advance_turbulence(s: Any, p: Any, airspeed: float, dt: float) -> None:
    """Draw the gusts at the end of the step that begins now; within it they go there in straight lines.

    Args:
        s: STATE record; step counts intervals of dt. Reads seed, step, altitude; writes dryden_* and gust_*.
        p: TURBULENCE_PARAMETERS, span, tail_arm.
        airspeed: true airspeed, m/s (at least LOWEST_AIRSPEED is used).
        dt: interval since the last call, s.
    """
    v = max(airspeed, LOWEST_AIRSPEED)
    total_before = s.gust_w
    if p.turbulence_sigma_w > 0.0:
        v_before, w_before = transverse(s.dryden_v1, s.dryden_v2), transverse(s.dryden_w1, s.dryden_w2)
        advance_translation(s, p.turbulence_sigma_w, v, dt)
        put_translation(s)
        if p.turbulence_rotation != 0.0:
            advance_roll(s, p, v, dt)
            follow_path(s, p, v, dt, v_before, w_before)
        else:
            stay_level(s)
    else:
        calm(s)
    add_discrete(s, p, v, dt)
    if p.turbulence_tail_delay != 0.0 and p.tail_arm > 0.0:
        reach_tail(s, p, v, total_before, dt)
    else:
        s.gust_w_tail = s.gust_w


@kernel
def start_turbulence(s: Any, p: Any, airspeed: float) -> None:
    """Draw filter states and gusts from their stationary distribution (arguments as `advance_turbulence`)."""
    v, sigma = max(airspeed, LOWEST_AIRSPEED), p.turbulence_sigma_w
    calm(s)
    s.gust_w_tail = 0.0
    if sigma <= 0.0:
        return
    length_uv, length_w, ratio = scales(s.altitude)
    n0, n1, n2, n3 = normal4(s.seed, STREAM_TURBULENCE_START, s.step, BLOCK[0])
    n4, n5, n6, n7 = normal4(s.seed, STREAM_TURBULENCE_START, s.step, BLOCK[1])
    s.dryden_u = ratio * sigma * n0
    s.dryden_v1, s.dryden_v2 = ratio * sigma * n1, 0.5 * ratio * sigma * (n1 + n2)
    s.dryden_w1, s.dryden_w2 = sigma * n3, 0.5 * sigma * (n3 + n4)
    put_translation(s)
    s.gust_w_tail = s.gust_w
    if p.turbulence_rotation != 0.0:
        sigma_p, time_p = roll_spectrum(sigma, length_w, p.span, v)
        s.dryden_p = s.gust_p = sigma_p * n5
        s.dryden_q = stationary_lag(s.dryden_w1, s.dryden_w2, length_w / v, time_p, sigma, n6)
        s.dryden_r = stationary_lag(s.dryden_v1, s.dryden_v2, length_uv / v, 0.75 * time_p, ratio * sigma, n7)
        put_rotation(s, p, v)
    if p.turbulence_tail_delay != 0.0 and p.tail_arm > 0.0:
        half = stationary_lag(s.dryden_w1, s.dryden_w2, length_w / v, 0.5 * p.tail_arm / v, sigma, n6)
        s.gust_w_tail = 2.0 * half - s.gust_w
