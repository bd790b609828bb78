"""The paper's 34 doublet cases: fast and slow, clear and iced, of the aircraft identified in the same campaign.

The paper's cases are doublets of many flights of one aircraft. Here every case is a doublet set of `twin_otter_flight`
with its own gusts. The paper gives no gust level; what agreed, it says, agreed in the absence of turbulence.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.airframe import published_airframe
from estimators.estimate import Estimate
from icing_env import scenario as scenarios
from testbed.reproduce.windows import Window, fly_sets

DEGREE = np.pi/180.0
NAMES = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_elevator")
HIGH, LOW = 72.0, 52.0  # m/s: cruise at 140 kt; the paper does not state its low velocity, 101 kt assumed
ICE = dict.fromkeys(("left_wing", "right_wing", "htail", "vtail", "struts", "other"), 0.05)  # assumed: 13 min of glaze
CASES = {"clear, high V": (HIGH, False, 9), "clear, low V": (LOW, False, 17), "ice, high V": (HIGH, True, 3),
         "ice, low V": (LOW, True, 5)}  # speed, ice, number of cases of the paper
GUST = 0.3  # m/s, sigma_w: what flight test calls smooth air (assumed)
UNITS = {"CL_alpha": ("1/deg", DEGREE), "Cm_alpha": ("1/deg", DEGREE), "Cm_elevator": ("1/deg", DEGREE),
         "Cm_q": ("1/rad", 1.0)}  # as the paper prints them


@lru_cache(maxsize=32)
def fly_case(case: str, seed: int, gust: float = GUST, count: int | None = None) -> tuple[Window, ...]:
    """Doublet sets of one sort of case.

    Args:
        case: of CASES.
        seed: the sets have the seeds 1000 `seed` and on.
        gust: sigma_w [m/s].
        count: how many sets; as many as the paper had by default.
    """
    speed, iced, printed = CASES[case]
    scenario = scenarios.load(
        "clear_air", aircraft="twin_otter_flight", duration=55.0, doublet_scale=0.78,
        parameters={"turbulence_sigma_w": gust},
        initial={"airspeed": speed, "eta": ICE if iced else {}},
        ice_protection="off", events=({"time": 10.0, "name": "doublets", "doublets": True},))
    return tuple(fly_sets(scenario, 1000*seed + k)[0]["doublets"] for k in range(printed if count is None else count))


def airframe_at(estimates: dict[str, Estimate]) -> NDArray[np.void]:
    """The published airframe with estimated derivatives in the place of its own: where the paper's observer started."""
    airframe = published_airframe()
    airframe["CZ_alpha"] = airframe["CX_0"] - estimates["CL_alpha"].estimate  # CL_alpha at alpha = 0 is CX_0 - CZ_alpha
    for name in ("Cm_alpha", "Cm_q", "Cm_elevator"):
        airframe[name] = estimates[name].estimate
    return airframe


def values(windows: tuple[Window, ...], name: str, of: Any) -> NDArray[np.float64]:
    """One derivative of every set by a method (a function of the window), in the paper's unit."""
    return np.array([of(w)[name].estimate for w in windows])*UNITS[name][1]
