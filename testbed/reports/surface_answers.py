"""How surfaces answer their commands: recorded, by the model's actuators, and as diagnosed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from icing_env.record import FloatArray
from sim2real.actuators.paths import answered, moves
from sim2real.diagnosis import Diagnosis
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import Reconstruction
from sim2real.words import late_by
from testbed.reports.plot_style import DEG
from testbed.reports.plotting import time_histories

LIKELY = 0.05  # probability that a gap enters at a path, from which on the path is drawn
BEFORE, SHOWN = 1.0, 8.0  # s before the command moves, and in all
ROLES = {"command": "limit", "record": "truth", "before": "iced", "after": "protected"}


def by_surface(found: Diagnosis, result: Mapping[str, Any]) -> list[list[Any]]:
    """RMS of recorded less predicted positions before and after [deg], a row for each surface whose command moves."""
    rows = []
    for surface in SURFACES:
        flights = [f for f in found.details.flights if moves(f, surface)]
        left = [np.array(_predicted(f, surface, found, result)) - f.positions[surface] for f in flights]
        if left:
            rms = DEG * np.sqrt(np.nanmean(np.concatenate(left, axis=1) ** 2, axis=1))
            rows.append([f"{surface}_path", *(f"{degrees:.3f}" for degrees in rms)])
    return rows


def suspected(result: Mapping[str, Any]) -> list[str]:
    """Surfaces at whose path the gap may enter."""
    at: Mapping[str, float] = result["where"]["components"]
    return [s for s in SURFACES if at.get(f"{s}_path", 0.0) >= LIKELY]


def answer(found: Diagnosis, result: Mapping[str, Any], surface: str) -> Figure | None:
    """A surface and its command in the record that moves it most, from where it moves; none where no command does."""
    flights = [f for f in found.details.flights if moves(f, surface)]
    if not flights:
        return None
    flight = max(flights, key=lambda f: float(np.ptp(f.commands[f"{surface}_command"])))
    command = flight.commands[f"{surface}_command"]
    away = np.abs(command - command[0]) > 0.2 * np.ptp(command)
    start = max(flight.time[int(np.argmax(away))] - BEFORE, flight.time[0])
    inside = (flight.time >= start) & (flight.time <= start + SHOWN)
    before, after = _predicted(flight, surface, found, result)
    series = {"command": command, "record": flight.positions[surface], "before": before, "after": after}
    shown = {name: {"time": flight.time[inside], surface: values[inside]} for name, values in series.items()}
    return time_histories(shown, [surface], ROLES)


def _predicted(flight: Reconstruction, surface: str, found: Diagnosis, result: Mapping[str, Any]
               ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Positions behind the model's actuator, and behind the one diagnosed, late by what it is late [N]."""
    before, after = (answered(flight, surface, p)[:, 0]
                     for p in (flight.parameters, found.details.change(flight.parameters)))  # fmt: skip
    unknown = result["unknown"]
    here = unknown and unknown["component"] == f"{surface}_path" and result["verdict"] == "unknown"
    if here and (late := late_by(unknown)):  # what the simulator flies as a lag is told as a delay
        after = np.interp(flight.time - late, flight.time, before)
    return before, after
