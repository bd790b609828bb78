"""Aerodynamic coefficients in body axes from the published derivatives: linear but for CX, quadratic in alpha."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.aircraft import CHORD, SPAN


def coefficients(d: Mapping[str, Any], alpha: NDArray, beta: NDArray, speed: NDArray, rates: NDArray,
                 surfaces: NDArray) -> NDArray:
    """CX, CY, CZ, Cl, Cm, Cn (6, n). `rates` relative to the air in rad/s; `surfaces` elevator, aileron, rudder."""
    p = rates[0] * SPAN / (2.0 * speed)
    q = rates[1] * CHORD / (2.0 * speed)
    r = rates[2] * SPAN / (2.0 * speed)
    de, da, dr = surfaces
    return np.stack([
        d["CX0"] + (d["CXa"] + d["CXa2"] * alpha) * alpha,
        d["CYb"] * beta + d["CYp"] * p + d["CYr"] * r + d["CYdr"] * dr,
        d["CZ0"] + d["CZa"] * alpha + d["CZq"] * q + d["CZde"] * de,
        d["Clb"] * beta + d["Clp"] * p + d["Clr"] * r + d["Clda"] * da + d["Cldr"] * dr,
        d["Cm0"] + d["Cma"] * alpha + d["Cmq"] * q + d["Cmde"] * de,
        d["Cnb"] * beta + d["Cnp"] * p + d["Cnr"] * r + d["Cnda"] * da + d["Cndr"] * dr,
    ])
