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
# Binomial coefficients of EXPONENT, and the relative change of temperature within which four of them are enough.
BINOMIAL1, BINOMIAL2 = EXPONENT, EXPONENT*(EXPONENT - 1.0)/2.0
BINOMIAL3 = BINOMIAL2*(EXPONENT - 2.0)/3.0
BINOMIAL4, NEAR = BINOMIAL3*(EXPONENT - 3.0)/4.0, 3e-4
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
def place_of_static_air(altitude: float) -> tuple:
    """Standard pressure [Pa] and 1/temperature [1/K] from which `static_air_near` goes on; 0 above the tropopause."""
    kelvin, pascal = static_air(altitude)
    return pascal, 1.0/kelvin if kelvin > T11 else 0.0


@kernel
def static_air_near(altitude: float, pascal_there: float, per_kelvin_there: float) -> tuple:
    """`static_air` at an altitude [m] near that of `place_of_static_air`, without exponential and logarithm.

    p = p_there (T/T_there)^EXPONENT (US 1976 eq. 33a) as a binomial series in T/T_there - 1: within 13 m its fifth
    term is below rounding. Returns temperature, pressure, and whether it holds: not farther away, and not above the
    tropopause.
    """
    kelvin = T0 - LAPSE*(EARTH_RADIUS*altitude/(EARTH_RADIUS + altitude))
    x = kelvin*per_kelvin_there - 1.0
    pascal = pascal_there*(1.0 + x*(BINOMIAL1 + x*(BINOMIAL2 + x*(BINOMIAL3 + x*BINOMIAL4))))
    return kelvin, pascal, abs(x) <= NEAR and kelvin >= T11


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
