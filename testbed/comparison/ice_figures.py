"""Figures of functions 1 and 2 of an ice management system, one number per episode.

Ice counts as there when the true excess drag passes 0.01 or a tenth of lift slope, elevator power or propeller
efficiency is lost. An alarm is false when it is raised with less than half of each, missed when it does not follow
within 60 s.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from testbed.comparison.trace import INTERVAL, Trace, rms

DRAG, LOSS, ALLOWED = 0.01, 0.1, 60.0  # 1, 1, s
DRAG_SEVERE = 0.06  # excess drag at severity 1 (configs/controllers/ice_management.toml)


def present(t: Trace, i: int, part: float = 1.0) -> NDArray[np.bool_]:
    """Samples at which ice is there, by `part` of the thresholds."""
    lost = np.maximum(np.maximum(t["slope_lost"][:, i], t["elevator_lost"][:, i]), t["thrust_lost"][:, i])
    return (t["excess_drag"][:, i] > part*DRAG) | (lost > part*LOSS)


def crossing(t: Trace, i: int) -> int | None:
    """First sample with ice, None if there is none."""
    found = np.flatnonzero(present(t, i) & t.alive[:, i])
    return int(found[0]) if len(found) else None


def detection_delay(t: Trace, i: int) -> float:
    """Time from ice to alarm [s]; 0 if the alarm was there first, NaN without ice or without alarm."""
    start = crossing(t, i)
    alarm = np.flatnonzero((t["ice_detected"][:, i] > 0.5) & t.alive[:, i])
    if start is None or not len(alarm) or alarm[-1] < start:
        return float("nan")
    return max(int(alarm[alarm >= start][0]) - start, 0)*INTERVAL


def missed(t: Trace, i: int) -> float:
    """1 if no alarm was up within 60 s of ice, NaN where the flight was shorter than that."""
    start = crossing(t, i)
    if start is None or t.alive[:, i].sum() - start < ALLOWED/INTERVAL:
        return float("nan")
    delay = detection_delay(t, i)
    return float(not delay <= ALLOWED)


def false_alarms(t: Trace, i: int) -> float:
    """Alarms raised without ice, per flight hour."""
    raised = np.diff(t["ice_detected"][:, i], prepend=0.0) > 0.5
    alive = t.alive[:, i]
    return 3600.0*np.count_nonzero(raised & ~present(t, i, 0.5) & alive)/(alive.sum()*INTERVAL)


def severity_error(t: Trace, i: int) -> float:
    """RMS of the severity told to the crew less the true one, excess drag over DRAG_SEVERE."""
    return rms(t["severity"][:, i] - np.clip(t["excess_drag"][:, i]/DRAG_SEVERE, 0.0, 1.0), t, i)
