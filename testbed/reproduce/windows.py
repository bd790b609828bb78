"""Named doublet sets of a scenario, flown and identified: what the founding paper plots against time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimators.estimate import Estimate
from estimators.hinf import record as hinf_record
from estimators.regression import equation_error
from estimators.signals.boom_filter import without_boom
from icing_env.atmosphere import G0
from icing_env.manoeuvres import Doublet, doublet_set
from icing_env.record import FlightRecord
from icing_env.scenario import Scenario
from testbed.flight import Flight, fly

BEFORE, AFTER = 5.0, 42.0  # s of record around the start of a set: a steady stretch, four doublets, their ends
LEAD, LENGTH = 2.0, 20.0  # s: both elevator doublets with some rest before; the paper used about 20 s an estimate
RESPONSE = 4.0  # s after an elevator doublet's start in which its load factor is measured


@dataclass(frozen=True)
class Window:
    """One doublet set.

    Attributes:
        name: of the event.
        record: the 20 s of both elevator doublets, through the 10 Hz low pass that the paper's data went through.
        stepwise: longitudinal derivatives by stepwise equation error on that record alone.
        hinf: the same by the H-infinity observer run once over it.
        excess_drag: mean of what the observer in flight believed in this window.
        load_factor: half of the peak-to-peak load factor of the elevator doublets, measured [g].
        truth: mean of true quantities by name.
        trim: mean of measured channels by name, in the steady stretch before the doublets.
    """

    name: str
    record: FlightRecord
    stepwise: dict[str, Estimate]
    hinf: dict[str, Estimate]
    excess_drag: float
    load_factor: float
    truth: dict[str, float]
    trim: dict[str, float]


def fly_sets(scenario: Scenario, seed: int = 0, *, hinf: bool = True) -> tuple[dict[str, Window], Flight]:
    """Fly a scenario and identify every named doublet set; the flight keeps the windows only.

    Args:
        scenario: its events with `doublets` need names.
        seed: of everything drawn.
        hinf: also run the observer over each window.
    """
    sets = [event for event in scenario.events if event.doublets]
    spans = [(event.time - BEFORE, event.time + AFTER) for event in sets]
    flight = fly(scenario, seed=seed, windows=spans)
    found = {}
    for event, (start, end) in zip(sets, spans, strict=True):
        rows = (flight.truth["time"] >= start - 1e-9) & (flight.truth["time"] <= end + 1e-9)
        record = part(flight.record, rows)
        doublets = of_elevator(record, event.time)
        found[event.name] = Window(
            event.name, doublets, equation_error.identify(doublets), hinf_record.identify(doublets) if hinf else {},
            float(np.mean(flight.estimate["excess_drag"][rows])),
            load_factor_of(record, doublet_set(event.time, scale=scenario.doublet_scale)),
            {name: float(np.mean(values[rows])) for name, values in flight.truth.items()},
            steady(record, event.time))
    return found, flight


def of_elevator(record: FlightRecord, start: float) -> FlightRecord:
    """The 20 s of the elevator doublets of a set that starts at `start` [s], low-passed at 10 Hz on every channel."""
    time = record["time"]
    return without_boom(part(record, (time >= start - LEAD - 1e-9) & (time <= start - LEAD + LENGTH + 1e-9)))


def part(record: FlightRecord, rows: NDArray[np.bool_]) -> FlightRecord:
    """Some samples of a record."""
    return replace(record, channels={name: values[rows] for name, values in record.channels.items()})


def steady(record: FlightRecord, until: float) -> dict[str, float]:
    """Mean of every channel before a time [s], without the instants at which it was not sampled."""
    rows = record["time"] < until
    return {name: float(np.nanmean(values[rows])) for name, values in record.channels.items()}


def load_factor_of(record: FlightRecord, doublets: tuple[Doublet, ...]) -> float:
    """Mean over the elevator doublets of half the peak-to-peak of -az [g]."""
    time, load = record["time"], -record["az"]/G0
    spans = [(time >= d.start) & (time <= d.start + RESPONSE) for d in doublets if d.surface == "elevator"]
    return float(np.mean([0.5*np.ptp(load[span]) for span in spans]))
