"""Two turboprops: shaft power by throttle with a lag, constant-speed propeller with an efficiency curve.

Power 462 kW each at sea level (UIUC's model), falling with pressure as the PT6A table of JSBSim's DHC-6 does (about
p^0.75); propeller of 8 ft 6 in governed at 1950 rpm. Thrust lies along body x through the
c.g. height, because the published Cm0 was found with power on and no thrust-line moment is published.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.atmosphere import SEA_PRESSURE

POWER = 462.0e3  # W
DIAMETER = 2.591  # m
RPM = 1950.0
LAG = 0.8  # s, gas generator and governor together


def efficiency(speed: NDArray) -> NDArray:
    """Propeller efficiency at true airspeed in m/s: a parabola of the advance ratio with its top at J = 0.95."""
    advance = speed / (RPM / 60.0 * DIAMETER)
    return 0.84 * (1.0 - ((advance - 0.95) / 1.3) ** 2)


def power_demand(throttle: Any, pressure: Any) -> Any:
    """Steady shaft power in W of an engine at `throttle` 0..1 and static `pressure` in Pa."""
    available = POWER * (pressure / SEA_PRESSURE) ** 0.75
    return available * (0.03 + 0.97 * np.clip(throttle, 0.0, 1.0))


def thrust(power: NDArray, speed: NDArray) -> NDArray:
    """Thrust in N from shaft power in W at true airspeed in m/s (speeds of flight only)."""
    return efficiency(speed) * power / speed
