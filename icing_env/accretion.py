"""Ice accretion on seven surfaces: what the cloud leaves on the aircraft in a second.

Per surface, from the cloud (LWC, MVD, temperature), the speed and a leading-edge diameter d:
* catch beta0 and freezing fraction n0 at the stagnation line (stagnation.py);
* thickness LWC V beta0 n0/rho_i; mass over the frontal area, half of the unfrozen water staying (assumed);
* severity: d eta/dt = eta_rate LWC V beta0/(rho_i length) g(n0) (1 - eta/eta_saturation). This is Bragg's measure
  (drag as a function of accumulation parameter, catch and freezing fraction, worst for glaze near n0 = 0.2) with an
  assumed form of g: 1 at the peak, a lower shelf for rime, 0 where nothing freezes. `eta_rate` is the one calibration.
Nothing grows without liquid water or at 0 C and above. Ice is also shed at random and wastes away outside cloud.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env.jit import kernel
from icing_env.random import BLOCK, STREAM_SHEDDING, Word, uniform4
from icing_env.stagnation import FREEZING, catch, freezing_fraction, viscosity_of_air
from icing_env.types import SURFACES, Field

ACCRETION_PARAMETERS: list[Field] = [
    *((f"edge_diameter_{s}", "m", f"diameter of the leading edge, {s.replace('_', ' ')}") for s in SURFACES),
    *((f"frontal_area_{s}", "m2", f"area that meets the drops, {s.replace('_', ' ')}") for s in SURFACES),
    *((f"eta_length_{s}", "m", f"length by which severity is counted, {s.replace('_', ' ')}") for s in SURFACES),
    *((f"eta_saturation_{s}", "1", f"severity that cannot be exceeded, {s.replace('_', ' ')}") for s in SURFACES),
    ("eta_rate", "1", "severity per accumulation parameter times catch, at the worst freezing fraction"),
    ("glaze_peak", "1", "freezing fraction of the worst ice"),
    ("rime_severity", "1", "severity of rime (freezing fraction 1) over that of the worst ice"),
    ("ice_density", "kg/m3", "density of accreted ice"),
    ("blade_speed", "m/s", "speed of rotation of the propeller blades where ice counts"),
    ("shed_rate", "1/s", "rate of natural shedding at shed_thickness and -5 C; 0 for none"),
    ("shed_thickness", "m", "thickness at which shed_rate holds; the rate grows with its square"),
    ("shed_share_low", "1", "smallest share that one shedding removes"),
    ("shed_share_high", "1", "largest share that one shedding removes"),
    ("melt_rate", "1/(K s)", "relative loss of ice per kelvin above 0 C"),
    ("sublimation_rate", "1/s", "relative loss of ice in cold clear air"),
]


@kernel
def glaze(n: float, peak: float, rime: float) -> float:
    """Severity of ice of freezing fraction n over that of the worst: 0 at 0, 1 at `peak`, `rime` at 1; smooth."""
    if n <= peak:
        x = n / peak
        return x * (2.0 - x)
    y = (n - peak) / (1.0 - peak)
    return rime + (1.0 - rime) * (1.0 - y) * (1.0 - y) * (1.0 + 2.0 * y)


@kernel
def growth(
    s: Any, p: Any, speed: float, density: float, dt: float, diameter: float, area: float, length: float
) -> tuple[float, float, float]:
    """What a surface gains in dt: severity (before saturation), thickness (m), mass (kg)."""
    beta = catch(s.mvd, speed, diameter, density, viscosity_of_air(s.temperature))
    n = freezing_fraction(s.lwc, speed, beta, diameter, s.temperature, density)
    depth = s.lwc * speed * beta * dt / p.ice_density
    severity = p.eta_rate * depth / length * glaze(n, p.glaze_peak, p.rime_severity)
    return severity, depth * n, depth * p.ice_density * area * 0.5 * (1.0 + n)


@kernel
def add_severity(eta: float, gain: float, saturation: float) -> float:
    """Severity after a gain, approaching its saturation exponentially."""
    if eta >= saturation:
        return eta
    return saturation - (saturation - eta) * math.exp(-gain / saturation)


@kernel
def kept(s: Any, p: Any, dt: float, thickness: float, block: Word) -> float:
    """Share of a surface's ice that wasting and random shedding leave in dt."""
    if thickness <= 0.0:
        return 1.0
    left = 1.0
    warm = s.temperature - FREEZING
    if warm > 0.0:
        left = math.exp(-p.melt_rate * warm * dt)
    elif s.lwc <= 0.0:
        left = math.exp(-p.sublimation_rate * dt)
    if p.shed_rate > 0.0:
        ratio = thickness / p.shed_thickness
        rate = p.shed_rate * ratio * ratio * math.exp(0.2 * (min(warm, 5.0) + 5.0))  # five-fold per 8 K; assumed
        u, share, _, _ = uniform4(s.seed, STREAM_SHEDDING, s.step, block)
        if u < 1.0 - math.exp(-rate * dt):
            left *= 1.0 - (p.shed_share_low + share * (p.shed_share_high - p.shed_share_low))
    return left


