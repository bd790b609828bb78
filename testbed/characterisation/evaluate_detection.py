"""How soon ice is found, how often it is found where there is none, and whether failed protection is recognised."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from estimators.characterise.model import KINDS, Model
from estimators.characterise.thresholds import load_thresholds
from testbed.characterisation.dataset import DRAG, SEEDS, SLOPE, TURBULENCE
from testbed.characterisation.listen import Heard, detected, listen

FloatArray = NDArray[np.float64]
ENCOUNTERS = ("stratiform", "cumuliform", "large_drops")
ALLOWED = 60.0  # s from the truth's crossing to detection
BEGUN = 0.002  # excess CD_0 from which ice has begun, against which onsets are scored


def crossings(heard: Heard) -> FloatArray:
    """Second at which ice first matters [n], nan where it never does while alive."""
    matters = ((heard.drag > DRAG) | (heard.lost > SLOPE)) & heard.alive
    return np.where(matters.any(axis=0), matters.argmax(axis=0), np.nan)


def first(believed: NDArray[np.bool_]) -> FloatArray:
    """Second of the first belief [n], nan if there is none."""
    return np.where(believed.any(axis=0), believed.argmax(axis=0), np.nan)


def delays(models: Mapping[str, dict[str, Model]], n: int, seconds: float, weights: Path | None,
           threads: int = 2) -> dict[str, Any]:
    """By rival and kind: share of crossings found within ALLOWED, delays, errors of the onset; light turbulence."""
    heard = [listen(name, TURBULENCE["light"], n, seconds, SEEDS["test_detection"] + 10 + k, models, threads)
             for k, name in enumerate(ENCOUNTERS)]
    found = {}
    for rival in models:
        for kind in KINDS:
            late, early, scored = [], [], []
            for one in heard:
                believed, onset = detected(one, (rival, kind), load_thresholds(rival, weights))
                cross, flown = crossings(one), one.alive.sum(axis=0)
                judged = np.isfinite(cross) & (cross + ALLOWED < flown)
                late.append((first(believed) - cross)[judged])
                begun = (one.drag > BEGUN).argmax(axis=0).astype(np.float64)
                early.append((onset - begun)[judged])
                scored.append(float(np.mean(late[-1] <= ALLOWED)) if judged.any() else float("nan"))
            delay, off = np.concatenate(late), np.concatenate(early)
            found[f"{rival}_{kind}"] = {
                "crossings": len(delay), "within_60_s": float(np.mean(delay <= ALLOWED)),  # nan: never found, late
                "median_delay_s": float(np.nanmedian(delay)), "p95_delay_s": _late(delay),
                "missed": int(np.isnan(delay).sum()), "onset_median_error_s": float(np.nanmedian(off)),
                "by_scenario": dict(zip(ENCOUNTERS, scored, strict=True))}
    return found


def _late(delay: FloatArray) -> float:
    """95th percentile, a missed one counting as infinitely late."""
    return float(np.quantile(np.where(np.isnan(delay), np.inf, delay), 0.95, method="higher"))


def false_alarms(models: Mapping[str, dict[str, Model]], hours: float, weights: Path | None, turbulence: str = "light",
                 threads: int = 2, block: float = 1200.0) -> dict[str, Any]:
    """Detections in clear air per 100 flight hours, with the exact 95 % upper bound of a Poisson count."""
    n = max(4, round(hours*3600.0/block))
    heard = listen("clear_air", TURBULENCE[turbulence], n, block, SEEDS["test_detection"], models, threads)
    flown = float(heard.alive.sum())/3600.0
    found = {}
    for rival in models:
        for kind in KINDS:
            believed, _ = detected(heard, (rival, kind), load_thresholds(rival, weights))
            rises = int((believed[1:] & ~believed[:-1] & heard.alive[1:]).sum())
            found[f"{rival}_{kind}"] = {"hours": flown, "alarms": rises, "per_100_h": 100.0*rises/flown,
                                        "upper95_per_100_h": 50.0*float(chi2.ppf(0.95, 2*rises + 2))/flown}
    return found
