"""How far the recorded flight lies from the same flight without the effect, in tolerances and in noise and gust."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere.flight import DT, PREROLL, WINDOW
from testbed.elsewhere.hooks import Channels
from testbed.elsewhere.sensors import NOISE

DEG = np.pi / 180.0
G = 9.80665
TOLERANCE = {"airspeed": 1.54, "theta": 1.5 * DEG, "p": 2 * DEG, "q": 2 * DEG, "r": 2 * DEG, "phi": 2 * DEG,
             "psi": 2 * DEG, "beta": DEG, "alpha": DEG, "az": 0.10 * G, "ay": 0.05 * G, "ax": 0.02 * G,
             "altitude": 30.5}  # as docs/diagnosis.md has them: 14 CFR Part 60 and the like
SURFACES = ("elevator", "aileron", "rudder")
BIN = 0.5  # s, parts a difference into slow (means over this) and quick (what bends within)
GUST_CORRELATION = 2.0  # s, gust response counts as one sample in this time
QUICK_CORRELATION = 0.4  # s, the same for its quick part


def _recorded(channels: Channels, rows: Sequence[int]) -> Channels:
    start = round(PREROLL / DT)
    return {k: channels[k][rows, start:] for k in (*TOLERANCE, *SURFACES)}


def _bins(values: NDArray, width: int) -> NDArray:
    usable = values.shape[1] // width * width
    return np.asarray(values[:, :usable].reshape(values.shape[0], -1, width).mean(-1))


def _detrended(values: NDArray, width: int) -> NDArray:
    """What is left in each stretch of `width` samples after a level and a slope of its own."""
    count = values.shape[1] // width
    cut = values[:, : count * width].reshape(values.shape[0], count, width)
    basis = np.linalg.qr(np.stack([np.ones(width), np.arange(width)], 1))[0]
    return np.asarray(cut - cut @ basis @ basis.T)


def compare(groups: Sequence[Channels], other: int, rows: Sequence[int], noise: float, rate: int) -> dict[str, Any]:
    """Distances over the records `rows` between group 0 of `flight` and group `other`, noise-free channels of each.

    Returns e_c (RMS difference / tolerance), f_gust (the same between groups 1 and 2), the root mean square of
    e_c, the whitened distance, and that distance after a level and slope per window and channel are given away.
    """
    real, twin, blown, calm = (_recorded(groups[g], rows) for g in (0, other, 1, 2))
    width, per_bin = round(BIN / DT), BIN * rate
    error: dict[str, float] = {}
    gusty: dict[str, float] = {}
    whole, free = 0.0, 0.0
    for name in (*TOLERANCE, *SURFACES):
        gap, gust = real[name] - twin[name], blown[name] - calm[name]
        variance = (NOISE[name] * noise) ** 2 / per_bin + GUST_CORRELATION / BIN * (gust**2).mean()
        bins = _bins(gap, width)
        fast = rate * DT * (_detrended(gap, width) ** 2).sum()
        fast /= (NOISE[name] * noise) ** 2 + QUICK_CORRELATION * rate * (_detrended(gust, width) ** 2).mean()
        whole += float((bins**2).sum() / variance + fast)
        free += float((_detrended(bins, round(WINDOW / BIN)) ** 2).sum() / variance + fast)
        if name in TOLERANCE:
            error[name] = float(np.sqrt((gap**2).mean()) / TOLERANCE[name])
            gusty[name] = float(np.sqrt((gust**2).mean()) / TOLERANCE[name])
    gap = float(np.sqrt(np.mean(np.square(list(error.values())))))
    return {"rms_in_tolerances": error, "gust_rms_in_tolerances": gusty, "gap": gap,
            "whitened_distance": whole**0.5, "whitened_distance_without_level_and_slope": free**0.5}
