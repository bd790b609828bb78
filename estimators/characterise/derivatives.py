"""Lift and pitch derivatives from the evidence, in the form of an observer's estimate.

The evidence takes the gust's way to the tail, and that of the downwash, out of the pitching moment before it is
regressed, so that turbulence tells where it biases an observer: on autopilot, without a doublet, at sigma_w of 0.5 to
2 m/s the departures scatter by 0.01 to 0.04 (docs/controllers.md). What instruments' lags leave is the same with ice
and without, and is taken from here where the aircraft has no clean reference of its own.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.characterise.features import PRIOR, departures
from estimators.observer.rows import GAS_CONSTANT

FloatArray = NDArray[np.float64]
TOLD = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_elevator")
USUAL = {"CL_alpha": 0.0, "Cm_alpha": 0.06, "Cm_q": 0.06, "Cm_elevator": 0.05}  # clean, sigma_w 0 to 2 m/s, measured
SEEN = 10.0  # s of samples before anything is told (assumed: some periods of the short period and of gusts)
GOOD = 0.1  # relative standard error up to which an axis counts as excited


def derivatives(evidence: NDArray[np.void], measurement: NDArray[Any], clean: NDArray[np.void]
                ) -> tuple[dict[str, FloatArray], dict[str, FloatArray], NDArray[np.bool_]]:  # fmt: skip
    """Quasi-steady derivatives of every aircraft.

    Args:
        evidence: EVIDENCE rows [n].
        measurement: MEASUREMENT rows [n]; pressure and temperature are read.
        clean: CLEAN, one row or n.

    Returns:
        Values and standard errors by name of TOLD [n], and where they are good [n].
    """
    found, doubt = departures(evidence)
    slope = clean["CX_0"] - clean["CZ_alpha"]
    share = {name: 1.0 + found[name] - USUAL[name] for name in TOLD}
    density = measurement["pressure"]/(GAS_CONSTANT*measurement["temperature"])
    mass = density*clean["wing_area"]*clean["chord"]/4.0
    lag = clean["Cm_alphadot"]*mass/clean["mass"]
    inertia = 1.0 + clean["Cm_alphadot"]*mass*clean["chord"]*clean["tail_arm"]/clean["inertia_yy"]
    # the downwash lag as an identifier without one finds it (Etkin & Reid, Dynamics of Flight, 3rd ed., section 5.5)
    values = {
        "CL_alpha": slope*share["CL_alpha"],
        "Cm_alpha": (clean["Cm_alpha"]*share["Cm_alpha"] - lag*slope*share["CL_alpha"])/inertia,
        "Cm_q": (clean["Cm_q"]*share["Cm_q"] + lag*clean["CZ_q"])/inertia,
        "Cm_elevator": clean["Cm_elevator"]*share["Cm_elevator"]/inertia,
    }
    std = {name: np.abs(values[name])*PRIOR*doubt[name] for name in TOLD}
    good = (evidence["weight"] > SEEN) & np.all([PRIOR*doubt[name] < GOOD for name in TOLD], axis=0)
    return values, std, good & np.all([np.isfinite(values[name]) for name in TOLD], axis=0)
