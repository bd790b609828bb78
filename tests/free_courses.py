"""Free courses of time along a short record, beside a few of the model's numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FlightRecord
from sim2real.library.candidates import bank
from sim2real.posterior.any_course import course_fits
from sim2real.posterior.generic import UnknownFit
from sim2real.records.reconstruct import reconstruct
from sim2real.signatures.courses import Course, Courses
from sim2real.signatures.evidence import gather

NUISANCES = 4


def course_along(record: FlightRecord) -> Course:
    """Of a record, with the first NUISANCES numbers of the model uncertain and nothing else tried."""
    whole = bank()
    only = replace(whole, families=(), terms=(), nuisances=whole.nuisances[:NUISANCES], size=1 + NUISANCES)
    return Course(gather(reconstruct(record), only))


def fits_beside(course: Course, parts: Sequence[NDArray]) -> list[UnknownFit]:
    """Of what is left [N x channels, 1] and numbers that give way [N x channels, NUISANCES]."""
    rows = np.concatenate(parts, axis=1)
    gram = rows.T @ rows
    gram[1:, 1:] += np.eye(NUISANCES)
    return course_fits(Courses([course], 1.0), [parts], gram)
