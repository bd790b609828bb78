"""Channels that were recorded on few levels: how little they say between them.

Rounding errs by a uniform deviation, level/sqrt(12), and goes on erring so while a channel stands on one level. Its
samples then are not many readings but one, and no difference of them shows it: believed, a staircase of 10 ft is told
as an altimeter's course of time, or as another aircraft.
"""

from __future__ import annotations

import math

import numpy as np

from icing_env.record import FlightRecord, FloatArray

OFTEN = 1.1  # samples for which a channel stands on one level, from which on it counts as rounded (assumed)
LEVEL = 0.05  # quantile of what a rounded channel moves by, when it moves, that is one level
COARSE = 0.05  # share of a power that its levels are apart at the most (assumed)
SEVERAL = 17  # levels that a surface stands on, at the least: it may be moved to a few and held there


def rounding(samples: FloatArray, fewest: int = 1, most: float = math.inf) -> float:
    """Standard deviation of the white noise that says as little as a rounded channel leaves open; zero of others.

    Args:
        fewest: changes of level that make a channel rounded, and not one that stood still in between.
        most: by which levels are apart; what moves by more was moved.
    """
    samples = samples[np.isfinite(samples)]
    moves = np.abs(np.diff(samples))
    stands = np.diff(np.flatnonzero(np.concatenate(([True], moves > 0.0, [True]))))
    lasts = float(np.sum(stands**2)) / max(len(samples), 1)
    if lasts < OFTEN or len(stands) <= fewest:
        return 0.0
    level = float(np.quantile(moves[moves > 0.0], LEVEL))
    if level > most:
        return 0.0
    # on levels as far apart as the noise is large, a median of differences is one level or none: their mean square
    shown = math.sqrt(float(np.mean(np.diff(samples, 3) ** 2)) / 20.0) if len(samples) > SEVERAL else 0.0
    return max(level * math.sqrt(lasts / 12.0), shown)


def share_rounded(record: FlightRecord, name: str) -> float:
    """`rounding` of a power's channel over its usual size; zero where it was not recorded, or moved in large steps."""
    if not record.has(name):
        return 0.0
    usual = max(float(np.nanmedian(np.abs(record[name]))), 1e-9)
    return rounding(record[name], most=COARSE * usual) / usual
