"""What one H-infinity observer remembers, and how it starts."""

from __future__ import annotations

import numpy as np

from estimators.airframe import airframe_from
from estimators.hinf.rows import PARAMETER_NAMES

# First parameter and number of parameters of each channel in PARAMETER_NAMES, first element of its packed B3.
FIRST = (0, 1, 5, 9, 14, 20)
COUNT = (1, 4, 4, 5, 6, 6)
PACKED = (0, 1, 11, 21, 36, 57)
ACCELEROMETER = (0, 1, -1, 2, -1, -1)  # which accelerometer serves the channel
DIAGONAL = tuple(PACKED[c] + i * (i + 1) // 2 + i for c in range(6) for i in range(COUNT[c]))

OBSERVER = np.dtype([
    ("theta", "f8", (26,)),  # estimates, in the order of PARAMETER_NAMES
    ("b3", "f8", (78,)),  # their covariance: lower triangles of the six channels
    ("scale", "f8", (26,)),  # size of each parameter, for q0 and k0
    ("filtered", "f8", (26,)),  # f, the regressors behind the observer's filter
    ("zeta", "f8", (6,)),  # the rest of the dynamics behind the same filter
    ("row", "f8", (26,)), ("row_before", "f8", (26,)),  # regressors now and a sample ago
    ("rest", "f8", (6,)), ("rest_before", "f8", (6,)),  # b now and a sample ago
    ("y", "f8", (6,)), ("y_before", "f8", (6,)),  # measured states now and a sample ago
    ("felt", "f8", (3,)), ("felt_before", "f8", (3,)), ("factor", "f8", (3,)),  # from the accelerometers, see hinf_rows
    ("felt_filtered", "f8", (3,)),  # `felt` behind the observer's filter
    ("gain", "f8", (6,)), ("deviation", "f8", (26,)),  # scratch; standard errors
    ("mean", "f8", (7,)), ("energy", "f8", (7,)),  # of the excitation measures
    ("excess_drag", "f8"),
    ("seated", "f8"),  # 0: the next readable sample starts the filters
    ("failed", "f8"),  # 1: a matrix lost its positive definiteness; estimates are held from then on
])  # fmt: skip


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


def init(parameters: np.ndarray, tuning: np.ndarray, n: int, start: float = 1.0) -> np.ndarray:
    """Memory of `n` observers that start at `start` times the clean aircraft (`OBSERVER` array).

    parameters: structured array with the fields of AIRFRAME, one row or n rows. tuning: `TUNING` array of one row.
    """
    clean = clean_values(parameters)
    observer = np.zeros(n, OBSERVER)
    observer["theta"] = start * clean
    observer["scale"] = np.maximum(np.abs(clean), tuning["smallest_scale"][0])
    for channel in range(6):
        for i in range(COUNT[channel]):
            diagonal = PACKED[channel] + i * (i + 1) // 2 + i
            observer["b3"][:, diagonal] = observer["scale"][:, FIRST[channel] + i] ** 2 / tuning["q0"][0, channel]
    return observer
