"""Figures of merit of the ice management's four functions, one number per episode, and their means with intervals.

1 sense, 2 operate ice protection, 3 protect the envelope, 4 fly well (founding paper's four functions).
Ice counts as there when the true excess drag passes 0.01 or a tenth of lift slope, elevator power or propeller
efficiency is lost. An alarm is false when it is raised with less than half of each, missed when it does not follow
within 60 s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from testbed.comparison.trace import INTERVAL, Trace

FloatArray = NDArray[np.float64]
DRAG, LOSS, ALLOWED = 0.01, 0.1, 60.0  # 1, 1, s
DRAG_SEVERE = 0.06  # excess drag at severity 1 (configs/controllers/ice_management.toml)
TOUCHED = 1e-6  # rad, change to the elevator that counts as an intervention


@dataclass(frozen=True)
class Metric:
    """One figure: its unit, the function it belongs to, and how an episode's value is found.

    Attributes:
        of: (trace, row) -> value, NaN where the episode has none.
        share: the value is 0 or 1.
        managed: has a meaning only while the ice management runs.
    """

    unit: str
    function: int
    of: Callable[[Trace, int], float]
    share: bool = False
    managed: bool = False


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


def rms(values: FloatArray, t: Trace, i: int) -> float:
    """Root mean square while the flight lasts."""
    return float(np.sqrt(np.mean(values[t.alive[:, i]]**2)))


def last(name: str) -> Callable[[Trace, int], float]:
    """Value of a channel at an episode's last sample."""
    return lambda t, i: float(t[name][t.alive[:, i], i][-1])


def deviation(name: str) -> Callable[[Trace, int], float]:
    """RMS of a channel."""
    return lambda t, i: rms(t[name][:, i], t, i)


def activity(surface: str) -> Callable[[Trace, int], float]:
    """RMS rate of a surface's command [rad/s]."""
    name = f"command_{surface}"
    return lambda t, i: rms(np.diff(t[name][:, i], prepend=t[name][0, i])/INTERVAL, t, i)


def longest_stall(t: Trace, i: int) -> float:
    """Longest unbroken time beyond the iced stall's onset [s]."""
    best = run = 0
    for beyond in (t["alpha_margin"][:, i] < 0.0) & t.alive[:, i]:
        run = run + 1 if beyond else 0
        best = max(best, run)
    return best*INTERVAL


METRICS: dict[str, Metric] = {
    "detection_delay": Metric("s", 1, detection_delay, managed=True),
    "missed_alarms": Metric("1", 1, missed, share=True, managed=True),
    "false_alarms": Metric("1/h", 1, false_alarms, managed=True),
    "severity_error": Metric("1", 1, severity_error, managed=True),
    "ice_carried": Metric("kg", 2, lambda t, i: float(np.mean(t["ice_mass"][t.alive[:, i], i]))),
    "boot_cycles": Metric("1", 2, last("boot_cycles")),
    "heat_energy": Metric("J", 2, last("heat_energy")),
    "stall_time": Metric("s", 3, lambda t, i: INTERVAL*np.count_nonzero((t["alpha_margin"][:, i] < 0.0)
                                                                         & t.alive[:, i])),
    "stalled": Metric("1", 3, lambda t, i: float(longest_stall(t, i) > 1.0), share=True),
    "worst_alpha_margin": Metric("rad", 3, lambda t, i: float(np.min(t["alpha_margin"][t.alive[:, i], i]))),
    "losses": Metric("1", 3, lambda t, i: float(t.reason[i] != ""), share=True),
    "upsets": Metric("1", 3, lambda t, i: float(t.reason[i] == "upset"), share=True),
    "intervention_time": Metric("1", 3, lambda t, i: float(np.mean(
        np.abs(t["intervention"][t.alive[:, i], i]) > TOUCHED)), managed=True),
    "largest_intervention": Metric("rad", 3, lambda t, i: float(np.max(np.abs(
        t["intervention"][t.alive[:, i], i]))), managed=True),
    "altitude_rms": Metric("m", 4, deviation("altitude_error")),
    "airspeed_rms": Metric("m/s", 4, deviation("airspeed_error")),
    "heading_rms": Metric("rad", 4, deviation("heading_error")),
    "elevator_activity": Metric("rad/s", 4, activity("elevator")),
    "aileron_activity": Metric("rad/s", 4, activity("aileron")),
    "rudder_activity": Metric("rad/s", 4, activity("rudder")),
}


def measure(t: Trace, managed: bool) -> dict[str, dict[str, float | str | int | None]]:
    """Every metric over the episodes: mean, 95 % interval, unit, function and number of episodes that have it.

    Without ice management those that need one are null, as are those that no episode has.
    """
    n = len(t.reason)
    out: dict[str, dict[str, float | str | int | None]] = {}
    for name, metric in METRICS.items():
        values = np.array([metric.of(t, i) if managed or not metric.managed else np.nan for i in range(n)])
        values = values[np.isfinite(values)]
        mean, low, high = interval(values, metric.share)
        out[name] = {"mean": mean, "low95": low, "high95": high, "unit": metric.unit, "ims_function": metric.function,
                     "episodes": len(values)}
    return out


def interval(values: FloatArray, share: bool) -> tuple[float | None, float | None, float | None]:
    """Mean and 95 % interval: Student's t, for shares Wilson's; a single value is its own interval."""
    if not len(values):
        return None, None, None
    mean = float(np.mean(values))
    if share:
        found = stats.binomtest(round(float(values.sum())), len(values)).proportion_ci(0.95, method="wilson")
        return mean, float(found.low), float(found.high)
    if len(values) == 1:
        return mean, mean, mean
    half = float(stats.t.ppf(0.975, len(values) - 1)*np.std(values, ddof=1)/np.sqrt(len(values)))
    return mean, mean - half, mean + half
