"""The characteriser over a flight record: one causal pass, as it would have run in the aircraft."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.characterise import detection, online
from estimators.characterise.clean import published_clean
from estimators.characterise.features import features
from estimators.characterise.model import CLASSES, PARTS
from estimators.hinf import record as hinf_record
from estimators.observer.measurements import absent, airframe_of_record, measurements
from estimators.signals.data_checks import check
from estimators.signals.resample import Grid, common_grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord

FloatArray = NDArray[np.float64]
ICED = 0.03  # severity from which a surface counts as iced: a light encounter (assumed)
SWITCHES = np.dtype([(name, "f8") for name in ("boots_wing", "boots_tail", "prop_heat")])
NEEDED = ("thrust_left", "thrust_right")


def characterise(record: FlightRecord, reference: FlightRecord | None = None, rival: str = "network",
                 weights: Path | None = None) -> dict[str, Any]:
    """Ice by surface at the end of a record, since when, and what the ice protection did.

    Args:
        record: with the channels of both axes and thrust; torque and speed of rotation tell propeller ice.
        reference: clean flight of the same aircraft; its features at its end are taken from the record's.
        rival: of `model.RIVALS`.
        weights: folder of a training; what comes with the project if None.

    Returns:
        {"surfaces": {part: {"eta", "std", "probability", "protection", "probability_failed", "inflations"}},
         "classes": {name: probability}, "probability", "detected", "onset" (s or None), "gust" (m/s), "notes"}.

    Raises:
        InputError: a record that cannot be used, or is shorter than the first judgement.
    """
    character = online.load(rival, weights)
    memory, severity = online.init(1)
    if reference is not None:
        online.refer(memory, reference_features(reference, character))
    grid, watch = _pass(record, memory, severity, character)
    row = severity[0]
    if row["judged"] == 0.0:
        raise InputError(f"record '{record.meta.name}': {character.tuning.start:g} s of readable samples are needed")
    return _told(row, watch, _notes(grid, memory))


def reference_features(reference: FlightRecord, character: online.Character) -> FloatArray:
    """Features at the end of a clean flight [1, features]."""
    memory, severity = online.init(1)
    run, clean = _prepare(reference)
    _fly(run, memory, severity, clean, character)
    return features(memory.evidence, run.estimate[-1:], clean)


class _Run:
    """A record as rows to step over."""

    def __init__(self, grid: Grid, measurement: NDArray[np.void], estimate: NDArray[np.void],
                 switches: NDArray[np.void]) -> None:
        self.grid, self.measurement, self.estimate, self.switches = grid, measurement, estimate, switches


def _prepare(record: FlightRecord) -> tuple[_Run, NDArray[np.void]]:
    record = check(record)
    grid = common_grid(record)
    lacking = [name for names in absent(grid).values() for name in names]
    lacking += [name for name in NEEDED if name not in grid.values or not np.any(grid.values[name])]
    if lacking:
        raise InputError(f"record '{record.meta.name}' lacks {', '.join(dict.fromkeys(lacking))}: needed to tell ice")
    measurement = measurements(grid, record)
    if "temperature" in grid.values:  # `measurements` keeps the density only; judging needs the temperature itself
        scale = grid.values["temperature"]/measurement["temperature"]
        measurement["temperature"] *= scale
        measurement["pressure"] *= scale
    airframe = airframe_of_record(record, None)
    clean = published_clean()
    for name in airframe.dtype.names or ():
        clean[name] = airframe[name]
    switches = np.zeros(len(grid.time), SWITCHES)
    for name in SWITCHES.names or ():
        if name in grid.values:
            switches[name] = np.nan_to_num(grid.values[name]) > 0.5
    return _Run(grid, measurement, hinf_record.history(record, airframe=airframe).estimate, switches), clean


def _fly(run: _Run, memory: online.Memory, severity: NDArray[np.void], clean: NDArray[np.void],
         character: online.Character) -> None:
    for k in range(len(run.grid.time)):
        online.step(memory, severity, run.estimate[k:k + 1], run.measurement[k:k + 1], run.switches[k:k + 1], clean,
                    character, run.grid.dt)


def _pass(record: FlightRecord, memory: online.Memory, severity: NDArray[np.void],
          character: online.Character) -> tuple[Grid, np.void]:
    run, clean = _prepare(record)
    _fly(run, memory, severity, clean, character)
    return run.grid, memory.watch[0]


def _notes(grid: Grid, memory: online.Memory) -> list[str]:
    notes = []
    if not all(f"{what}_{side}" in grid.values for what in ("torque", "rpm") for side in ("left", "right")):
        notes.append("torque or speed of rotation was not recorded: propeller ice cannot be told")
    if not memory.referenced[0]:
        notes.append("no clean reference of this aircraft: severities rest on the type's derivatives")
    if "boots_wing" not in grid.values:
        notes.append("the switches of ice protection were not recorded: it cannot be judged")
    return notes


def _told(row: np.void, watch: np.void, notes: list[str]) -> dict[str, Any]:
    words = detection.verdicts(watch)
    surfaces = {}
    for part in PARTS:
        eta, std = float(row[f"eta_{part}"]), float(row[f"eta_{part}_std"])
        surfaces[part] = {
            "eta": eta, "std": std, "probability": detection.exceeds(eta, std, ICED), "protection": words[part],
            "probability_failed": float(row[f"p_failed_{part}"]), "inflations": int(row[f"tested_{part}"])}
    onset = float(row["onset"])
    return {"surfaces": surfaces, "classes": {name: float(row[f"p_{name}"]) for name in CLASSES},
            "probability": float(row["p_iced"]), "detected": bool(row["ice_detected"] > 0.0),
            "onset": None if np.isnan(onset) else onset, "gust": float(row["gust"]), "notes": notes}
