"""Gusts along a record as the filter expects them: the Dryden filters of `icing_env.turbulence`, of one intensity.

`drift_turbulence` takes the place of `advance_turbulence` where the plant is a predictor.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from icing_env.jit import kernel
from icing_env.record import FloatArray
from icing_env.turbulence import (
    LOWEST_AIRSPEED,
    follow_path,
    pair_noise,
    put_translation,
    reach_tail,
    roll_spectrum,
    roll_time,
    scales,
    stay_level,
)
from sim2real.records.reconstruct import Reconstruction


class Kind(NamedTuple):
    """How gusts differ along the aircraft.

    Attributes:
        tail_delay: whether the tail meets the vertical gust later.
        rotation: whether the air turns (the rotational spectra of MIL-F-8785C, that of pitch only without the delay).
    """

    tail_delay: bool = True
    rotation: bool = False

    def put(self, parameters: NDArray) -> None:
        """Let PARAMETERS rows meet such gusts."""
        parameters["turbulence_tail_delay"] = float(self.tail_delay)
        parameters["turbulence_rotation"] = float(self.rotation)


LATER = Kind()
KINDS = (LATER, Kind(False, True), Kind(False, False), Kind(True, True))


class Gusts(NamedTuple):
    """Turbulence along a record: its intensity, m/s, and its kind."""

    sigma: float
    kind: Kind = LATER

    def put(self, parameters: NDArray) -> None:
        """Let PARAMETERS rows meet them."""
        parameters["turbulence_sigma_w"] = max(self.sigma, 1e-6)
        self.kind.put(parameters)

    def noise(self, flight: Reconstruction) -> FloatArray:
        """Covariance of what drives them over a step of a record [dryden states, dryden states]."""
        speed, height = _typical(flight)
        return gust_noise(self.sigma, speed, height, flight.dt, self.span(flight))

    def span(self, flight: Reconstruction) -> float:
        """That along which the air turns, m; 0 if it does not."""
        return float(flight.parameters["span"][0]) if self.kind.rotation else 0.0

    def rolling(self, flight: Reconstruction) -> float:
        """Standard deviation of the rolling gust, rad/s."""
        speed, height = _typical(flight)
        return _rolling(self.sigma, speed, height, self.span(flight))[0] if self.kind.rotation else 0.0


def met(flight: Reconstruction) -> float:
    """Speed at which a record meets air that turns, m/s: its typical one, of which gains and noise are, too.

    An aircraft that changes its speed meets a frozen field faster or more slowly; but who draws gusts mostly draws them
    for one speed, and what they turn of the air less than they were taken to, as the airspeed rises, is a pitching
    moment over time, of 1e-4 in 1.5 m/s, that slow innovations show.
    """
    return _typical(flight)[0]


def _typical(flight: Reconstruction) -> tuple[float, float]:
    """Airspeed, m/s, and altitude, m."""
    return flight.once("typical", lambda: (float(np.median(flight.channel("airspeed"))),
                                           float(np.median(flight.altitude))))  # fmt: skip


def _rolling(sigma: float, speed: float, height: float, span: float) -> tuple[float, float]:
    sd, time = roll_spectrum(sigma, scales(height)[1], span, speed)
    return float(sd), float(time)


def gust_noise(sigma: float, speed: float, height: float, dt: float, span: float = 0.0) -> FloatArray:
    """Covariance of what drives dryden_u, v1, v2, w1, w2, p, q, r over a step [8, 8]; the last two only follow.

    Args:
        span: m; 0 if the air does not turn.
    """
    length_uv, length_w, ratio = scales(height)
    out = np.zeros((8, 8))
    for first, length, intensity in ((1, length_uv, ratio * sigma), (3, length_w, sigma)):
        _, l11, l21, l22 = pair_noise(speed * dt / length)
        factor = intensity * np.array([[l11, 0.0], [l21, l22]])
        out[first : first + 2, first : first + 2] = factor @ factor.T
    out[0, 0] = (ratio * sigma * pair_noise(speed * dt / length_uv)[1]) ** 2
    if span > 0.0:
        sd, time = _rolling(sigma, speed, height, span)
        out[5, 5] = sd**2 * (1.0 - np.exp(-2.0 * dt / time))
    return out


@kernel
def drift_translation(s: Any, airspeed: float, dt: float) -> None:
    """What the filters of u, v, w become without new noise: their expected values."""
    length_uv, length_w, _ratio = scales(s.altitude)
    tau = airspeed * dt / length_uv
    decay = math.exp(-tau)
    s.dryden_u = decay * s.dryden_u
    s.dryden_v2 = decay * (s.dryden_v2 + tau * s.dryden_v1)
    s.dryden_v1 = decay * s.dryden_v1
    if length_w != length_uv:
        tau = airspeed * dt / length_w
        decay = math.exp(-tau)
    s.dryden_w2 = decay * (s.dryden_w2 + tau * s.dryden_w1)
    s.dryden_w1 = decay * s.dryden_w1


@kernel
def drift_turbulence(s: Any, p: Any, airspeed: float, dt: float) -> None:
    """`advance_turbulence` as a predictor sees it: nothing is drawn."""
    v = max(airspeed, LOWEST_AIRSPEED)
    v_before, w_before = s.gust_v, s.gust_w
    drift_translation(s, v, dt)
    put_translation(s)
    if p.turbulence_rotation != 0.0:
        s.dryden_p *= math.exp(-dt / roll_time(p.span, v))
        s.gust_p = s.dryden_p
        follow_path(s, p, v, dt, v_before, w_before)
    else:
        stay_level(s)
    if p.turbulence_tail_delay != 0.0:
        reach_tail(s, p, v, w_before, dt)
    else:
        s.gust_w_tail = s.gust_w
