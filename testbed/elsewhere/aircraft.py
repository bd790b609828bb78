"""The aircraft: geometry, mass, published derivatives and their spread from source to source.

Signs: body axes x forward, y right, z down; positive elevator pitches down, positive aileron rolls left,
positive rudder yaws left. Derivatives per rad; rates normalised with c/2V (q) and b/2V (p, r).
Sources: FlightGear's UIUC model (Aircraft-uiuc/TwinOtter/aircraft.dat; Pokhariyal, Merret, 2000); what was identified
from NASA's flight records of 13-14 February 2002 (Klein & Morelli's output error and least squares); masses and
inertias of those records.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FOOT, SLUG = 0.3048, 14.593903
SLUG_FT2 = SLUG * FOOT**2
AREA, SPAN, CHORD = 420.0 * FOOT**2, 65.0 * FOOT, 6.5 * FOOT
ENGINE_ARM = 109.3 * 0.0254  # m, lateral distance of each propeller axis from the plane of symmetry
GRAVITY = 9.80665  # m/s2

# name: (published value, standard deviation of the truth about it).
PUBLISHED = {
    "CX0": (-0.0488, 0.0025), "CXa": (0.223, 0.015), "CXa2": (1.659, 0.10),
    "CZ0": (-0.360, 0.012), "CZa": (-5.660, 0.28), "CZq": (-19.97, 2.0), "CZde": (-0.608, 0.06),
    "Cm0": (0.040, 0.004), "Cma": (-1.310, 0.066), "Cmq": (-34.2, 1.9), "Cmde": (-1.740, 0.087),
    "CYb": (-0.60, 0.03), "CYp": (-0.20, 0.03), "CYr": (0.40, 0.04), "CYdr": (0.15, 0.015),
    "Clb": (-0.080, 0.005), "Clp": (-0.50, 0.027), "Clr": (0.060, 0.012), "Clda": (-0.150, 0.0075),
    "Cldr": (0.015, 0.004), "Cnb": (0.100, 0.005), "Cnp": (-0.060, 0.009), "Cnr": (-0.180, 0.009),
    "Cnda": (-0.001, 0.002), "Cndr": (-0.125, 0.00625),
}
# What NASA's flight records say where it differs much from the set above: output error, then least squares.
FLIGHT = {
    "CZa": -6.35, "CZq": -18.4, "CZde": -0.626, "Cma": -1.476, "Cmq": -36.4, "Cmde": -1.869,
    "CYb": -0.8646, "CYr": 0.9331, "CYdr": 0.380, "Clb": -0.1196, "Clp": -0.5859, "Clr": 0.1889,
    "Clda": -0.2282, "Cldr": 0.0422, "Cnb": 0.08638, "Cnp": -0.06441, "Cnr": -0.19059, "Cnda": -0.00298,
    "Cndr": -0.13548,
}
CENTRES = ("uiuc", "flight")
# (mass, Ixx, Iyy, Izz, Ixz) with little and with much fuel, slug and slug-ft2 (flight records).
LIGHT = np.array([323.03, 19131.2, 23859.5, 36564.2, 1119.8]) * [SLUG, SLUG_FT2, SLUG_FT2, SLUG_FT2, SLUG_FT2]
HEAVY = np.array([340.09, 20913.0, 24281.0, 38487.0, 1128.0]) * [SLUG, SLUG_FT2, SLUG_FT2, SLUG_FT2, SLUG_FT2]


@dataclass(frozen=True)
class Loading:
    """Mass in kg and inertia (xx, yy, zz, xz) in kg m2, Ixz = + integral of x z dm."""

    mass: float
    inertia: NDArray

    @classmethod
    def with_fuel(cls, fraction: float) -> Loading:
        """Loading between the two published ones, `fraction` from 0 (light) to 1 (heavy)."""
        mix = LIGHT + fraction * (HEAVY - LIGHT)
        return cls(float(mix[0]), mix[1:])


def derivatives(rng: np.random.Generator | None = None, centre: str = "uiuc") -> dict[str, float]:
    """Derivatives by name: the published ones, or (with `rng`) one aircraft drawn from their spread, cut at 2 sd."""
    drawn = {}
    for name, (value, spread) in PUBLISHED.items():
        scale = 1.0
        if centre == "flight" and name in FLIGHT:
            scale = abs(FLIGHT[name] / value) if name != "Cnda" else 1.0
            value = FLIGHT[name]
        step = 0.0 if rng is None else float(np.clip(rng.standard_normal(), -2.0, 2.0))
        drawn[name] = value + step * spread * scale
    return drawn
