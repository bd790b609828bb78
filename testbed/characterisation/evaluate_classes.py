"""How well the five classes are told, and how far their probabilities can be believed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.characterise.features import against, offset_of
from estimators.characterise.model import CLASSES, KINDS, Model
from testbed.characterisation.dataset import COLUMNS, SEEDS, TURBULENCE, five_classes
from testbed.characterisation.flights import Flown, Plan, fly

FloatArray = NDArray[np.float64]
WINDOWS = 3
BINS = 10
FEWEST = 100  # probabilities in a bin that is judged: a share of 0.5 is then known to 0.05 (one standard deviation)


def fly_classes(n: int, turbulence: str, threads: int = 2) -> tuple[Flown, NDArray[np.int64]]:
    """`n` aircraft, three doublet sets each, severities of the whole bands, seeds of the test; and their labels."""
    seed = SEEDS["test"] + list(TURBULENCE).index(turbulence)
    rng = np.random.Generator(np.random.Philox(key=np.array([seed, 9], np.uint64)))
    eta, label = five_classes(n, rng, grid=False)
    flown = fly(Plan(eta, np.full(n, TURBULENCE[turbulence]), windows=WINDOWS), seed, threads)
    return flown, label


def seen(flown: Flown, kind: str) -> FloatArray:
    """Features of the good flights [n, windows, readings, features], of one kind."""
    values = flown.features[flown.good]
    return values if kind == "type" else against(values, offset_of(flown.reference[flown.good])[:, None, None])


def told(flown: Flown, label: NDArray[np.int64], model: Model, kind: str) -> dict[str, Any]:
    """Shares right in one window and over three, confusion of single windows, errors of the severities."""
    judged, truth = model.judge(seen(flown, kind)), label[flown.good]
    full = judged.classes[:, :, -1]  # whole windows [n, windows, classes]
    one = full.argmax(axis=-1)
    three = np.log(np.maximum(full, 1e-9)).sum(axis=1).argmax(axis=-1)
    confusion = np.zeros((len(CLASSES), len(CLASSES)), int)
    np.add.at(confusion, (np.repeat(truth, WINDOWS), one.ravel()), 1)
    clean = truth == 0
    error = judged.eta[:, :, -1] - flown.eta[flown.good][:, None, COLUMNS]
    inside = np.abs(error) < 1.96*judged.std[:, :, -1]
    return {"flights": int(flown.good.sum()), "windows": int(one.size),
            "one_window": float((one == truth[:, None]).mean()), "three_windows": float((three == truth).mean()),
            "false_alarms": float((one[clean] > 0).mean()), "confusion": confusion,
            "severity_rms": [float(x) for x in np.sqrt((error**2).mean(axis=(0, 1)))],
            "severity_coverage95": float(inside.mean())}


def reliability(flights: list[tuple[Flown, NDArray[np.int64]]], model: Model, kind: str) -> dict[str, Any]:
    """Told probability of every class at every reading against the share that was so, in BINS bins.

    `gap`: the largest difference in a bin of FEWEST or more; `ece`: the mean difference, weighted by the bins.
    """
    told_p, was = [], []
    for flown, label in flights:
        p = model.judge(seen(flown, kind)).classes
        told_p.append(p.reshape(-1))
        was.append((label[flown.good][:, None, None, None] == np.arange(len(CLASSES))*np.ones(p.shape)).reshape(-1))
    return curve(np.concatenate(told_p), np.concatenate(was))


def curve(p: FloatArray, was: NDArray[np.bool_]) -> dict[str, Any]:
    """Reliability of probabilities `p` of events that `was`, or was not, both [n]."""
    bins = np.minimum((p*BINS).astype(int), BINS - 1)
    count = np.bincount(bins, minlength=BINS)
    mean = np.bincount(bins, p, BINS)/np.maximum(count, 1)
    share = np.bincount(bins, was, BINS)/np.maximum(count, 1)
    off = np.abs(mean - share)
    judged = count >= FEWEST
    return {"told": mean, "was": share, "count": count, "gap": float(off[judged].max()),
            "ece": float((off*count).sum()/count.sum())}


def evaluate(models: Mapping[str, dict[str, Model]], n: int, threads: int = 2) -> dict[str, Any]:
    """Classes in calm, light and moderate turbulence and reliability over all of them, by rival and kind."""
    flights = {name: fly_classes(n, name, threads) for name in ("calm", "light", "moderate")}
    found: dict[str, Any] = {}
    for rival, kinds in models.items():
        for kind in KINDS:
            by_air = {name: told(flown, label, kinds[kind], kind) for name, (flown, label) in flights.items()}
            believed = reliability(list(flights.values()), kinds[kind], kind)
            found[f"{rival}_{kind}"] = {**by_air, "reliability": believed}
    return found
