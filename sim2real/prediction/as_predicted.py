"""A record as the model predicts it, step by step: time courses made of that do not know what comes later."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.prediction.kalman import Gain
from sim2real.prediction.predictor import innovations, stretch
from sim2real.prediction.readings import unread
from sim2real.records.channels import FED_BACK, MEASURED
from sim2real.records.reconstruct import Reconstruction


def as_predicted(flight: Reconstruction, left: FloatArray, gain: Gain) -> Reconstruction:
    """The record with one-step predictions in the place of readings.

    A slow channel is predicted between its readings too, if the gain knows when these were: a line from one to the next
    knows the later one, and with it noise and gusts that nothing had told until then.

    Args:
        left: the model's innovations with that gain [N-1, channels].
    """
    told, blank = replace(flight, measured=predicted(flight, left)), unread(flight)
    if not (gain.along and blank.any()):
        return told
    measured = flight.measured.copy()
    measured[:, :FED_BACK][blank] = 0.0  # a reading that the gain does not believe
    filled = replace(flight, measured=measured)
    again = innovations(filled, flight.parameters, gain.K * (stretch(flight) / stretch(filled)), (),
                        gain.gusts.kind)[:, 0]
    throughout = replace(filled, measured=predicted(filled, again))
    return told.filled_as(throughout, [MEASURED[c] for c in np.flatnonzero(blank.any(axis=0))])


def predicted(flight: Reconstruction, left: FloatArray) -> FloatArray:
    """One-step predictions of the channels [N, channels].

    They carry no noise of the sample they belong to, so that time courses made of them cannot fit that noise.
    """
    out = flight.measured.copy()
    out[1:] -= left
    out[0] = out[1]
    return out
