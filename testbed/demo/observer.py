"""Second part of the demonstration: what the observer believes, against the truth, while ice gathers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from icing_env.scenario import Scenario, load
from testbed.demo.parts import Tell, Verdict, rms, write_verdicts
from testbed.flight import Flight, fly
from testbed.reports.page import Cell, Report
from testbed.reports.plotting import estimate_history

RATE = 5.0  # Hz, samples kept
EVERY, FIRST = 150.0, 20.0  # s: a doublet set every two and a half minutes
SETTLED = 80.0  # s: the first set is over
NAMES = ("CL_alpha", "CD_0", "Cm_alpha", "Cm_q", "Cm_elevator")
WORDS = """
An H-infinity observer estimates the derivatives while the aircraft flies, from the instruments alone and starting at
the published model. It can only learn of a derivative what the controls excite; so every two and a half minutes a set
of doublets is flown: two with the elevator, one with the aileron, one with the rudder. The boots stay off, so that ice
keeps gathering and the truth moves under the observer.

The truth is the quasi-steady equivalent of what the simulator flies: the derivatives that an estimator without a
downwash lag should find. No estimator and no controller can read it.
"""
CAPTION = """Estimates (blue) with the observer's own 95 % intervals, the truth (dashed) and the clean aircraft's
values. Between doublet sets the moment derivatives stand still: gusts alone teach nothing about them. Gusts that the
vane does not see as the tail does pull them towards zero; the intervals do not know of that."""


@dataclass(frozen=True)
class Observed:
    """One flight with doublet sets, and by derivative: estimate, its standard error, truth, each (samples,)."""

    flight: Flight
    estimate: dict[str, NDArray[np.float64]]
    std_error: dict[str, NDArray[np.float64]]
    truth: dict[str, NDArray[np.float64]]

    @property
    def settled(self) -> NDArray[np.bool_]:
        """Samples after the first doublet set."""
        later: NDArray[np.bool_] = self.flight.truth["time"] >= SETTLED
        return later

    def error(self, name: str) -> float:
        """Root-mean-square error over the mean size of the truth, after the first doublet set."""
        error, truth = (self.estimate[name] - self.truth[name])[self.settled], self.truth[name][self.settled]
        return rms(error)/float(np.mean(np.abs(truth)))

    def coverage(self, name: str) -> float:
        """Share of the time, after the first doublet set, that the truth is inside the 95 % interval."""
        inside = np.abs(self.estimate[name] - self.truth[name]) <= 1.96*self.std_error[name]
        return float(np.mean(inside[self.settled]))

    def change(self, name: str) -> tuple[float, float]:
        """Change by ice from start to end, over the clean value: the truth's, and the estimate's."""
        start, end = self.truth[name][0], self.truth[name][-1]
        return float(end/start - 1.0), float(self.estimate[name][-1]/start - 1.0)


def scenario(duration: float) -> Scenario:
    """Glaze in stratiform cloud with doublet sets, boots off."""
    starts = tuple(np.arange(FIRST, duration - 60.0, EVERY).tolist())
    return load("stratiform", duration=duration, task={"kind": "doublets"}, doublets_at=starts, ice_protection="off")


def measure(seed: int, duration: float, tell: Tell) -> Observed:
    """Fly `duration` seconds with doublet sets in ice."""
    tell("doublet sets while ice gathers", 0.0)
    flight = fly(scenario(duration), seed=seed, rate=RATE, protection=False)
    return Observed(flight, {n: flight.estimate[n] for n in NAMES}, {n: flight.estimate[f"{n}_std"] for n in NAMES},
                    {n: flight.truth[f"quasi_{n}"] for n in NAMES})


def verdicts(o: Observed) -> list[Verdict]:
    """How near the estimates stay, and whether their intervals hold."""
    worst = max(NAMES, key=o.error)
    error, least = o.error(worst), min(NAMES, key=o.coverage)
    near = Verdict(f"Derivatives in ice: after the first doublets every one of {', '.join(NAMES)} stays within "
                   f"{100.0*error:.1f} % (rms) of the truth; {worst} is the farthest.",
                   "good" if error <= 0.1 else "caution")  # fmt: skip
    share = 100.0*o.coverage(least)
    held = Verdict("Their 95 % intervals hold the truth at least 95 % of the time.", "good") if share >= 95.0 else \
        Verdict(f"Their 95 % intervals are too narrow in turbulence: that of {least} holds the truth {share:.0f} % of "
                "the time.", "caution")  # fmt: skip
    return [near, held]


def write(report: Report, o: Observed) -> None:
    """Add the section."""
    report.section("The observer: derivatives while ice gathers", WORDS)
    write_verdicts(report, verdicts(o))
    clean = {name: float(values[0]) for name, values in o.truth.items()}
    later = o.flight.truth["time"] >= FIRST
    estimate, error, truth = ({n: v[later] for n, v in values.items()} for values in (o.estimate, o.std_error, o.truth))
    report.figure(estimate_history(o.flight.truth["time"][later], estimate, error, truth, clean),
                  " ".join(CAPTION.split()))
    rows: list[list[Cell]] = [
        [n, clean[n], float(truth[n][-1]), float(estimate[n][-1]), 1.96*float(error[n][-1]),
         *(100.0*change for change in o.change(n)), 100.0*o.error(n), 100.0*o.coverage(n)] for n in NAMES]
    headers = ("derivative", "clean", "truth, end", "estimate, end", "± 95 %", "ice did (%)", "observer says (%)",
               "rms error (%)", "truth in interval (% of time)")  # fmt: skip
    report.table(headers, rows, f"Derivatives per rad after {o.flight.truth['time'][-1]/60.0:.0f} min in icing cloud.")
