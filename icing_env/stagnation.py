"""What meets a leading edge and how much of it freezes there: catch and heat balance at a stagnation line.

The airfoil's edge is a cylinder of its leading-edge diameter d (Anderson, Manual of Scaling Methods,
NASA/CR-2004-212875), the surface a wet one at 0 C in steady state (Messinger 1953).
* Catch: beta0 = 1.4 (K0 - 1/8)^0.84 / (1 + 1.4 (K0 - 1/8)^0.84) (Langmuir & Blodgett 1946),
  K0 = 1/8 + (lambda/lambda_S)(K - 1/8), K = rho_w MVD^2 V / (18 d mu),
  lambda/lambda_S = 1/(0.8388 + 0.001483 Re + 0.1847 sqrt Re), at most 1, Re of the drop.
* Freezing fraction: n0 = c_w/L_f (phi + theta/b), between 0 and 1, with
  phi = T_f - T - V^2/(2 c_w), the sub-cooling of the drops less their heating by impact,
  theta = T_f - T - V^2/(2 c_p) + evaporation, the cooling by the air,
  b = LWC V beta0 c_w / h_c, the water's share of the heat balance.
"""

from __future__ import annotations

import math

from icing_env.atmosphere import GAS_CONSTANT
from icing_env.jit import kernel

FREEZING = 273.15  # K
WATER_DENSITY, WATER_HEAT = 1000.0, 4218.0  # kg/m3, J/(kg K) at 0 C
FUSION, EVAPORATION = 3.337e5, 2.501e6  # J/kg at 0 C
AIR_HEAT, PRANDTL = 1004.7, 0.711  # J/(kg K); air at 0 C


@kernel
def catch(mvd: float, speed: float, diameter: float, density: float, viscosity: float) -> float:
    """Collection efficiency at the stagnation line of a cylinder, 0..1 (SI arguments)."""
    inertia = WATER_DENSITY * mvd * mvd * speed / (18.0 * diameter * viscosity)
    if inertia <= 0.125:
        return 0.0
    reynolds = density * speed * mvd / viscosity
    reach = min(1.0 / (0.8388 + 0.001483 * reynolds + 0.1847 * math.sqrt(reynolds)), 1.0)
    x = 1.4 * math.pow(reach * (inertia - 0.125), 0.84)
    return x / (1.0 + x)


@kernel
def viscosity_of_air(temperature: float) -> float:
    """Dynamic viscosity, Pa s (U.S. Standard Atmosphere 1976, eq. 51)."""
    return 1.458e-6 * temperature * math.sqrt(temperature) / (temperature + 110.4)


@kernel
def vapour_pressure(temperature: float) -> float:
    """Saturation pressure over water, Pa (Alduchov & Eskridge 1996)."""
    t = temperature - FREEZING
    return 610.94 * math.exp(17.625 * t / (t + 243.04))


@kernel
def heat_transfer(speed: float, diameter: float, density: float, temperature: float) -> float:
    """Convective coefficient at the stagnation line, W/(m2 K): Nu = 1.10 Re^0.472 (Gelder & Lewis, NACA TN 2453).

    Conductivity from U.S. Standard Atmosphere 1976, eq. 53, at the film temperature.
    """
    film = 0.5 * (temperature + FREEZING)
    conductivity = 2.64638e-3 * film * math.sqrt(film) / (film + 245.4 * math.pow(10.0, -12.0 / film))
    reynolds = density * speed * diameter / viscosity_of_air(film)
    return conductivity / diameter * 1.10 * math.pow(reynolds, 0.472)


@kernel
def evaporative_cooling(temperature: float, pressure: float) -> float:
    """Evaporation at a surface at 0 C as if it were a difference of air temperature, K (Lewis relation).

    Diffusivity of vapour 2.11e-5 (T/273.15)^1.94 (101325/p) m2/s (Pruppacher & Klett).
    """
    film = 0.5 * (temperature + FREEZING)
    diffusivity = 2.11e-5 * math.pow(film / FREEZING, 1.94) * 101325.0 / pressure
    schmidt = viscosity_of_air(film) * GAS_CONSTANT * film / (pressure * diffusivity)
    surface, air = vapour_pressure(FREEZING), vapour_pressure(temperature)
    mixing = 0.622 * (surface - air) / (pressure - surface)
    return math.pow(PRANDTL / schmidt, 2.0 / 3.0) * EVAPORATION / AIR_HEAT * mixing


@kernel
def freezing_fraction(
    lwc: float, speed: float, beta: float, diameter: float, temperature: float, density: float
) -> float:
    """Share of the caught water that freezes at the stagnation line, 0..1; 0 at 0 C and above."""
    if temperature >= FREEZING:
        return 0.0
    water = lwc * speed * beta
    if water <= 0.0:
        return 1.0
    cold = FREEZING - temperature
    phi = cold - 0.5 * speed * speed / WATER_HEAT
    pressure = density * GAS_CONSTANT * temperature
    theta = cold - 0.5 * speed * speed / AIR_HEAT + evaporative_cooling(temperature, pressure)
    b = water * WATER_HEAT / heat_transfer(speed, diameter, density, temperature)
    return min(max(WATER_HEAT / FUSION * (phi + theta / b), 0.0), 1.0)
