"""Data compatibility as the founding paper used it: every manoeuvre gets its scale factor of alpha, in still air.

`estimators.compatibility` drops an error that a record cannot show, and can carry gusts as states. The paper's chain
did neither: biases and the scale factor come out of every doublet set, and what gusts do to the vane lands in them (its
figure 20). Output error on the kinematics; the free ones are biases of what drives the motion and the scale factor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from estimators.compatibility.kinematics import INPUTS, OUTPUTS, PARAMETERS, simulate
from estimators.likelihood.newton import fit
from estimators.signals.resample import common_grid
from icing_env.record import FlightRecord, FloatArray

FREE = ("airspeed_start", "alpha_start", "theta_start", "bias_ax", "bias_az", "bias_q", "scale_alpha")
SEEN = ("airspeed", "alpha", "theta")
STEP = {"airspeed_start": 0.05, "bias_ax": 1e-3, "bias_az": 1e-3}  # m/s, m/s2: of differences; the rest 1e-4


@dataclass(frozen=True)
class Calibrated:
    """A record without its scale factor of alpha, the factor (reading = (1 + scale) alpha) and its standard error."""

    record: FlightRecord
    scale: float
    std_error: float


def calibrate(record: FlightRecord) -> Calibrated:
    """Scale factor of alpha by output error on the kinematics, without wind, and the record corrected for it.

    Raises:
        InputError: the motion cannot be followed.
    """
    grid = common_grid(record)
    values = {name: grid.values.get(name, np.zeros(len(grid.time))) for name in (*INPUTS, *OUTPUTS)}
    inputs = np.column_stack([values[name] for name in INPUTS])
    measured = np.column_stack([values[name] for name in SEEN])
    row = np.zeros(len(PARAMETERS))
    row[:len(OUTPUTS)] = [np.median(values[name][:10]) for name in OUTPUTS]
    free, seen = [PARAMETERS.index(name) for name in FREE], [OUTPUTS.index(name) for name in SEEN]

    def outputs(thetas: FloatArray) -> FloatArray:
        rows = np.repeat(row[None], len(thetas), axis=0)
        rows[:, free] = thetas
        return simulate(rows, inputs, grid.dt)[:, :, seen]

    best = fit(outputs, row[free], measured, step=np.array([STEP.get(name, 1e-4) for name in FREE]))
    i = FREE.index("scale_alpha")
    scale = float(best.theta[i])
    channels = {name: record[name] for name in record.channels} | {"alpha": record["alpha"]/(1.0 + scale)}
    return Calibrated(replace(record, channels=channels), scale, float(best.std_error[i]))
