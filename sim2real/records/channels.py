"""Channels that a diagnosis compares, their tolerances (the unit of a gap) and the least noise assumed on them.

Tolerances: 14 CFR Part 60, Appendix A, Table A2A where an objective test exists (airspeed, theta, rates, phi, psi,
beta, az, altitude), else assumed (alpha, ay, ax).
"""

from __future__ import annotations

import math

DEG, G0 = math.pi / 180.0, 9.80665
TOLERANCE: dict[str, float] = {
    "airspeed": 1.54, "alpha": DEG, "beta": DEG, "p": 2.0 * DEG, "q": 2.0 * DEG, "r": 2.0 * DEG,
    "phi": 2.0 * DEG, "theta": 1.5 * DEG, "psi": 2.0 * DEG, "ax": 0.02 * G0, "ay": 0.05 * G0, "az": 0.10 * G0,
    "altitude": 30.5,
}  # fmt: skip
MEASURED = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az", "altitude",
            "thrust_left", "thrust_right")  # fmt: skip
FED_BACK = 12  # of MEASURED: what corrects the predictor's state; thrust is compared only
LATERAL = ("beta", "p", "r", "phi", "ay")
# Smallest standard deviation believed of a channel's noise (assumed: a tenth of ordinary instruments').
NOISE_FLOOR: dict[str, float] = {
    "airspeed": 0.03, "alpha": 2e-4, "beta": 2e-4, "p": 2e-4, "q": 2e-4, "r": 2e-4, "phi": 2e-4, "theta": 2e-4,
    "ax": 0.005, "ay": 0.005, "az": 0.005, "altitude": 0.2, "thrust_left": 15.0, "thrust_right": 15.0,
}  # fmt: skip
SURFACES = ("elevator", "aileron", "rudder")
SURFACE_NOISE = 7.6e-4  # rad, of recorded positions: 0.03 deg (configs/instruments), 1.46 times that unfiltered
