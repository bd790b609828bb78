"""Cloud along the track: liquid water content, drop size and temperature, inside the certification envelopes.

14 CFR 25 Appendix C, continuous maximum (stratiform) and intermittent maximum (cumuliform): largest mean liquid water
content over (drop diameter, temperature), bilinear between the nodes, times a factor of the horizontal extent, linear
in its logarithm. Supercooled large drops: Appendix O in outline only, its numbers assumed.

Along the track cloud and clear air alternate with exponentially distributed lengths. Each cloud draws its drop
diameter and the share of the largest mean content that its extent allows; within it the content fluctuates slowly
(Ornstein-Uhlenbeck in distance). The content never exceeds the largest factor times the envelope at the temperature
now, and is zero outside the envelope's temperatures and altitudes; so above 0 C.
"""

from __future__ import annotations

import math
from typing import Any

from icing_env import atmosphere
from icing_env.jit import kernel
from icing_env.random import BLOCK, STREAM_CLOUD, normal, uniform4
from icing_env.types import Field

NONE, CONTINUOUS_MAXIMUM, INTERMITTENT_MAXIMUM, LARGE_DROPS, PRESCRIBED = 0, 1, 2, 3, 4

CLOUD_PARAMETERS: list[Field] = [
    ("cloud_mode", "0..4", "0 none, 1 continuous maximum, 2 intermittent maximum, 3 large drops, 4 set from outside"),
    ("temperature_offset", "K", "air temperature above that of the standard atmosphere"),
    ("cloud_length_mean", "m", "mean horizontal extent of a cloud"),
    ("cloud_gap_mean", "m", "mean length of the clear air between clouds"),
    ("cloud_lwc_share_low", "1", "smallest share of the envelope's liquid water content that a cloud draws"),
    ("cloud_lwc_share_high", "1", "largest share, at most 1"),
    ("cloud_mvd_low", "m", "smallest median volume diameter that a cloud draws (within the envelope; not large drops)"),
    ("cloud_mvd_high", "m", "largest median volume diameter"),
    ("cloud_noise_std", "1", "standard deviation of the relative fluctuation of the content within a cloud"),
    ("cloud_noise_length", "m", "distance over which that fluctuation loses correlation"),
]

FREEZING = 273.15
NAUTICAL_MILE, FOOT = 1852.0, 0.3048
SHORTEST = 100.0  # m, of a cloud or a gap; assumed
# Content in g/m3: rows of drop diameter, columns from 0 C down in steps of 10 K.
CONTINUOUS_MVD = (15.0, 20.0, 25.0, 30.0, 35.0, 40.0)  # Appendix C figure 1; AC 20-73A nodes at 15, 25, 40 um
CONTINUOUS_LWC = (
    0.80, 0.60, 0.30, 0.20,
    0.635, 0.415, 0.21, 0.14,
    0.50, 0.30, 0.15, 0.10,
    0.375, 0.22, 0.11, 0.07,
    0.26, 0.15, 0.08, 0.05,
    0.155, 0.10, 0.06, 0.04,
)  # fmt: skip
INTERMITTENT_MVD = (15.0, 20.0, 30.0, 50.0)  # Appendix C figure 4, NACA TN 1855 class II-M; 15 um: 1.16 times 20 um
INTERMITTENT_LWC = (
    2.90, 2.55, 1.97, 1.16, 0.23,
    2.50, 2.20, 1.70, 1.00, 0.20,
    1.30, 1.00, 0.80, 0.50, 0.10,
    0.40, 0.30, 0.20, 0.10, 0.05,
)  # fmt: skip


@kernel
def table(mvd: float, cold: float, diameters: tuple[float, ...], contents: tuple[float, ...], columns: int) -> float:
    """Bilinear value in a table at a diameter (um) and `cold` steps of 10 K below 0 C, held at the edges."""
    row = 0
    for i in range(1, len(diameters) - 1):
        if mvd >= diameters[i]:
            row = i
    y = min(max((mvd - diameters[row]) / (diameters[row + 1] - diameters[row]), 0.0), 1.0)
    cold = min(max(cold, 0.0), columns - 1.0)
    column = min(int(cold), columns - 2)
    x = cold - column
    i = row * columns + column
    above = contents[i] + x * (contents[i + 1] - contents[i])
    below = contents[i + columns] + x * (contents[i + columns + 1] - contents[i + columns])
    return above + y * (below - above)


@kernel
def largest_content(mode: int, mvd: float, temperature: float) -> float:
    """Largest mean liquid water content (kg/m3) over the reference extent, temperature held at the envelope's ends.

    Large drops: 0.30 g/m3 at 0 C falling to 0.20 at -25 C, of the size of Appendix O figures 1 and 4; assumed.
    """
    cold = 0.1 * (FREEZING - temperature)
    if mode == CONTINUOUS_MAXIMUM:
        return 1e-3 * table(1e6 * mvd, cold, CONTINUOUS_MVD, CONTINUOUS_LWC, 4)
    if mode == INTERMITTENT_MAXIMUM:
        return 1e-3 * table(1e6 * mvd, cold, INTERMITTENT_MVD, INTERMITTENT_LWC, 5)
    return 1e-3 * (0.30 - 0.04 * min(max(cold, 0.0), 2.5))


