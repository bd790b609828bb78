"""Records flown abreast: rows of all of them fill the lanes of the compiled flight together.

A set of effects is two or three rows along every record. Along one record after another these leave most of the eight
lanes empty; the records put end to end, each row with its own first and last sample, fly in a third of the time and the
same to the bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from icing_env.lanes import LANES
from icing_env.parameters import as_bytes
from icing_env.record import FloatArray
from icing_env.simulate import Fleet
from sim2real.prediction.along import along
from sim2real.prediction.gusts import met
from sim2real.prediction.kalman import Gain
from sim2real.prediction.predictor import Push, held, listed, lost, put, spare, started, steered, stretch, substeps
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.side_by_side import each, threads


def end_to_end(rows: Sequence[NDArray]) -> NDArray:
    """Structured arrays of one kind as one."""
    return np.concatenate([as_bytes(own) for own in rows]).view(rows[0].dtype)


class Abreast:
    """Some records, each with a gain of its own, and the rows that are flown along them."""

    def __init__(self, flights: Sequence[Reconstruction], gains: Sequence[Gain]) -> None:
        self.flights = list(flights)
        order = sorted(range(len(self.flights)), key=lambda i: self.flights[i].dt)
        self.groups = [_EndToEnd([self.flights[i] for i in own], [gains[i] for i in own], own)
                       for own in (list(group) for _, group in groupby(order, key=lambda i: self.flights[i].dt))]

    def innovations(self, rows: Sequence[NDArray], pushes: Sequence[tuple[Push, ...]] = ()) -> list[FloatArray]:
        """Measured less predicted of every row [N-1, n, channels] of every record; nan where nothing was measured.

        Args:
            rows: PARAMETERS of every record's variants [n].
            pushes: generic discrepancies along every record; none if omitted.
        """
        found: list[FloatArray] = [np.zeros(0)] * len(self.flights)
        for group in self.groups:
            made = group.innovations([rows[i] for i in group.own], [pushes[i] for i in group.own] if pushes else [])
            for i, left in zip(group.own, made, strict=True):
                found[i] = left
        return found


class _EndToEnd:
    """Records of one step, put end to end."""

    def __init__(self, flights: Sequence[Reconstruction], gains: Sequence[Gain], own: Sequence[int]) -> None:
        self.flights, self.own = flights, own
        self.first = np.cumsum([0, *(len(f.time) for f in flights)])
        self.controls = np.concatenate([steered(f) for f in flights])
        self.met = np.array([met(f) for f in flights])
        self.measured = np.concatenate([f.measured for f in flights])
        self.stretch = [stretch(f) for f in flights]
        still = [np.zeros((len(f.time), 6)) if f.known is None else f.known for f in flights]
        self.known = np.concatenate(still) if any(f.known is not None for f in flights) else np.zeros((0, 6))
        to_the_end = [np.minimum(np.arange(len(f.time)), len(g.K) - 1) for f, g in zip(flights, gains, strict=True)]
        K = np.concatenate([g.K[steps] for g, steps in zip(gains, to_the_end, strict=True)])
        self.gain = np.ascontiguousarray(np.swapaxes(K, 1, 2))[None]
        self.kinds = np.array([g.gusts.kind for g in gains], float)
        self.starts = [started(f, 0) for f in flights]

    def innovations(self, rows: Sequence[NDArray], pushes: Sequence[tuple[Push, ...]]) -> list[FloatArray]:
        counts = [len(own) for own in rows]
        dt, at = self.flights[0].dt, np.cumsum([0, *counts])
        of = np.repeat(np.arange(len(rows)), counts)
        of = np.concatenate([of, np.repeat(of[-1:], spare(len(of)))])
        everything = end_to_end([*rows, *[rows[-1][-1:]] * (len(of) - int(at[-1]))])
        variants = held(everything, dt)
        variants["turbulence_tail_delay"], variants["turbulence_rotation"] = self.kinds[of].T
        pushed = [replace(q, row=int(at[i]) + q.row, series=self._placed(i, q.series))
                  for i, some in enumerate(pushes) for q in some]  # fmt: skip
        out = np.concatenate(each(lambda part: self._flown(variants[part], of[part], part.start, pushed),
                                  _parts(len(of))), axis=1)  # fmt: skip
        return [lost(out[: len(f.time) - 1, at[i] : at[i + 1]], np.isfinite(f.measured[1:]))
                for i, f in enumerate(self.flights)]

    def _flown(self, variants: NDArray, of: NDArray[np.intp], first: int, pushes: Sequence[Push]) -> FloatArray:
        """Innovations [steps, rows, channels] of neighbouring rows, the first being `first`, along the records `of`."""
        dt, steps = self.flights[0].dt, max(len(f.time) for f in self.flights) - 1
        fleet = Fleet(variants, len(of), dt, substeps(dt))
        put(fleet, {name: np.array([start[name] for start in self.starts])[of] for name in self.starts[0]})
        forces, errors = listed([replace(q, row=q.row - first) for q in pushes
                                 if first <= q.row < first + len(of)], dt)  # fmt: skip
        out = np.empty((steps, len(of), len(MEASURED)))
        along(fleet.table(), self.controls, self.met[of], self.first[of], self.first[of + 1] - 1, self.measured,
              np.array(self.stretch)[of], self.gain, *forces, *errors, self.known, out)
        return out

    def _placed(self, i: int, series: FloatArray) -> FloatArray:
        """A series of the `i`-th record among those of all."""
        out = np.zeros(int(self.first[-1]))
        out[self.first[i] : self.first[i + 1]] = series
        return out


def _parts(count: int) -> list[slice]:
    """Rows in parts, one for every thread, all but the last of whole lanes."""
    size = LANES * -(-count // (LANES * threads()))
    return [slice(at, min(at + size, count)) for at in range(0, count, size)]
