"""Surfaces that are not where their commands put them, in whatever course of time: what a free course of a path is.

A hat about every second, as at forces and sensors, but of the recorded position behind its command. It follows what no
term does (a hidden interconnection, a pick-up that drifts), and lags not at all: they are over within a hat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from icing_env.record import FloatArray
from sim2real.actuators.paths import answered, believed, moving
from sim2real.library.knots import hats
from sim2real.library.terms import PATH_SIZE
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import Reconstruction


@dataclass(frozen=True)
class Wander:
    """Inner products of a path's hats [knots, knots], and with what the path leaves [knots], over noise."""

    inner: FloatArray
    onto: FloatArray


def wandering(flights: Sequence[Reconstruction], rows: Sequence[NDArray], first: int = 0) -> dict[str, Wander]:
    """Free courses of every surface's position behind its command, by component.

    Args:
        rows: one PARAMETERS row for each record.
        first: sample from which they count.
    """
    found = {}
    for surface in SURFACES:
        there = moving(flights, rows, surface)
        if there:
            inner, onto = zip(*(_of_record(f, row, surface, first) for f, row in there), strict=True)
            found[f"{surface}_path"] = Wander(block_diag(*inner), np.concatenate(onto))
    return found


def _of_record(flight: Reconstruction, row: NDArray, surface: str, first: int) -> tuple[FloatArray, FloatArray]:
    made, inner = flight.once(("hats", surface, first), lambda: _hats(flight, surface, first))
    left = believed(flight, surface, answered(flight, surface, row))[first:, 0]
    return inner, made.T @ left


def _hats(flight: Reconstruction, surface: str, first: int) -> tuple[FloatArray, FloatArray]:
    """What a path's hats take of what it leaves [N, knots], and their inner products."""
    still = np.zeros((len(flight.time), 1))
    course = PATH_SIZE["1"] * hats(flight)
    made = (believed(flight, surface, still) - believed(flight, surface, course))[first:]
    return made, made.T @ made
