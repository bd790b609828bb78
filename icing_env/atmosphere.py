"""U.S. Standard Atmosphere 1976 up to 20 km, and gravity.

Source: NOAA/NASA/USAF, U.S. Standard Atmosphere, 1976: eqs. 17-18 (gravity and geopotential height), 23 and 33a-b
(temperature, pressure), 42 (density), table 4 (layers); constants of table 2.
"""

import math

from icing_env.jit import kernel

G0 = 9.80665  # m/s2, table 2
EARTH_RADIUS = 6356766.0  # m, effective radius for g(h), page 4
GAS_CONSTANT = 287.05287  # J/(kg K), R*/M0
T0, P0 = 288.15, 101325.0  # K, Pa at sea level
LAPSE = 0.0065  # K/m up to 11 km geopotential
TROPOPAUSE = 11000.0  # m geopotential
EXPONENT = G0/(GAS_CONSTANT*LAPSE)
T11 = T0 - LAPSE*TROPOPAUSE  # K at the tropopause
P11 = P0*math.exp(EXPONENT*math.log(T11/T0))  # Pa, 22632.06 in table I


@kernel
def gravity(altitude: float, g0: float, radius: float) -> float:
    """Acceleration of gravity [m/s2] at a geometric altitude [m] (US 1976 eq. 17)."""
    ratio = radius / (radius + altitude)
    return g0 * ratio * ratio


@kernel
def static_air(altitude: float) -> tuple:
    """Standard temperature [K] and pressure [Pa] at a geometric altitude [m], in one go."""
    geopotential = EARTH_RADIUS*altitude/(EARTH_RADIUS + altitude)
    if geopotential <= TROPOPAUSE:
        kelvin = T0 - LAPSE*geopotential
        return kelvin, P0*math.exp(EXPONENT*math.log(kelvin*(1.0/T0)))
    return T11, P11*math.exp(-G0*(geopotential - TROPOPAUSE)/(GAS_CONSTANT*T11))


@kernel
def temperature(altitude: float) -> float:
    """Standard temperature [K] at a geometric altitude [m]."""
    return static_air(altitude)[0]


@kernel
def pressure(altitude: float) -> float:
    """Standard pressure [Pa] at a geometric altitude [m]."""
    return static_air(altitude)[1]


@kernel
def density(altitude: float) -> float:
    """Standard density [kg/m3] at a geometric altitude [m]."""
    kelvin, pascal = static_air(altitude)
    return pascal/(GAS_CONSTANT*kelvin)


@kernel
def pressure_altitude(static_pressure: float) -> float:
    """Geometric altitude [m] at which the standard atmosphere has this pressure [Pa] (inverse of `pressure`)."""
    if static_pressure >= P11:
        geopotential = T0/LAPSE*(1.0 - math.exp(math.log(static_pressure/P0)/EXPONENT))
    else:
        geopotential = TROPOPAUSE - GAS_CONSTANT * T11 / G0 * math.log(static_pressure / P11)
    return EARTH_RADIUS * geopotential / (EARTH_RADIUS - geopotential)
