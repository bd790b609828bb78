"""Function 1, sense: how bad is the ice, how sure is that, is it there.

* severity: inverse-variance mean of the severities that excess drag and, where elevator inputs have excited them, the
  losses of CL_alpha, Cm_alpha and Cm_elevator speak for. Drag comes first because its scatter is the smallest part of
  its icing effect (founding paper: excess drag follows icing above 80 %); the fleet scatter in each variance says so.
* where somebody else tells the ice surface by surface (`tell`), detection is theirs; the severity, of the aircraft as a
  whole, stays that of drag and derivatives
* detection: confirmed after a time above a threshold, released after a time below a lower one (hysteresis), by one
  counter that runs up and down
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import clip
from icing_env.jit import kernel
from icing_env.types import SENSED_PARTS


@kernel
def loss(estimate: float, std: float, clean: float, g: Any) -> tuple[float, float]:
    """Severity that one derivative speaks for, and its weight (one over the variance)."""
    severity = (1.0 - estimate/clean)/g.derivative_loss_severe
    variance = (std/clean)*(std/clean) + g.derivative_scatter*g.derivative_scatter
    return severity, g.derivative_loss_severe*g.derivative_loss_severe/variance


@kernel
def assess(e: Any, frame: Any, g: Any) -> tuple[float, float]:
    """Severity (0..1) and its confidence (0..1) from the estimate of now."""
    weight = g.drag_severe*g.drag_severe/(e.CD_0_std*e.CD_0_std + g.drag_scatter*g.drag_scatter)
    total = weight*e.excess_drag/g.drag_severe
    gate = clip((e.excitation_longitudinal - g.excitation_low)/(g.excitation_high - g.excitation_low), 0.0, 1.0)
    for k in range(3):
        if k == 0:
            severity, w = loss(e.CL_alpha, e.CL_alpha_std, frame.CX_0 - frame.CZ_alpha, g)
        elif k == 1:
            severity, w = loss(e.Cm_alpha, e.Cm_alpha_std, frame.Cm_alpha, g)
        else:
            severity, w = loss(e.Cm_elevator, e.Cm_elevator_std, frame.Cm_elevator, g)
        total += gate*w*severity
        weight += gate*w
    variance = 1.0/weight
    confidence = 1.0/(1.0 + variance/(g.confidence_half*g.confidence_half))
    return clip(total/weight, 0.0, 1.0), confidence


@kernel
def characterise(a: Any, e: Any, frame: Any, g: Any, dt: float) -> None:
    """Severity, confidence and detection. An unhealthy or undefined estimate changes the confidence only."""
    if a.told == 2.0:  # by one who knows
        a.since_detection = (a.since_detection + dt)*a.ice_detected
        return
    severity, confidence = assess(e, frame, g)
    if e.health != 1.0 or not (math.isfinite(severity) and math.isfinite(confidence)):
        a.confidence = 0.0
        a.since_detection += dt*a.ice_detected
        return
    a.severity += (severity - a.severity)*(1.0 - math.exp(-dt/g.severity_time))
    a.confidence = confidence
    if a.told == 1.0:
        a.since_detection = (a.since_detection + dt)*a.ice_detected
        return
    if a.severity > g.detect_severity and confidence >= g.confidence_min:
        a.memory = min(a.memory + dt/g.detect_time, 1.0)
    elif a.severity < g.clear_severity:
        a.memory = max(a.memory - dt/g.clear_time, 0.0)
    if a.memory >= 1.0:
        a.ice_detected = 1.0
    elif a.memory <= 0.0:
        a.ice_detected = 0.0
    a.since_detection = (a.since_detection + dt)*a.ice_detected


def tell(advisory: NDArray[Any], eta: NDArray[np.float64], sure: NDArray[np.float64], detected: NDArray[np.bool_],
         failed: NDArray[np.bool_]) -> None:
    """Take the ice surface by surface from somebody else, in place; from then on drag alone detects nothing.

    Ice that the drag had shown before stays detected for as long as it is more likely than not.

    Args:
        advisory: ADVISORY rows [n].
        eta: severity of each of SENSED_PARTS [n, 4].
        sure: probability that the ice matters [n].
        detected: ice is believed [n].
        failed: protection of each part is believed to have failed [n, 4].
    """
    advisory["told"] = 1.0
    for i, part in enumerate(SENSED_PARTS):
        advisory[f"severity_{part}"] = np.maximum(eta[:, i], 0.0)
        advisory[f"failed_{part}"] = failed[:, i]
    advisory["ice_detected"] = detected | ((advisory["ice_detected"] > 0.5) & (sure > 0.5))