@kernel
def waste_ice(s: Any, p: Any, dt: float) -> None:
    """Melting, sublimation and natural shedding of every surface."""
    left = kept(s, p, dt, s.thickness_left_wing, BLOCK[0])
    s.eta_left_wing *= left
    s.thickness_left_wing *= left
    s.ice_mass_left_wing *= left
    left = kept(s, p, dt, s.thickness_right_wing, BLOCK[1])
    s.eta_right_wing *= left
    s.thickness_right_wing *= left
    s.ice_mass_right_wing *= left
    left = kept(s, p, dt, s.thickness_htail, BLOCK[2])
    s.eta_htail *= left
    s.thickness_htail *= left
    s.ice_mass_htail *= left
    left = kept(s, p, dt, s.thickness_vtail, BLOCK[3])
    s.eta_vtail *= left
    s.thickness_vtail *= left
    s.ice_mass_vtail *= left
    left = kept(s, p, dt, s.thickness_struts, BLOCK[4])
    s.eta_struts *= left
    s.thickness_struts *= left
    s.ice_mass_struts *= left
    left = kept(s, p, dt, s.thickness_propeller, BLOCK[5])
    s.eta_propeller *= left
    s.thickness_propeller *= left
    s.ice_mass_propeller *= left
    left = kept(s, p, dt, s.thickness_other, BLOCK[6])
    s.eta_other *= left
    s.thickness_other *= left
    s.ice_mass_other *= left


@kernel
def grow_wing(s: Any, p: Any, airspeed: float, density: float, dt: float) -> None:
    """Growth on the two half wings, each by its own numbers."""
    gain, depth, mass = growth(
        s, p, airspeed, density, dt, p.edge_diameter_left_wing, p.frontal_area_left_wing, p.eta_length_left_wing
    )
    s.eta_left_wing = add_severity(s.eta_left_wing, gain, p.eta_saturation_left_wing)
    s.thickness_left_wing += depth
    s.ice_mass_left_wing += mass
    gain, depth, mass = growth(
        s, p, airspeed, density, dt, p.edge_diameter_right_wing, p.frontal_area_right_wing, p.eta_length_right_wing
    )
    s.eta_right_wing = add_severity(s.eta_right_wing, gain, p.eta_saturation_right_wing)
    s.thickness_right_wing += depth
    s.ice_mass_right_wing += mass


@kernel
def grow_tail(s: Any, p: Any, airspeed: float, density: float, dt: float) -> None:
    """Growth on tailplane and fin."""
    gain, depth, mass = growth(
        s, p, airspeed, density, dt, p.edge_diameter_htail, p.frontal_area_htail, p.eta_length_htail
    )
    s.eta_htail = add_severity(s.eta_htail, gain, p.eta_saturation_htail)
    s.thickness_htail += depth
    s.ice_mass_htail += mass
    gain, depth, mass = growth(
        s, p, airspeed, density, dt, p.edge_diameter_vtail, p.frontal_area_vtail, p.eta_length_vtail
    )
    s.eta_vtail = add_severity(s.eta_vtail, gain, p.eta_saturation_vtail)
    s.thickness_vtail += depth
    s.ice_mass_vtail += mass


@kernel
def grow_others(s: Any, p: Any, airspeed: float, density: float, dt: float) -> None:
    """Growth on struts and gear, propellers (at the blades' speed) and the remaining parts."""
    gain, depth, mass = growth(
        s, p, airspeed, density, dt, p.edge_diameter_struts, p.frontal_area_struts, p.eta_length_struts
    )
    s.eta_struts = add_severity(s.eta_struts, gain, p.eta_saturation_struts)
    s.thickness_struts += depth
    s.ice_mass_struts += mass
    blade = math.sqrt(airspeed * airspeed + p.blade_speed * p.blade_speed)
    gain, depth, mass = growth(
        s, p, blade, density, dt, p.edge_diameter_propeller, p.frontal_area_propeller, p.eta_length_propeller
    )
    s.eta_propeller = add_severity(s.eta_propeller, gain, p.eta_saturation_propeller)
    s.thickness_propeller += depth
    s.ice_mass_propeller += mass
    gain, depth, mass = growth(
        s, p, airspeed, density, dt, p.edge_diameter_other, p.frontal_area_other, p.eta_length_other
    )
    s.eta_other = add_severity(s.eta_other, gain, p.eta_saturation_other)
    s.thickness_other += depth
    s.ice_mass_other += mass


@kernel
def advance_accretion(s: Any, p: Any, airspeed: float, density: float, dt: float) -> None:
    """Advance the ice of every surface; called on the slow clock (1 s).

    Args:
        s: STATE record; reads seed, step and the cloud, writes eta_*, thickness_*, ice_mass_*.
        p: ACCRETION_PARAMETERS.
        airspeed: true airspeed, m/s.
        density: of the air, kg/m3.
        dt: interval since the last call, s.
    """
    waste_ice(s, p, dt)
    if s.lwc <= 0.0 or s.temperature >= FREEZING or airspeed <= 0.0:
        return
    grow_wing(s, p, airspeed, density, dt)
    grow_tail(s, p, airspeed, density, dt)
    grow_others(s, p, airspeed, density, dt)


GLAZE = 0.37  # freezing fraction on the wing in the first encounter of flight 010302f1 (docs/model_weather_ice.md)


def glaze_of(eta: NDArray, p: NDArray, surface: str) -> tuple[NDArray, NDArray]:
    """Thickness (m) and mass (kg) of the glaze that makes a severity, for a flight that starts with ice on.

    `growth` and `add_severity` turned round, at the freezing fraction GLAZE.

    Args:
        eta: severity [n]; as good as saturated where it is beyond the saturation.
        p: PARAMETERS [n or 1].
        surface: name in SURFACES.
    """
    saturation = p[f"eta_saturation_{surface}"]
    gain = -saturation*np.log1p(-np.minimum(eta/saturation, 0.99))
    depth = gain*p[f"eta_length_{surface}"]/(p["eta_rate"]*np.array([
        glaze(GLAZE, peak, rime) for peak, rime in zip(p["glaze_peak"], p["rime_severity"], strict=True)]))
    return depth*GLAZE, depth*p["ice_density"]*p[f"frontal_area_{surface}"]*0.5*(1.0 + GLAZE)