@kernel
def knee(x: float, x0: float, x1: float, x2: float, f0: float, f1: float, f2: float) -> float:
    """Piecewise straight through three points, held outside."""
    x = min(max(x, x0), x2)
    if x <= x1:
        return f0 + (f1 - f0) * (x - x0) / (x1 - x0)
    return f1 + (f2 - f1) * (x - x1) / (x2 - x1)


@kernel
def extent_factor(mode: int, length: float) -> float:
    """Factor on the content for a cloud of a horizontal extent (m): Appendix C figures 3 and 6, held at their ends."""
    x = math.log(max(length, 1.0) / NAUTICAL_MILE)
    if mode == CONTINUOUS_MAXIMUM:
        return knee(x, math.log(5.0), math.log(17.4), math.log(310.0), 1.34, 1.0, 0.2)
    if mode == INTERMITTENT_MAXIMUM:
        return knee(x, math.log(0.26), math.log(2.6), math.log(5.2), 1.35, 1.0, 0.85)
    return 1.0


@kernel
def inside(mode: int, temperature: float, altitude: float) -> bool:
    """True within the envelope's temperatures and altitudes (Appendix C figures 2 and 5; large drops to -25 C)."""
    feet = altitude / FOOT
    if temperature >= FREEZING or feet > 22000.0:
        return False
    if mode == CONTINUOUS_MAXIMUM:
        warmest = FREEZING - 20.0 * max(feet - 12000.0, 0.0) / 10000.0
        return FREEZING - 30.0 <= temperature <= warmest
    if mode == INTERMITTENT_MAXIMUM:
        return feet >= 4000.0 and temperature >= FREEZING - 40.0
    return temperature >= FREEZING - 25.0


@kernel
def begin_cloud(s: Any, p: Any, mode: int, length: float, share: float, size: float) -> None:
    """A new cloud of a length (m), with uniform deviates `share` and `size` for its content and drop diameter."""
    low, high = 100e-6, 200e-6
    if mode != LARGE_DROPS:
        top = 40e-6 if mode == CONTINUOUS_MAXIMUM else 50e-6
        low = min(max(p.cloud_mvd_low, 15e-6), top)
        high = min(max(p.cloud_mvd_high, low), top)
    s.cloud_left = length
    s.mvd = low + size * (high - low)
    fraction = min(p.cloud_lwc_share_low + share * (p.cloud_lwc_share_high - p.cloud_lwc_share_low), 1.0)
    s.cloud_lwc_mean = fraction * extent_factor(mode, length) * largest_content(mode, s.mvd, s.temperature)


@kernel
def begin_gap(s: Any, length: float) -> None:
    """Clear air of a length (m)."""
    s.cloud_left = -length
    s.mvd = s.cloud_lwc_mean = 0.0


@kernel
def follow_track(s: Any, p: Any, mode: int, distance: float) -> None:
    """Move along clouds and gaps by a distance (m); cloud_left = 0 draws where a flight begins."""
    u, share, size, where = uniform4(s.seed, STREAM_CLOUD, s.step, BLOCK[0])
    cloud = max(-math.log(u) * p.cloud_length_mean, SHORTEST)
    gap = max(-math.log(u) * p.cloud_gap_mean, SHORTEST)
    if s.cloud_left == 0.0:
        enter = where * (p.cloud_length_mean + p.cloud_gap_mean) < p.cloud_length_mean
    else:
        left = abs(s.cloud_left) - distance
        if left > 0.0:
            s.cloud_left = left if s.cloud_left > 0.0 else -left
            return
        enter = s.cloud_left < 0.0 or p.cloud_gap_mean <= 0.0
    if enter:
        begin_cloud(s, p, mode, cloud, share, size)
    else:
        begin_gap(s, gap)


@kernel
def advance_cloud(s: Any, p: Any, airspeed: float, dt: float) -> None:
    """Advance the cloud by airspeed dt; called on the slow clock (1 s).

    Args:
        s: STATE record; reads seed, step, altitude; writes the cloud fields. In mode 4 nothing is written.
        p: CLOUD_PARAMETERS.
        airspeed: true airspeed, m/s.
        dt: interval since the last call, s.
    """
    mode = int(p.cloud_mode)
    if mode == PRESCRIBED:
        return
    s.temperature = atmosphere.temperature(s.altitude) + p.temperature_offset
    if mode == NONE:
        s.lwc = s.mvd = 0.0
        return
    distance = airspeed * dt
    follow_track(s, p, mode, distance)
    decay = math.exp(-distance / p.cloud_noise_length)
    n = normal(uniform4(s.seed, STREAM_CLOUD, s.step, BLOCK[1])[0])
    s.cloud_lwc_noise = decay * s.cloud_lwc_noise + p.cloud_noise_std * math.sqrt(1.0 - decay * decay) * n
    s.lwc = 0.0
    if s.cloud_left > 0.0 and inside(mode, s.temperature, s.altitude):
        highest = extent_factor(mode, 0.0) * largest_content(mode, s.mvd, s.temperature)
        s.lwc = min(max(s.cloud_lwc_mean * (1.0 + s.cloud_lwc_noise), 0.0), highest)
