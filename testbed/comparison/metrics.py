"""Figures of merit of the ice management's four functions, and their means with intervals.

1 sense, 2 operate ice protection, 3 protect the envelope, 4 fly well (founding paper's four functions).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from testbed.comparison import flight_figures as flight
from testbed.comparison import ice_figures as ice
from testbed.comparison.modal import FIGURES
from testbed.comparison.trace import INTERVAL, Trace

FloatArray = NDArray[np.float64]


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


def ended(name: str) -> Callable[[Trace, int], float]:
    """A figure of the aircraft at the episode's end."""
    return lambda t, i: float(t.modal[name][i]) if name in t.modal else float("nan")


METRICS: dict[str, Metric] = {
    "detection_delay": Metric("s", 1, ice.detection_delay, managed=True),
    "missed_alarms": Metric("1", 1, ice.missed, share=True, managed=True),
    "false_alarms": Metric("1/h", 1, ice.false_alarms, managed=True),
    "severity_error": Metric("1", 1, ice.severity_error, managed=True),
    "ice_carried": Metric("kg", 2, lambda t, i: float(np.mean(t["ice_mass"][t.alive[:, i], i]))),
    "boot_cycles": Metric("1", 2, flight.last("boot_cycles")),
    "heat_energy": Metric("J", 2, flight.last("heat_energy")),
    "exceedances": Metric("1", 3, flight.share(flight.beyond)),
    "stall_time": Metric("s", 3, lambda t, i: INTERVAL*np.count_nonzero(flight.stalling(t, i) & t.alive[:, i])),
    "stalled": Metric("1", 3, lambda t, i: float(flight.longest_stall(t, i) > 1.0), share=True),
    "worst_alpha_margin": Metric("rad", 3, lambda t, i: float(np.min(t["alpha_margin"][t.alive[:, i], i]))),
    "losses": Metric("1", 3, lambda t, i: float(t.reason[i] != ""), share=True),
    "upsets": Metric("1", 3, lambda t, i: float(t.reason[i] == "upset"), share=True),
    "intervention_time": Metric("1", 3, flight.share(flight.touched), managed=True),
    "nuisance_time": Metric("1", 3, flight.nuisance, managed=True),
    "largest_intervention": Metric("rad", 3, lambda t, i: float(np.max(np.abs(
        t["intervention"][t.alive[:, i], i]))), managed=True),
    "altitude_rms": Metric("m", 4, flight.deviation("altitude_error")),
    "airspeed_rms": Metric("m/s", 4, flight.deviation("airspeed_error")),
    "heading_rms": Metric("rad", 4, flight.deviation("heading_error")),
    "altitude_overshoot": Metric("1", 4, flight.overshoot("altitude")),
    "altitude_settling": Metric("s", 4, flight.settling("altitude")),
    "heading_overshoot": Metric("1", 4, flight.overshoot("heading")),
    "heading_settling": Metric("s", 4, flight.settling("heading")),
    **{name: Metric("1", 4, ended(name), share=name == "level_lost") for name in (
        *(f"{figure}_off" for figure in FIGURES), "level_lost")},
    "elevator_activity": Metric("rad/s", 4, flight.activity("elevator")),
    "aileron_activity": Metric("rad/s", 4, flight.activity("aileron")),
    "rudder_activity": Metric("rad/s", 4, flight.activity("rudder")),
}


def per_episode(t: Trace, managed: bool) -> dict[str, FloatArray]:
    """Every metric of every episode [n]; NaN where it has no meaning."""
    return {name: np.array([metric.of(t, i) if managed or not metric.managed else np.nan
                            for i in range(len(t.reason))]) for name, metric in METRICS.items()}


def summary(runs: list[dict[str, FloatArray]], learned: bool) -> dict[str, dict[str, float | str | int | None]]:
    """Mean, 95 % interval, unit, function and number of episodes of every metric.

    Args:
        runs: of `per_episode`, one for each training seed of a learned controller, else one.
        learned: intervals go over the training seeds where there are several, and an interquartile mean over all
            episodes stands beside the mean (Agarwal et al., NeurIPS 2021: fewer surprises from one bad seed).
    """
    out: dict[str, dict[str, float | str | int | None]] = {}
    for name, metric in METRICS.items():
        values = np.concatenate([run[name] for run in runs])
        values = values[np.isfinite(values)]
        if len(runs) > 1:
            means = np.array([np.mean(v) for run in runs if len(v := run[name][np.isfinite(run[name])])])
            mean, low, high = interval(means, share=False)
            low, high = (None, None) if mean is None else _within(metric, low, high)
        else:
            mean, low, high = interval(values, metric.share)
        out[name] = {"mean": mean, "low95": low, "high95": high, "unit": metric.unit, "ims_function": metric.function,
                     "episodes": len(values)}
        if learned:
            out[name]["iqm"] = float(stats.trim_mean(values, 0.25)) if len(values) else None
            out[name]["training_seeds"] = len(runs)
    return out


def _within(metric: Metric, low: float | None, high: float | None) -> tuple[float | None, float | None]:
    """Ends of an interval of shares are shares."""
    if low is None or high is None or not metric.share:
        return low, high
    return max(low, 0.0), min(high, 1.0)


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
