"""Figure 20: what turbulence does to the scale factor of alpha, and that to CL_alpha.

The paper's data-compatibility step knows no wind: a gust at the vane that the accelerometers do not confirm as motion
becomes a scale factor, by which the corrected alpha and with it CL_alpha are then wrong. Drag does not pass through it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from estimators.compatibility.record import check_compatibility
from testbed.reports.plot_style import ROLES, legend_above, styled
from testbed.reproduce.analyses import ANALYSES
from testbed.reproduce.cases import DEGREE, GUST, fly_case
from testbed.reproduce.compatible import calibrate
from testbed.reproduce.pictures import Picture
from testbed.reproduce.row import Row, Rule, row
from testbed.reproduce.windows import Window

ITEM = "fig20"
CASE = "ice, high V"
LEVELS = (0.0, 0.1, 0.2, GUST, 0.5, 1.0)  # sigma_w, m/s
SETS = 8
STRONG = 0.9  # correlation from which the one is said to vary with the other (assumed)
WIDE = 3.0  # times the spread in still air: what "varies widely" is taken to be (assumed)


@dataclass(frozen=True)
class Sets:
    """Doublet sets of one gust level: scale factor [1], CL_alpha after and before its correction [1/deg], windows."""

    level: float
    scale: NDArray[np.float64]
    corrected: NDArray[np.float64]
    raw: NDArray[np.float64]
    windows: tuple[Window, ...]


def sets(seed: int) -> list[Sets]:
    """Every gust level."""
    found = []
    for level in LEVELS:
        windows = fly_case(CASE, seed, level, SETS)
        lift = {how: np.array([ANALYSES[how](w)["CL_alpha"].estimate for w in windows])*DEGREE
                for how in ("alpha corrected", "matched")}
        scale = np.array([calibrate(w.record).scale for w in windows])
        found.append(Sets(level, scale, lift["alpha corrected"], lift["matched"], windows))
    return found


def rows(seed: int) -> list[Row]:
    """How far the scale factor spreads, what it does to CL_alpha, what wind states make of it."""
    found = sets(seed)
    calm, rough = found[0], found[-1]
    scale, lift = (np.concatenate([getattr(s, key) for s in found]) for key in ("scale", "corrected"))
    goes = float(np.corrcoef(scale, lift)[0, 1])
    note = f"{len(scale)} iced doublet sets, sigma_w 0 to {LEVELS[-1]:g} m/s"
    wider, told = float(np.std(rough.scale)/np.std(calm.scale)), f"{calm.scale.mean():+.3f} +- {calm.scale.std():.3f}"
    least = min(s.scale.min() for s in found)
    with_wind = [check_compatibility(w.record, wind=True).parameters.get("scale_alpha") for w in rough.windows]
    largest = max((abs(e.estimate) for e in with_wind if e is not None), default=0.0)
    fall = 100.0*float(np.ptp([s.corrected.mean() for s in found])/calm.corrected.mean())
    return [
        Row(ITEM, "correlation of CL_alpha with the scale factor", "simulated", "varies with it", goes, "1", None,
            goes >= STRONG, f"{STRONG:g} or more", note),
        Row(ITEM, "spread of the scale factor in turbulence over that in still air", "simulated", "varies widely",
            wider, "1", None, wider >= WIDE, f"{WIDE:g} or more", f"still air {told}, sigma_w {rough.level:g} m/s "
            f"{rough.scale.mean():+.3f} +- {rough.scale.std():.3f}; ideally zero, here down to {least:.2f}"),
        row(ITEM, "largest scale factor with wind states", 0.0, largest, "1", Rule(absolute=0.05),
            f"{len(with_wind)} sets at sigma_w {rough.level:g} m/s; the paper has none, and calls zero ideal; "
            "an error that the record does not show counts as zero"),
        Row(ITEM, "fall of the mean CL_alpha from still air to the strongest gusts", "simulated", "biased", fall, "%",
            None, fall >= 10.0, "10 % or more",
            f"{note}; with alpha as measured {_fall(found):.0f} %; drag keeps its correlation with eta, see fig19"),
    ]


def _fall(found: list[Sets]) -> float:
    """Spread of the levels' mean CL_alpha with alpha as measured [%]."""
    return 100.0*float(np.ptp([s.raw.mean() for s in found])/found[0].raw.mean())


def pictures(seed: int) -> list[Picture]:
    """Figure 20's analogue."""
    return [Picture(draw(sets(seed)), "Figure 20: CL_alpha of iced doublet sets against the scale factor that data "
                    "compatibility without wind states gives alpha. Every point is the same aircraft with the same "
                    "ice; larger marks, more turbulence. Grey, the same sets with alpha as measured.",
                    "CL_alpha falls in proportion as the scale factor departs from zero")]


@styled
def draw(found: list[Sets]) -> Figure:
    """CL_alpha over the scale factor, corrected and as measured."""
    figure = Figure(figsize=(9.2, 4.2), layout="constrained")
    axes = figure.subplots()
    for k, s in enumerate(found):
        axes.plot(s.scale, s.corrected, "o", markersize=3.0 + k, color=ROLES["iced"]["color"], alpha=0.35 + 0.1*k,
                  label=f"σw {s.level:g} m/s")
    axes.plot(np.concatenate([s.scale for s in found]), np.concatenate([s.raw for s in found]), "+",
              color=ROLES["estimate"]["color"], markersize=6.0, label="alpha as measured")
    axes.set_xlabel("scale factor of alpha (1)")
    axes.set_ylabel("CL_alpha (1/deg)")
    legend_above(figure, [axes])
    return figure
