"""From scores to statements: when ice is believed, since when, and whether what was switched on against it works.

* detection: the score (log-odds that ice matters) above the threshold of the turbulence that is met for `confirm`
  seconds; released after `release` seconds below it by RELEASE. The threshold is interpolated between turbulence
  classes by the measured gust intensity. Nothing new is believed in air warmer than `warmest`.
* onset: the last time that the score was no higher than ONSET of the way from its usual value in clear air to the
  threshold.
* protection: each inflation (a rising edge, or a boot held on for a cycle) is an experiment. Severity `boot_after`
  seconds later is compared with that before it, under "works" (a share LEFT stays) and "failed" (everything stays);
  the log-likelihood ratios of successive inflations add up, each bounded by EVIDENCE_MOST.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from estimators.characterise.model import PARTS, Judgement
from estimators.characterise.thresholds import Thresholds
from estimators.characterise.tuning import Tuning

FloatArray = NDArray[np.float64]
ONSET = 0.25  # share of that way: above the scatter of clear air (assumed)
RELEASE = 2.0  # log-odds below the threshold at which ice is let go (assumed)
LEFT, LEFT_STD = 0.45, 0.15  # share that a working boot leaves: a quarter of thick, most of thin ice (assumed)
KEPT_STD = 0.10  # by which severity may change over a failed inflation, relative (assumed: growth of a minute)
LEAST = 0.01  # smallest standard deviation of a change of severity (assumed)
PRIOR_FAILED = 0.1  # probability of failure before any inflation (assumed)
EVIDENCE_MOST = 3.0  # largest log-likelihood ratio of one inflation: models of ice are not better than that (assumed)
SWITCHES = ("boots_wing", "boots_wing", "boots_tail", "prop_heat")  # that serve each of PARTS

WATCH = np.dtype([
    ("above", "f8"), ("below", "f8"),  # s that the score has been so
    ("detected", "f8"), ("quiet", "f8"), ("onset", "f8"),  # 0/1; s, last time of a clear-air score; s, nan if none
    ("was", "f8", (4,)),  # switch of each of PARTS a step ago
    ("inflated", "f8", (4,)),  # s, last inflation
    ("due", "f8", (4,)),  # s at which its outcome is looked at, nan if none is open
    ("eta_before", "f8", (4,)), ("std_before", "f8", (4,)),  # severity when it came
    ("log_odds", "f8", (4,)), ("tested", "f8", (4,)),  # of failure; inflations looked at
])  # fmt: skip


def init(n: int) -> NDArray[np.void]:
    """Nothing believed, nothing tested (`WATCH` rows)."""
    watch = np.zeros(n, WATCH)
    watch["onset"], watch["due"], watch["inflated"] = np.nan, np.nan, -1e9
    watch["log_odds"] = np.log(PRIOR_FAILED/(1.0 - PRIOR_FAILED))
    return watch


def detect(watch: NDArray[np.void], score: FloatArray, gust: FloatArray, temperature: FloatArray, now: FloatArray,
           referenced: NDArray[np.bool_], thresholds: Thresholds, tuning: Tuning) -> None:
    """Advance detection and onset by one judgement, in place; arrays are [n], times in s."""
    limit, usual = thresholds.at(gust, referenced)
    over = (score > limit) & (temperature < tuning.warmest)
    watch["above"] = np.where(over, watch["above"] + tuning.period, 0.0)
    watch["below"] = np.where(score < limit - RELEASE, watch["below"] + tuning.period, 0.0)
    watch["quiet"] = np.where((score <= usual + ONSET*(limit - usual)) & (watch["detected"] == 0.0), now,
                              watch["quiet"])
    new = (watch["detected"] == 0.0) & over & (watch["above"] >= tuning.confirm)
    watch["onset"] = np.where(new, watch["quiet"], watch["onset"])
    watch["detected"] = np.where(new, 1.0, np.where(watch["below"] >= tuning.release, 0.0, watch["detected"]))


def inflations(watch: NDArray[np.void], on: NDArray[np.bool_], now: FloatArray, judged: Judgement,
               tuning: Tuning) -> NDArray[np.bool_]:
    """Note the inflations of now, with the severity before them, in place.

    Args:
        on: whether the switch of each of PARTS was on since the last judgement [n, 4].
        judged: the last judgement before now.

    Returns:
        Which inflate [n, 4].
    """
    held = now[:, None] - watch["inflated"] >= tuning.boot_cycle - 1e-6
    fires = on & ((watch["was"] < 0.5) | held)
    watch["was"] = np.where(on, 1.0, 0.0)
    watch["inflated"] = np.where(fires, now[:, None], watch["inflated"])
    watch["due"] = np.where(fires, now[:, None] + tuning.boot_after, watch["due"])
    watch["eta_before"] = np.where(fires, judged.eta, watch["eta_before"])
    watch["std_before"] = np.where(fires, judged.std, watch["std_before"])
    return fires


def outcomes(watch: NDArray[np.void], now: FloatArray, judged: Judgement) -> None:
    """Look at the inflations whose outcome is due, in place."""
    due = watch["due"] <= now[:, None]
    before, after = watch["eta_before"], judged.eta
    noise = watch["std_before"]**2 + judged.std**2 + LEAST**2
    size = np.maximum(before, 0.0)
    kept, left = noise + (KEPT_STD*size)**2, noise + (LEFT_STD*size)**2
    ratio = (0.5*((after - LEFT*size)**2/left - (after - size)**2/kept) + 0.5*np.log(left/kept))
    watch["log_odds"] += np.where(due, np.clip(ratio, -EVIDENCE_MOST, EVIDENCE_MOST), 0.0)
    watch["tested"] += due
    watch["due"] = np.where(due, np.nan, watch["due"])


def failed(watch: NDArray[np.void]) -> FloatArray:
    """Probability that the protection of each of PARTS has failed [n, 4]; the prior where nothing was tested."""
    return 1.0/(1.0 + np.exp(-watch["log_odds"]))


def verdicts(watch: np.void) -> dict[str, str]:
    """Word for each of PARTS of one aircraft: not tested, works, failed, or unclear."""
    p = 1.0/(1.0 + np.exp(-watch["log_odds"]))
    return {part: "not tested" if watch["tested"][i] == 0 else "failed" if p[i] > 0.5 else "works" if p[i] < 0.05
            else "unclear" for i, part in enumerate(PARTS)}


def exceeds(eta: float, std: float, level: float) -> float:
    """Probability that a severity exceeds a level, for a Gaussian estimate."""
    return 0.5*math.erfc((level - eta)/(std*math.sqrt(2.0)))
