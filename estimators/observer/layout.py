"""Order of the parameters in every observer's memory, and the fields that all of those memories begin with."""

from __future__ import annotations

import numpy as np

from estimators.airframe import airframe_from

CHANNELS = ("drag", "lift", "pitch", "side", "roll", "yaw")

# Channel by channel. Those of ESTIMATED_NAMES and two more.
PARAMETER_NAMES = (
    "CD_0",
    "CL_0", "CL_alpha", "CL_q", "CL_elevator",
    "Cm_0", "Cm_alpha", "Cm_q", "Cm_elevator",
    "CY_0", "CY_beta", "CY_p", "CY_r", "CY_rudder",
    "Cl_0", "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder",
    "Cn_0", "Cn_beta", "Cn_p", "Cn_r", "Cn_aileron", "Cn_rudder",
)  # fmt: skip

# First parameter and number of parameters of each channel, first element of its packed covariance.
FIRST = (0, 1, 5, 9, 14, 20)
COUNT = (1, 4, 4, 5, 6, 6)
PACKED = (0, 1, 11, 21, 36, 57)
ACCELEROMETER = (0, 1, -1, 2, -1, -1)  # which accelerometer serves the channel
DIAGONAL = tuple(PACKED[c] + i * (i + 1) // 2 + i for c in range(6) for i in range(COUNT[c]))

SEEN = [
    ("theta", "f8", (26,)),  # estimates, in the order of PARAMETER_NAMES
    ("deviation", "f8", (26,)),  # what the method itself holds for their standard deviations
    ("scale", "f8", (26,)),  # size of each parameter, to normalise by
    ("bandwidth", "f8", (6,)),  # of the matched filters, rad/s
    ("filtered", "f8", (26,)),  # the regressors behind the matched filter
    ("zeta", "f8", (6,)),  # the rest of the dynamics behind the same filter
    ("row", "f8", (26,)), ("row_before", "f8", (26,)),  # regressors now and a sample ago
    ("rest", "f8", (6,)), ("rest_before", "f8", (6,)),  # what else moves the states, now and a sample ago
    ("y", "f8", (6,)), ("y_before", "f8", (6,)),  # measured states now and a sample ago
    ("felt", "f8", (3,)), ("felt_before", "f8", (3,)), ("factor", "f8", (3,)),  # from the accelerometers: rows.py
    ("felt_filtered", "f8", (3,)),  # `felt` behind the matched filter
    ("mean", "f8", (7,)), ("energy", "f8", (7,)),  # of the excitation measures
    ("excess_drag", "f8"),
    ("seated", "f8"),  # 0: the next readable sample starts the filters
    ("failed", "f8"),  # 1: a matrix lost its positive definiteness; estimates are held from then on
]  # fmt: skip
SEEN_NAMES = tuple(str(field[0]) for field in SEEN)


def clean_values(airframe: np.ndarray) -> np.ndarray:
    """Coefficients of the clean aircraft in the order of PARAMETER_NAMES, shape (rows, 26).

    From the body-axis set: CL_0 = -CZ_0, CL_alpha = CX_0 - CZ_alpha (slope at alpha = 0), CL_elevator = -CZ_elevator.
    """
    af = airframe_from(airframe)
    alpha = af["CZ_0"] / (af["CX_0"] - af["CZ_alpha"])
    drag = -(af["CX_0"] + alpha * (af["CX_alpha"] + alpha * af["CX_alpha2"])) / np.cos(alpha)
    own = {
        "CD_0": drag, "CL_0": -af["CZ_0"], "CL_alpha": af["CX_0"] - af["CZ_alpha"],
        "CL_q": -af["CZ_q"], "CL_elevator": -af["CZ_elevator"],
    }  # fmt: skip
    zero = np.zeros(len(af))
    names = af.dtype.names or ()
    return np.stack([own.get(n, af[n] if n in names else zero) for n in PARAMETER_NAMES], axis=1)


def seat(
    memory: np.ndarray, airframe: np.ndarray, tuning: np.ndarray, bandwidth: np.ndarray, start: float
) -> np.ndarray:
    """Fill the shared fields of `memory` (n,): estimates at `start` times the clean aircraft, and their spread.

    tuning: one row with `smallest_scale` (26,) and `q0` (one, or six). bandwidth: (6,) rad/s. The prior's standard
    deviation is scale/sqrt(q0). Returns it, shape (n, 26).
    """
    clean = clean_values(airframe)
    memory["theta"] = start * clean
    memory["scale"] = np.maximum(np.abs(clean), tuning["smallest_scale"][0])
    memory["bandwidth"] = bandwidth
    weight = np.repeat(np.broadcast_to(tuning["q0"][0], 6), COUNT)
    memory["deviation"] = memory["scale"] / np.sqrt(weight)
    return np.asarray(memory["deviation"].copy())
