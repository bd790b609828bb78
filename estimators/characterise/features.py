"""The numbers by which ice is judged, from the evidence and an observer's ESTIMATE row; no truth, no class.

Relative departures d of a derivative from its clean value come from the normal equations with a prior of zero mean and
PRIOR standard deviation (ridge regression, Hoerl & Kennard 1970, as a Bayesian posterior): what a window cannot show
stays zero, and the posterior's standard deviation over PRIOR (`doubt`, 0..1) stands beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.characterise.evidence import LIFT, PITCH, ROLL, SHIFTS, SIZES
from estimators.observer.layout import clean_values
from icing_env.errors import InputError

FloatArray = NDArray[np.float64]
PRIOR = 0.3  # relative: severe ice takes 0.3 of a derivative (UIUC factors at eta 0.2)
COLOUR = 8.0  # samples that one independent residual lasts behind the low pass: 2/(RATE dt) at 50 Hz
CHOSEN = {  # channel: index of the unknown by name
    LIFT: {"CL_alpha": 1, "CL_elevator": 3},
    PITCH: {"Cm_alpha": 1, "Cm_q": 2, "Cm_elevator": 3},
    ROLL: {"Cl_beta": 1, "Cl_p": 2, "Cl_aileron": 4},
}
DEPARTURES = tuple(name for names in CHOSEN.values() for name in names)
OBSERVED = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_elevator")  # of the ESTIMATE row
SHIFT_SCALE = {"CX": 0.01, "CZ": 0.05, "Cm": 0.01, "Cl": 0.003, "Cn": 0.001, "propeller_left": 0.05,
               "propeller_right": 0.05, "hinge": 0.01}  # size of each shift in moderate ice
FEATURES = (
    *(f"shift_{name}" for name in SHIFTS),
    *(f"d_{name}" for name in DEPARTURES),
    *(f"observer_{name}" for name in OBSERVED), "observer_excess_drag",
    *(f"doubt_{name}" for name in DEPARTURES),
    "excitation_longitudinal", "excitation_lateral", "moved_elevator", "moved_aileron",
    "gust", "lift", "airspeed", "age", "asymmetry",
)  # fmt: skip
OFFSET = len(SHIFTS) + len(DEPARTURES) + len(OBSERVED) + 1  # features that an aircraft's own clean flight is taken from
STEEP = 0.2  # in units of `lift`: below 0.01 rad of incidence the wings cannot be told apart (assumed)
GUST_PART = 0.51  # r.m.s. share of a Dryden gust that `evidence` passes: measured, 1 to 4 m/s at 72 m/s


def departures(evidence: NDArray[np.void]) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Relative departure of every chosen derivative, and its doubt (posterior standard deviation over PRIOR), each [n].

    Negative: the derivative has lost size.
    """
    found, doubt = {}, {}
    for channel, names in CHOSEN.items():
        m = SIZES[channel]
        matrix, vector = evidence["matrix"][:, channel, :m, :m], evidence["vector"][:, channel, :m]
        scale = np.maximum(evidence["weight"], 1e-6)
        # the ridge of the first pass only keeps a matrix without excitation regular
        first = np.linalg.solve(matrix + 1e-9*np.eye(m), vector[..., None])[..., 0]
        left = evidence["square"][:, channel] - np.einsum("ni,ni->n", first, vector)
        noise = np.maximum(left/scale, 1e-10)*COLOUR*0.02
        informed = matrix/noise[:, None, None] + np.eye(m)/PRIOR**2
        d = np.linalg.solve(informed, vector[..., None]/noise[:, None, None])[..., 0]
        spread = np.sqrt(np.diagonal(np.linalg.inv(informed), axis1=1, axis2=2))/PRIOR
        for name, i in names.items():
            found[name], doubt[name] = np.clip(d[:, i], -1.0, 1.0), spread[:, i]
    return found, doubt


def gust_intensity(evidence: NDArray[np.void]) -> FloatArray:
    """Standard deviation of the vertical gust that was met [n], m/s."""
    noise = 0.13  # m/s: a vane's 0.1 deg at 72 m/s
    return np.sqrt(np.maximum(evidence["gust_energy"] - noise**2, 0.0))/GUST_PART


def features(evidence: NDArray[np.void], estimate: NDArray[Any], clean: NDArray[np.void]) -> FloatArray:
    """All FEATURES of every aircraft.

    Args:
        evidence: EVIDENCE rows [n].
        estimate: ESTIMATE rows [n] of any recursive observer.
        clean: CLEAN, one row or n.

    Returns:
        [n, len(FEATURES)], each of the order of one in moderate ice.
    """
    n = len(evidence)
    found, doubt = departures(evidence)
    values = {f"shift_{name}": evidence["shift"][:, i]/SHIFT_SCALE[name] for i, name in enumerate(SHIFTS)}
    values |= {f"d_{name}": d/0.1 for name, d in found.items()}
    reference = {name: clean[name] for name in OBSERVED if name != "CL_alpha"}
    reference["CL_alpha"] = clean["CX_0"] - clean["CZ_alpha"]
    values |= {f"observer_{name}": np.clip(estimate[name]/reference[name] - 1.0, -1.0, 1.0)/0.1 for name in OBSERVED}
    zero = clean_values(clean)[:, 0]
    values["observer_excess_drag"] = (estimate["CD_0"] - zero)/0.01
    values |= {f"doubt_{name}": d for name, d in doubt.items()}
    for axis in ("longitudinal", "lateral"):
        values[f"excitation_{axis}"] = estimate[f"excitation_{axis}"]
    values["moved_elevator"] = np.sqrt(evidence["moved"][:, 0])/0.02
    values["moved_aileron"] = np.sqrt(evidence["moved"][:, 1])/0.02
    values["gust"] = np.log1p(gust_intensity(evidence))
    values["lift"] = evidence["alpha"]/0.05
    values["airspeed"] = (evidence["airspeed"] - 70.0)/10.0
    values["age"] = np.minimum(evidence["weight"], 60.0)/60.0
    values["asymmetry"] = np.zeros(n)
    return with_asymmetry(np.stack([np.broadcast_to(values[name], n) for name in FEATURES], axis=1))


def with_asymmetry(values: FloatArray) -> FloatArray:
    """Fill `asymmetry` in place: rolling moment per lift, which a difference of lift slope between the wings makes.

    Least squares of Cl = a alpha with a prior: at small alpha a difference of slope cannot show. Returns `values`.
    """
    roll, lift = values[..., FEATURES.index("shift_Cl")], values[..., FEATURES.index("lift")]
    values[..., FEATURES.index("asymmetry")] = roll*lift/(lift*lift + STEEP**2)
    return values


def offset_of(reference: FloatArray) -> FloatArray:
    """What an aircraft's own clean flight shows [n, OFFSET], to be taken from what it shows later.

    Args:
        reference: features of clean windows [n, features].

    Raises:
        InputError: features of another length.
    """
    if reference.shape[-1] != len(FEATURES):
        raise InputError(f"reference has {reference.shape[-1]} features, must have {len(FEATURES)}")
    return reference[..., :OFFSET].copy()


def against(values: FloatArray, offset: FloatArray) -> FloatArray:
    """Features less an aircraft's own clean offset [n, features]; doubts and conditions stay as they are."""
    out = values.copy()
    out[..., :OFFSET] -= offset
    return with_asymmetry(out)
