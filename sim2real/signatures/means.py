"""A channel's mean over a flight, where flights without a gap have shown that it is worth less than its changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from icing_env.record import FloatArray
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction


class Means:
    """Whitened rows of one record without most of every such channel's mean, as if its prior were as wide.

    Rows come in pieces of time; what has to be taken from them and from their inner products is told afterwards.
    """

    def __init__(self, flight: Reconstruction, first: int) -> None:
        """Args: flight: the record; first: steps that are left out at the start."""
        kept = np.array([flight.inadequacy.means.get(name, 1.0) for name in MEASURED]) ** -0.5
        self.share, self.told = 1.0 - kept, bool(flight.inadequacy.means)
        self.there = np.isfinite(flight.measured[1 + first :])
        self.total = np.zeros((len(MEASURED), 0))

    def take(self, rows: FloatArray, since: int = 0) -> None:
        """Rows [samples x channels, rows] from sample `since` on."""
        if not self.told:
            return
        by_channel = rows.reshape(-1, len(MEASURED), rows.shape[1])
        there = self.there[since : since + len(by_channel)]
        found = np.einsum("kcr,kc->cr", by_channel, there)
        self.total = found if not self.total.size else self.total + found

    def energy(self) -> FloatArray:
        """What their inner products lose [rows, rows]."""
        lost = (1.0 - (1.0 - self.share) ** 2) / np.maximum(self.there.sum(axis=0), 1)
        return np.asarray(self.total.T @ (lost[:, None] * self.total))

    def over_time(self, rows: Sequence[int]) -> FloatArray:
        """What some of the rows lose [samples x channels, rows]."""
        lost = (self.share / np.maximum(self.there.sum(axis=0), 1))[:, None] * self.total[:, list(rows)]
        return np.asarray((self.there[:, :, None] * lost).reshape(self.there.size, len(rows)))


def without_means(rows: FloatArray, flight: Reconstruction, first: int) -> FloatArray:
    """Rows [samples x channels, rows] of a whole record less what they lose."""
    means = Means(flight, first)
    means.take(rows)
    return rows - means.over_time(range(rows.shape[1])) if means.told else rows
