"""Windows to fit, to calibrate and to judge on: which ice, in which turbulence, from which seeds.

The fit sees severities on a grid; calibration and tests draw them from the whole bands, from streams of their own, so
that no test meets a severity, an aircraft or a gust of the fit.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from estimators.characterise.features import against, offset_of
from estimators.characterise.model import CLASSES, PARTS
from icing_env.types import SURFACES
from testbed.characterisation.flights import Flown, Plan, fly

FloatArray = NDArray[np.float64]
MODERATE, SEVERE = (0.07, 0.13), (0.18, 0.28)  # eta: flight 010302f1 reached 0.073; 0.3 saturates (SIS)
GRID = 5  # severities in each band that the fit sees
TURBULENCE = {"calm": 0.0, "light": 2.0, "moderate": 3.1, "severe": 7.2}  # sigma_w, MIL-F-8785C fig. 7 at 7500 ft
SEEDS = {"fit": 100, "calibrate": 200, "thresholds": 300, "test": 900, "test_detection": 1000}  # first of each, apart
WINGS = [SURFACES.index("left_wing"), SURFACES.index("right_wing")]
TAIL = [SURFACES.index("htail")]
COLUMNS = [SURFACES.index(part) for part in PARTS]
DRAG, SLOPE = 0.01, 0.10  # excess CD_0 and lost share of CL_alpha from which ice matters


@dataclass(frozen=True)
class Windows:
    """Rows to learn from.

    Attributes:
        type, own: features as they are, and less the aircraft's own clean offset [n, features].
        label: index in CLASSES, -1 where the ice is not on one surface alone [n].
        iced: 1 where ice matters [n].
        eta: severity of each of PARTS [n, 4].
        sigma_w: m/s [n].
    """

    type: FloatArray
    own: FloatArray
    label: NDArray[np.int64]
    iced: FloatArray
    eta: FloatArray
    sigma_w: FloatArray


def five_classes(n: int, rng: np.random.Generator, grid: bool) -> tuple[FloatArray, NDArray[np.int64]]:
    """Severities [n, 7] and labels [n] of ice on wing or tail alone, classes in turn."""
    label = np.arange(n) % len(CLASSES)
    eta = np.zeros((n, len(SURFACES)))
    for k, (surfaces, band) in enumerate(((WINGS, MODERATE), (WINGS, SEVERE), (TAIL, MODERATE), (TAIL, SEVERE)), 1):
        rows = np.flatnonzero(label == k)
        share = rng.integers(0, GRID, len(rows))/(GRID - 1.0) if grid else rng.uniform(0.0, 1.0, len(rows))
        eta[rows[:, None], surfaces] = (band[0] + (band[1] - band[0])*share)[:, None]
    return eta, label


def natural(n: int, rng: np.random.Generator) -> FloatArray:
    """Severities [n, 7] as clouds leave them: everywhere alike but for scatter, one wing or the propeller at times."""
    eta = rng.uniform(0.0, 0.16, (n, 1))*rng.uniform(0.5, 1.3, (n, len(SURFACES)))
    eta[rng.random(n) < 0.2] = 0.0
    one = rng.random(n) < 0.3
    which = rng.integers(0, 2, n)
    eta[one, which[one]] *= rng.uniform(0.0, 0.6, int(one.sum()))
    eta[:, SURFACES.index("propeller")] = np.where(rng.random(n) < 0.5, rng.uniform(0.0, 0.2, n), 0.0)
    most = [{"struts": 0.15, "other": 0.12}.get(surface, 0.3) for surface in SURFACES]  # configs/ice/dhc6.toml
    return np.minimum(eta, most)


def intensities(n: int, rng: np.random.Generator) -> FloatArray:
    """sigma_w [n]: a quarter each calm, light, moderate, and anything up to 5 m/s."""
    kind = rng.integers(0, 4, n)
    return np.select([kind == 0, kind == 1, kind == 2], [0.0, TURBULENCE["light"], TURBULENCE["moderate"]],
                     rng.uniform(0.0, 5.0, n))


def draw(purpose: str, n: int, part: int = 0, threads: int = 2) -> Windows:
    """Fly `n` aircraft of each of four sorts (one surface or natural ice, with and without doublets).

    Every reading becomes a row. `part` continues the streams.
    """
    kept = []
    for sort in range(4):
        seed = SEEDS[purpose] + 4*part + sort
        rng = np.random.Generator(np.random.Philox(key=np.array([seed, 5], np.uint64)))
        if sort < 2:
            eta, label = five_classes(n, rng, grid=purpose == "fit")
        else:
            eta, label = natural(n, rng), np.full(n, -1)
        flown = fly(Plan(eta, intensities(n, rng), doublets=sort % 2 == 0), seed, threads)
        kept.append(windows_of(flown, label))
    return join(kept)


def windows_of(flown: Flown, label: NDArray[np.int64]) -> Windows:
    """Every reading of every good flight as a row of its own."""
    good = flown.good & np.isfinite(flown.features).all(axis=(1, 2, 3)) & np.isfinite(flown.reference).all(axis=1)
    each = flown.features.shape[1]*flown.features.shape[2]
    rows = flown.features[good].reshape(-1, flown.features.shape[-1])
    offset = np.repeat(offset_of(flown.reference[good]), each, axis=0)
    iced = ((flown.excess_drag > DRAG) | (flown.slope_lost > SLOPE)).astype(np.float64)
    return Windows(rows, against(rows, offset), np.repeat(label[good], each), np.repeat(iced[good], each),
                   np.repeat(flown.eta[good][:, COLUMNS], each, axis=0), np.repeat(flown.sigma_w[good], each))


def join(parts: list[Windows]) -> Windows:
    """One after another."""
    return Windows(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Windows)))
