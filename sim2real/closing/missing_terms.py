"""What a user's simulator lacks in each force and moment coefficient, and the regressors that describe it.

Equation-error form: the simulator is restarted along the record, and its accelerations are compared with those
measured (Klein & Morelli, Aircraft System Identification, chapter 5; the paper's own tool).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.regression.stepwise import Stepwise, stepwise
from icing_env.record import FlightRecord, FloatArray
from sim2real.prediction.windows import COMPARED, FREE
from sim2real.records.channels import MEASURED, SURFACES
from sim2real.records.reconstruct import reconstruct
from sim2real.rollout import Rollout, as_coefficients, fly_yours

HORIZON, MOST = 0.1, 600  # s flown after each restart, and how many restarts at most
REGRESSORS = {
    "CX": ("alpha", "alpha*alpha", "airspeed", "elevator"), "CZ": ("alpha", "q", "elevator", "alpha*alpha"),
    "Cm": ("alpha", "q", "elevator", "alpha*alpha", "airspeed"), "CY": ("beta", "p", "r", "rudder"),
    "Cl": ("beta", "p", "r", "aileron", "rudder"), "Cn": ("beta", "p", "r", "aileron", "rudder"),
}  # fmt: skip


def residual_coefficients(rollout: Rollout, record: FlightRecord) -> dict[str, FloatArray]:
    """What your simulator lacks in CX, CY, CZ, Cl, Cm, Cn along a record, by restarting it at the measured state.

    Each restart flies 0.1 s; the mean specific force and the change of the rates over that time are compared with those
    measured. Moments are the inertia matrix times the difference of angular accelerations: at the same state and rates
    everything else is equal. What the motion has answered by then makes them a tenth too small where damping is strong.

    Returns:
        time, the coefficients, and the regressors' channels as means over the 0.1 s, each (M,); M at most 600.
    """
    flight = reconstruct(record)
    steps = max(1, round(HORIZON / flight.dt))
    last = len(flight.time) - steps - 1
    at = np.arange(0, last + 1, max(1, -(-last // MOST)))
    measured = {name: flight.channel(name) for name in MEASURED[:11]}
    lacking = np.empty((len(at), 6))
    means: dict[str, list[float]] = {name: [] for name in (*MEASURED[:8], *SURFACES)}
    for i, k in enumerate(at):
        start, after = np.array([measured[name][k] for name in FREE]), slice(k + 1, k + steps + 1)
        told = fly_yours(rollout, flight, int(k), start, steps)
        for j, name in enumerate(("ax", "ay", "az")):
            lacking[i, j] = np.mean(measured[name][after] - told[:, COMPARED.index(name)])
        for j, name in enumerate("pqr", start=3):
            lacking[i, j] = (measured[name][k + steps] - told[-1, COMPARED.index(name)]) / (steps * flight.dt)
        for name, kept in means.items():
            kept.append(float(np.mean((flight.controls if name in SURFACES else measured)[name][after])))
    channels = {name: np.array(kept) for name, kept in means.items()}
    return {"time": flight.time[at]} | as_coefficients(lacking, flight, channels["airspeed"]) | channels


def missing_terms(residual: Mapping[str, FloatArray]) -> dict[str, Stepwise]:
    """Regressors (deviations from their mean) that describe what is missing, by coefficient, as stepwise finds them."""
    out = {}
    for name, terms in REGRESSORS.items():
        if name not in residual:
            continue
        away = {f: residual[f] - np.mean(residual[f]) for term in terms for f in term.split("*")}
        candidates = {term: np.prod([away[f] for f in term.split("*")], axis=0) for term in terms}
        out[name] = stepwise(candidates, residual[name])
    return out
